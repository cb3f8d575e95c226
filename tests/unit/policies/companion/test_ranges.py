"""What range finders tell, as messages, put in the order of training."""

import numpy as np
import pytest

from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import encode
from autopilot.mavlink.wire.convert import UINT16_MAX, wxyz_from_quat
from common.attitude import inverse, product, quat_of
from common.range_sectors import RANGE_M, SECTORS
from policies.companion.ranges import OLD_US, Ranges
from policies.companion.vehicle_link import VehicleLink

BODY, NORTH = 12, 0
REACH_CM = 3000


class Vehicle:
    """Its end of the link, with what a companion makes of it."""

    def __init__(self, yaw_rad=0.0, pitch_rad=0.0):
        self.end, companion_end = memory_pair()
        self.link = VehicleLink(companion_end)
        self.ranges = Ranges(self.link)
        self.q = quat_of(yaw_rad, pitch_rad)
        q1, q2, q3, q4 = wxyz_from_quat(self.q)
        self.tell("ATTITUDE_QUATERNION", q1=q1, q2=q2, q3=q3, q4=q4)

    def tell(self, name, compid=1, time_us=0, **fields):
        self.end.send(encode(name, 1, compid, 0, **fields))
        self.link.receive(time_us)

    def sectors(self, centimetres, first_deg, increment_deg=5.0, frame=BODY, time_us=0):
        self.tell(
            "OBSTACLE_DISTANCE", compid=196, time_us=time_us, time_usec=time_us + 1, distances=tuple(centimetres),
            increment=round(increment_deg), increment_f=increment_deg, angle_offset=first_deg, frame=frame,
            min_distance=20, max_distance=REACH_CM,
        )  # fmt: skip

    def beam(self, elevation_deg, centimetres, q_ned_from_beam=None):
        q = product(inverse(self.q), q_ned_from_beam or quat_of(0.0, np.radians(elevation_deg)))
        self.tell(
            "DISTANCE_SENSOR", compid=196, orientation=100, quaternion=wxyz_from_quat(q), current_distance=centimetres,
            min_distance=20, max_distance=REACH_CM,
        )  # fmt: skip


def bins(**at):
    distances = [REACH_CM + 1] * 72
    for index, centimetres in at.items():
        distances[int(index[1:])] = centimetres
    return distances


def test_sectors_of_training_are_taken_as_they_are():
    vehicle = Vehicle()
    vehicle.sectors(bins(b0=150, b47=900), -117.5)
    assert vehicle.ranges.take_new()
    assert not vehicle.ranges.take_new()
    assert [vehicle.ranges.ranges_m[k] for k in (0, 1, 46, 47)] == pytest.approx([1.5, RANGE_M, RANGE_M, 9.0])


def test_what_is_farther_than_in_training_is_no_return():
    vehicle = Vehicle()
    vehicle.sectors(bins(b0=2500), -117.5)
    assert vehicle.ranges.ranges_m[0] == RANGE_M


def test_a_ring_whose_bins_lie_across_two_sectors_counts_in_both():
    vehicle = Vehicle()
    vehicle.sectors(bins(b0=300, b36=100), 0.0)  # as the autopilot's own ring: from the nose, all round
    near = [k for k in range(SECTORS) if vehicle.ranges.ranges_m[k] < RANGE_M]
    assert near == [23, 24]  # to either side of the nose; what is behind is not looked at


def test_distances_by_north_are_turned_to_the_nose():
    vehicle = Vehicle(yaw_rad=np.radians(90.0))
    vehicle.sectors(bins(b18=300), 2.5, frame=NORTH)  # a little to the right of east, which is ahead
    assert [k for k in range(SECTORS) if vehicle.ranges.ranges_m[k] < RANGE_M] == [24]


def test_a_scan_that_is_sent_again_is_not_new():
    vehicle = Vehicle()
    vehicle.sectors(bins(), -117.5)
    vehicle.ranges.take_new()
    vehicle.sectors(bins(), -117.5)
    assert not vehicle.ranges.take_new()


