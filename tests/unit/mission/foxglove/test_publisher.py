"""States on channels, read back from an MCAP file."""

from math import inf, nan, pi

import pytest
from scipy.spatial.transform import Rotation

from common.attitude import quat_of
from common.geodesy import GeoPoint, ned_from_geodetic
from mission.foxglove.channels import CHANNELS
from mission.foxglove.mcap_file import McapFile
from mission.foxglove.publisher import Publisher
from mission.foxglove.vehicle_state import Battery, GnssFix, Motion, VehicleState
from tests.unit.mission.foxglove.mcap_messages import read, us_of

HOME = GeoPoint(47.4, 8.5, 488.0)
EAST = quat_of(0.5 * pi, 0.0)
TRUE = Motion((10.0, 20.0, -30.0), (1.0, 2.0, 3.0), EAST, (0.1, 0.2, 0.3))
FRAME_US = 20_000


def published(path, *states):
    file = McapFile(path)
    publisher = Publisher(file.context)
    for state in states:
        publisher.publish(state, [])
    file.close()
    return read(path)


def test_a_pose_is_where_the_vehicle_is(tmp_path):
    (message,) = published(tmp_path / "flight.mcap", VehicleState(FRAME_US, HOME, true=TRUE))["/pose/true"]
    pose = message.value.pose
    assert (message.value.frame_id, message.time_us, us_of(message.value.timestamp)) == ("map", FRAME_US, FRAME_US)
    assert (pose.position.x, pose.position.y, pose.position.z) == (20.0, 10.0, 30.0)
    turn = Rotation.from_quat([getattr(pose.orientation, axis) for axis in "xyzw"])
    assert turn.apply((1, 0, 0)) == pytest.approx((1, 0, 0), abs=1e-6)  # ahead is east


def test_without_truth_the_vehicle_is_where_it_believes_to_be(tmp_path):
    found = published(tmp_path / "flight.mcap", VehicleState(FRAME_US, HOME, est=TRUE))
    frames = {each.child_frame_id: each.translation.x for each in found["/tf"][0].value.transforms}
    assert frames == {"vehicle": 20.0, "vehicle_estimate": 20.0, "vehicle_level": 20.0}
    assert "/pose/true" not in found


def test_channels_keep_to_their_rates(tmp_path):
    states = [VehicleState(k * FRAME_US, HOME, true=TRUE, is_armed=True) for k in range(1, 501)]
    found = published(tmp_path / "flight.mcap", *states)
    rates = {spec.topic: spec.rate_hz for spec in CHANNELS}
    for topic in ("/tf", "/pose/true", "/location/true", "/trail/true", "/position", "/state"):
        assert len(found[topic]) == pytest.approx(10.0 * rates[topic], abs=1), topic


def test_a_place_on_the_map_is_the_geodetic_one(tmp_path):
    (message,) = published(tmp_path / "flight.mcap", VehicleState(FRAME_US, HOME, true=TRUE))["/location/true"]
    fix = message.value
    assert ned_from_geodetic(fix.latitude, fix.longitude, fix.altitude, HOME) == pytest.approx(TRUE.pos_ned, abs=1e-3)


def test_a_fix_comes_once_with_its_variances(tmp_path):
    fix = GnssFix(15_000, 47.4, 8.5, 490.0, 2.0, 3.0)
    states = [VehicleState(k * FRAME_US, HOME, true=TRUE, gnss=fix) for k in range(1, 100)]
    (message,) = published(tmp_path / "flight.mcap", *states)["/location/gnss"]
    assert list(message.value.position_covariance) == [4.0, 0, 0, 0, 4.0, 0, 0, 0, 9.0]
    assert us_of(message.value.timestamp) == 15_000


def test_what_is_not_known_is_left_out(tmp_path):
    broken = Motion((nan, 0.0, 0.0), (1.0, inf, 2.0), (nan,) * 4, (0.0, 0.0, 0.0))
    state = VehicleState(FRAME_US, HOME, true=broken, battery=Battery(16.0, nan, 0.5))
    found = published(tmp_path / "flight.mcap", state)
    assert found["/position"][0].value == {"true": {"east": 0.0, "down": 0.0}}
    assert found["/velocity"][0].value == {"true": {"north": 1.0, "down": 2.0}}
    assert found["/battery"][0].value == {"voltage_v": 16.0, "remaining": 0.5}
    assert "/pose/true" not in found


def test_a_ring_grows_to_the_left(tmp_path):
    """Ours begins at the nose and goes to the right; the second of four is what is to the right."""
    state = VehicleState(FRAME_US, HOME, est=TRUE, ring_m=(1.0, 2.0, inf, 4.0), ring_time_us=FRAME_US)
    (message,) = published(tmp_path / "flight.mcap", state)["/ring"]
    scan = message.value
    assert list(scan.ranges) == [1.0, 4.0, inf, 2.0]
    assert (scan.start_angle, scan.end_angle) == (0.0, pytest.approx(1.5 * pi))
    assert scan.frame_id == "vehicle_level"


def test_the_same_states_make_the_same_bytes(tmp_path):
    states = [VehicleState(k * FRAME_US, HOME, true=TRUE, est=TRUE, outputs=(0.5,) * 4) for k in range(1, 200)]
    for name in ("one", "other"):
        published(tmp_path / name, *states)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_a_text_has_its_severity(tmp_path):
    file = McapFile(tmp_path / "flight.mcap")
    Publisher(file.context).text(1_500_000, 2, "Battery empty", 1_520_000)
    file.close()
    (message,) = read(tmp_path / "flight.mcap")["/log"]
    assert (message.value.message, message.value.level, us_of(message.value.timestamp)) == (
        "Battery empty",
        5,
        1_500_000,
    )


def test_a_disk_that_is_full_is_told_and_survived(tmp_path):
    (tmp_path / "flight.mcap.part").symlink_to("/dev/full")
    troubles = []
    file = McapFile(tmp_path / "flight.mcap", troubles.append)
    publisher = Publisher(file.context)
    for k in range(1, 2000):
        publisher.publish(VehicleState(k * FRAME_US, HOME, true=TRUE), [])
    file.close()
    assert troubles == ["flight.mcap ended: No space left on device"]
    assert not (tmp_path / "flight.mcap").exists()