def test_a_beam_is_known_by_where_it_looks_once_levelled():
    vehicle = Vehicle(pitch_rad=np.radians(-25.0))
    for elevation_deg, centimetres in ((-30.0, 400), (-12.0, 900), (12.0, 1100), (30.0, REACH_CM + 1)):
        vehicle.beam(elevation_deg, centimetres)
    assert vehicle.ranges.ranges_m[SECTORS:] == pytest.approx([4.0, 9.0, 11.0, RANGE_M])


def test_beams_that_look_elsewhere_are_left_out():
    vehicle = Vehicle()
    vehicle.beam(0.0, 300)
    vehicle.beam(-12.0, 300, quat_of(np.radians(90.0), np.radians(-12.0)))
    vehicle.tell("DISTANCE_SENSOR", orientation=25, current_distance=300, max_distance=REACH_CM)
    assert (vehicle.ranges.ranges_m == RANGE_M).all()


def test_there_is_trouble_until_all_that_is_needed_is_there_and_fresh():
    vehicle = Vehicle()
    assert vehicle.ranges.trouble(0) == "no ranges all round"
    vehicle.sectors([*bins()[:30], *[UINT16_MAX] * 42], -117.5)
    assert vehicle.ranges.trouble(0) == "the range finder does not look round far enough"
    vehicle.sectors(bins(), -117.5, time_us=1)
    assert vehicle.ranges.trouble(0) == "no ranges of the tilted beams"
    for elevation_deg in (-30.0, -12.0, 12.0, 30.0):
        vehicle.beam(elevation_deg, 400)
    assert vehicle.ranges.trouble(0) == ""
    assert vehicle.ranges.trouble(OLD_US + 2) == "no ranges all round"


@pytest.mark.parametrize("fields", [{"increment_f": 0.0, "increment": 0}, {"angle_offset": np.inf}, {"frame": 7}])
def test_numbers_that_say_nothing_are_left_out(fields):
    vehicle = Vehicle()
    message = {"distances": (100,) * 72, "increment_f": 5.0, "max_distance": REACH_CM, "frame": BODY, "time_usec": 9}
    vehicle.tell("OBSTACLE_DISTANCE", **(message | fields))
    assert not vehicle.ranges.take_new()
    assert (vehicle.ranges.ranges_m == RANGE_M).all()


def test_a_sender_with_a_clock_of_its_own_is_taken_to_tell_of_now():
    vehicle = Vehicle()
    vehicle.tell("ATTITUDE_QUATERNION", time_boot_ms=9_000, q1=1.0)
    vehicle.sectors(bins(), -117.5, time_us=8_900_000)
    assert vehicle.ranges.taken_us == 8_900_001
    vehicle.sectors(bins(), -117.5, time_us=1_700_000_000_000_000)
    assert vehicle.ranges.taken_us == 9_000_000


def test_a_beam_that_comes_late_is_levelled_by_the_attitude_of_when_it_was_measured():
    vehicle = Vehicle()
    level, pitched = wxyz_from_quat(quat_of(0.0, 0.0)), wxyz_from_quat(quat_of(0.0, np.radians(-25.0)))
    vehicle.tell("LOCAL_POSITION_NED", time_boot_ms=1_000)
    for time_ms, (q1, q2, q3, q4) in ((1_000, level), (1_200, pitched)):
        vehicle.tell("ATTITUDE_QUATERNION", time_boot_ms=time_ms, q1=q1, q2=q2, q3=q3, q4=q4)
        vehicle.ranges.follow()
    q_frd_from_beam = quat_of(0.0, np.radians(12.0))
    vehicle.tell(
        "DISTANCE_SENSOR", compid=196, orientation=100, quaternion=wxyz_from_quat(q_frd_from_beam), time_boot_ms=1_000,
        current_distance=400, min_distance=20, max_distance=REACH_CM,
    )  # fmt: skip
    assert vehicle.ranges.ranges_m[SECTORS:] == pytest.approx([RANGE_M, RANGE_M, 4.0, RANGE_M])


def test_a_scan_that_comes_late_is_shown_from_where_the_vehicle_is_now_and_beams_as_they_were_measured():
    vehicle = Vehicle()
    for time_ms, north_m in ((1_000, 0.0), (1_200, 1.0)):
        vehicle.tell("LOCAL_POSITION_NED", time_boot_ms=time_ms, x=north_m)
        vehicle.tell("ATTITUDE_QUATERNION", time_boot_ms=time_ms, q1=1.0)
        vehicle.ranges.follow()
    vehicle.sectors(bins(b24=500), -117.5, time_us=999_999)  # right beside the nose
    vehicle.beam(-30.0, 400)
    assert vehicle.ranges.from_here()[24] == pytest.approx(4.0, abs=0.02)
    assert vehicle.ranges.from_here()[SECTORS:] == pytest.approx(vehicle.ranges.ranges_m[SECTORS:])
    assert vehicle.ranges.ranges_m[24] == pytest.approx(5.0)  # what was measured stays: the guard has poses of its own


def moving(*places, yaw_rad=0.0):
    """A vehicle that was at these places, a tenth of a second apart from one second on, in flight eastwards."""
    vehicle = Vehicle()
    q1, q2, q3, q4 = wxyz_from_quat(quat_of(yaw_rad, 0.0))
    for k, (north_m, east_m) in enumerate(places):
        time_ms = 1_000 + 100 * k
        vehicle.tell("LOCAL_POSITION_NED", time_boot_ms=time_ms, x=north_m, y=east_m, vy=4.0)
        vehicle.tell("ATTITUDE_QUATERNION", time_boot_ms=time_ms, q1=q1, q2=q2, q3=q3, q4=q4)
        vehicle.ranges.follow()
    return vehicle


def test_what_was_abeam_is_behind_after_a_flight_ahead_and_nearer_after_one_towards_it():
    ahead = moving((0.0, 0.0), (0.0, 0.4), (0.0, 0.8), yaw_rad=np.radians(90.0))  # its nose east
    ahead.sectors(bins(b42=200), -117.5, time_us=999_999)  # 92.5 degrees right: south
    shown = ahead.ranges.from_here()
    bearing_deg = 92.5 + np.degrees(np.arctan2(0.8 * np.sin(np.radians(92.5)), 2.0 - 0.8 * np.cos(np.radians(92.5))))
    (at,) = np.flatnonzero(shown[:SECTORS] < RANGE_M)
    assert abs(5.0 * at - 117.5 - bearing_deg) < 2.6
    assert shown[at] == pytest.approx(np.hypot(2.0, 0.8), abs=0.1)
    towards = moving((0.0, 0.0), (-0.4, 0.0), (-0.8, 0.0), yaw_rad=np.radians(90.0))  # it drifts south
    towards.sectors(bins(b42=200), -117.5, time_us=999_999)
    assert towards.ranges.from_here()[:SECTORS].min() == pytest.approx(1.2, abs=0.05)


@pytest.mark.parametrize("places", [[(0.0, 0.0), (0.0, 50.0)], [(0.0, 0.0)] * 7])
def test_a_scan_is_shown_as_it_was_measured_after_a_jump_of_the_estimate_and_when_it_is_old(places):
    vehicle = moving(*places)
    vehicle.sectors(bins(b24=500), -117.5, time_us=999_999)
    assert vehicle.ranges.from_here()[24] == pytest.approx(5.0)


def test_a_stamp_of_before_all_poses_moves_nothing():
    vehicle = moving((0.0, 0.0), (0.0, 0.4))
    vehicle.sectors(bins(b24=500), -117.5, time_us=700_000)
    assert vehicle.ranges.from_here()[24] == pytest.approx(5.0)


def test_a_scan_is_shown_as_it_was_measured_where_nobody_knows_where_that_was():
    vehicle = Vehicle()
    vehicle.sectors(bins(b24=500), -117.5)
    assert vehicle.ranges.from_here()[24] == pytest.approx(5.0)
