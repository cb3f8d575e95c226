"""The gimbal manager and device over MAVLink: control, angles, rates, frames, places, the older mount commands."""

from math import atan2, degrees, isclose, nan

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Verdict
from autopilot.payload.gimbal.gimbal import PITCH_MIN, YAW_MAX
from tests.unit.autopilot.mavlink.components.payload_rig import GIMBAL, PayloadRig
from tests.unit.autopilot.mavlink.rig import Rig, texts

ACCEPTED, DENIED, UNSUPPORTED = Verdict.ACCEPTED, Verdict.DENIED, Verdict.UNSUPPORTED
REQUEST, PITCHYAW, CONFIGURE = 512, 1000, 1001
MANAGER_INFORMATION, MANAGER_STATUS, DEVICE_INFORMATION, ATTITUDE = 280, 281, 283, 285
LOCK = mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK
ROLL_AND_PITCH = mavlink.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | mavlink.GIMBAL_MANAGER_FLAGS_PITCH_LOCK


@pytest.fixture
def rig():
    return PayloadRig()


def yaw_deg_of(q_wxyz):
    w, x, y, z = q_wxyz
    return degrees(atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def attitude(rig, frames=1):
    rig.frame(frames - 1) if frames > 1 else None
    rig.to(GIMBAL, REQUEST, ATTITUDE)
    return next(m.fields for m in rig.frame() if m.name == "GIMBAL_DEVICE_ATTITUDE_STATUS")


def angles(rig):
    """Pitch and yaw from the nose [deg] after all motion."""
    rig.frame(250)
    gimbal = rig.vehicle.gimbal.gimbal
    gimbal.update()
    return degrees(gimbal.pitch), degrees(gimbal.yaw)


def test_manager_is_found_by_its_information_and_then_tells_its_status():
    rig = PayloadRig()
    names = {message.name for message in rig.frame(100)}
    assert not names & {"GIMBAL_MANAGER_STATUS", "GIMBAL_DEVICE_ATTITUDE_STATUS"}
    rig.to(1, REQUEST, MANAGER_INFORMATION)
    messages = rig.frame(50)
    (information,) = [m.fields for m in messages if m.name == "GIMBAL_MANAGER_INFORMATION"]
    assert information.gimbal_device_id == GIMBAL
    assert information.pitch_min == pytest.approx(PITCH_MIN)
    statuses = [m for m in messages if m.name == "GIMBAL_MANAGER_STATUS"]
    assert {m.compid for m in statuses} == {1}
    assert len(statuses) == pytest.approx(5, abs=1)
    attitudes = [m for m in messages if m.name == "GIMBAL_DEVICE_ATTITUDE_STATUS"]
    assert {m.compid for m in attitudes} == {GIMBAL}
    assert len(attitudes) == pytest.approx(10, abs=1)
    assert [m for m in rig.second_client.received() if m.name == "GIMBAL_MANAGER_STATUS"] == []


def test_a_vehicle_without_a_gimbal_says_so():
    rig = Rig()
    assert rig.ack(REQUEST, MANAGER_INFORMATION).result == UNSUPPORTED
    assert rig.ack(PITCHYAW, -30.0, 0.0).result == UNSUPPORTED


def test_device_tells_its_information(rig):
    rig.to(GIMBAL, REQUEST, DEVICE_INFORMATION)
    (information,) = [m.fields for m in rig.frame() if m.name == "GIMBAL_DEVICE_INFORMATION"]
    assert information.yaw_max == pytest.approx(YAW_MAX)


def test_angles_are_taken_at_the_motors_rate(rig):
    assert rig.ack(PITCHYAW, -45.0, 90.0, nan, nan, 0.0, 0.0, 0.0).result == ACCEPTED
    gimbal = rig.vehicle.gimbal.gimbal
    rig.frame(25)  # 0.5 s at 90 deg/s
    gimbal.update()
    assert degrees(gimbal.pitch) == pytest.approx(-45.0, abs=0.1)
    assert degrees(gimbal.yaw) == pytest.approx(45.0, abs=2.0)
    assert angles(rig) == pytest.approx((-45.0, 90.0))


def test_angles_out_of_range_go_to_its_end(rig):
    rig.ack(PITCHYAW, -170.0, 179.0, nan, nan, 0.0, 0.0, 0.0)
    assert angles(rig) == pytest.approx((-90.0, 160.0))


def test_nan_leaves_an_axis_alone(rig):
    rig.ack(PITCHYAW, -30.0, 20.0, nan, nan, 0.0, 0.0, 0.0)
    rig.frame(100)
    rig.ack(PITCHYAW, nan, -40.0, nan, nan, 0.0, 0.0, 0.0)
    assert angles(rig) == pytest.approx((-30.0, -40.0))
    rig.ack(PITCHYAW, 10.0, nan, nan, nan, 0.0, 0.0, 0.0)
    assert angles(rig) == pytest.approx((10.0, -40.0))


def test_rates_turn_it_until_they_end(rig):
    rig.ack(PITCHYAW, nan, nan, -10.0, 20.0, 0.0, 0.0, 0.0)
    rig.frame(50)
    rig.ack(PITCHYAW, nan, nan, 0.0, 0.0, 0.0, 0.0, 0.0)
    pitch, yaw = angles(rig)
    assert pitch == pytest.approx(-10.0, abs=0.5)
    assert yaw == pytest.approx(20.0, abs=1.0)


def test_yaw_follows_the_vehicle_unless_it_is_locked(rig):
    state = rig.vehicle.state
    state.yaw_rad = 0.0
    rig.ack(PITCHYAW, 0.0, 30.0, nan, nan, 0.0, 0.0, 0.0)
    rig.frame(100)
    state.yaw_rad = 0.5
    followed = attitude(rig)
    assert followed.flags == ROLL_AND_PITCH | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    assert yaw_deg_of(followed.q) == pytest.approx(30.0, abs=0.1)
    assert followed.delta_yaw == pytest.approx(0.5)

    rig.ack(PITCHYAW, 0.0, 90.0, nan, nan, float(LOCK), 0.0, 0.0)
    rig.frame(150)
    state.yaw_rad = 1.0
    locked = attitude(rig)
    assert locked.flags == ROLL_AND_PITCH | LOCK | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
    assert yaw_deg_of(locked.q) == pytest.approx(90.0, abs=0.1)


@pytest.mark.parametrize(
    ("flags", "yaw_deg"),
    [
        (mavlink.GIMBAL_MANAGER_FLAGS_YAW_IN_EARTH_FRAME, 90.0 - degrees(0.5)),
        (mavlink.GIMBAL_MANAGER_FLAGS_YAW_IN_VEHICLE_FRAME, 90.0),
        (LOCK | mavlink.GIMBAL_MANAGER_FLAGS_YAW_IN_VEHICLE_FRAME, 90.0),
        (LOCK, 90.0 - degrees(0.5)),
        (mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL, 0.0),
    ],
)
def test_flags_decide_where_yaw_is_counted_from(rig, flags, yaw_deg):
    rig.vehicle.state.yaw_rad = 0.5
    rig.ack(PITCHYAW, 0.0, 90.0, nan, nan, float(flags), 0.0, 0.0)
    assert angles(rig)[1] == pytest.approx(yaw_deg, abs=0.01)


def test_it_cannot_be_retracted(rig):
    assert rig.ack(PITCHYAW, 0.0, 0.0, nan, nan, 1.0, 0.0, 0.0).result == DENIED


def test_camera_stays_level_when_the_vehicle_leans(rig):
    rig.vehicle.state.roll_rad, rig.vehicle.state.pitch_rad = 0.4, -0.3
    w, x, y, z = attitude(rig).q
    assert (x, y) == pytest.approx((0.0, 0.0))
    assert isclose(w * w + z * z, 1.0, abs_tol=1e-6)


def test_who_has_control_points_it_and_others_do_not(rig):
    assert rig.ack(CONFIGURE, -2.0, -2.0, -1.0, -1.0, nan, nan, 0.0).result == ACCEPTED
    rig.second_client.command(PITCHYAW, -30.0, 0.0, nan, nan, 0.0, 0.0, 0.0)
    messages = rig.frame()
    (ack,) = [m.fields for m in rig.second_client.received() if m.name == "COMMAND_ACK"]
    assert ack.result == DENIED
    assert any("not in control" in text for text in texts(messages))
    assert rig.ack(PITCHYAW, -30.0, 0.0, nan, nan, 0.0, 0.0, 0.0).result == ACCEPTED
    rig.to(1, REQUEST, MANAGER_STATUS)
    status = next(m.fields for m in rig.frame() if m.name == "GIMBAL_MANAGER_STATUS")
    assert (status.primary_control_sysid, status.primary_control_compid) == (rig.client.sysid, rig.client.compid)
    assert status.gimbal_device_id == GIMBAL


def test_control_is_given_shared_and_released(rig):
    other = rig.second_client
    control = rig.vehicle.gimbal
    rig.ack(
        CONFIGURE, float(rig.client.sysid), float(rig.client.compid), float(other.sysid), float(other.compid), 0, 0, 0
    )
    assert control.control.secondary == (other.sysid, other.compid)
    other.command(PITCHYAW, -30.0, 0.0, nan, nan, 0.0, 0.0, 0.0)
    rig.frame()
    assert [m.fields.result for m in other.received() if m.name == "COMMAND_ACK"] == [ACCEPTED]
    other.command(CONFIGURE, -3.0, -3.0, -1.0, -1.0, nan, nan, 0.0)  # not the primary: nothing to give up
    rig.frame()
    assert control.control.primary == (rig.client.sysid, rig.client.compid)
    rig.ack(CONFIGURE, -3.0, -3.0, 0.0, 0.0, nan, nan, 0.0)
    assert control.control.primary == control.control.secondary == (0, 0)
    assert rig.ack(CONFIGURE, 300.0, 1.0, -1.0, -1.0, nan, nan, 0.0).result == DENIED
    assert rig.ack(CONFIGURE, -2.0, -2.0, -1.0, -1.0, nan, nan, 171.0).result == DENIED


def test_messages_point_it_as_the_command_does(rig):
    rig.client.send(
        "GIMBAL_MANAGER_SET_PITCHYAW", target_component=1, pitch=-0.5, yaw=0.4, pitch_rate=nan, yaw_rate=nan
    )
    assert angles(rig) == pytest.approx((degrees(-0.5), degrees(0.4)))
    rig.client.send(
        "GIMBAL_MANAGER_SET_ATTITUDE",
        target_component=1,
        q=(0.9238795, 0.0, -0.3826834, 0.0),
        angular_velocity_x=nan,
        angular_velocity_y=nan,
        angular_velocity_z=nan,
    )
    assert angles(rig) == pytest.approx((-45.0, 0.0), abs=1e-3)
    rig.client.send(
        "GIMBAL_MANAGER_SET_MANUAL_CONTROL", target_component=1, pitch=-1.0, yaw=0.5, pitch_rate=nan, yaw_rate=nan
    )
    assert angles(rig) == pytest.approx((-90.0, 80.0))


def test_place_is_looked_at_and_left(rig):
    state, control = rig.vehicle.state, rig.vehicle.gimbal
    state.yaw_rad = 0.0
    north, east, down = state.estimate.pos_ned
    control.gimbal.look_at((north + 20.0, east + 20.0, down + 20.0))
    pitch, yaw = angles(rig)
    assert yaw == pytest.approx(45.0)
    assert pitch == pytest.approx(-degrees(atan2(1.0, 2.0**0.5)))
    state.estimate = state.estimate._replace(pos_ned=(north + 20.0, east, down))
    assert angles(rig)[1] == pytest.approx(90.0)
    home = state.home
    assert control.run(195, (0.0, nan, nan, nan), home.lat_deg, home.lon_deg, nan).verdict == ACCEPTED
    assert control.run(195, (0.0, nan, nan, nan), 91.0, 0.0, 0.0).verdict == DENIED
    assert control.run(197, (0.0, nan, nan, nan), nan, nan, nan).verdict == ACCEPTED
    assert angles(rig) == pytest.approx((0.0, 0.0))


def test_older_mount_commands_point_it(rig):
    assert rig.ack(205, -20.0, 0.0, 30.0, 0.0, 0.0, 0.0, 2.0).result == ACCEPTED
    assert angles(rig) == pytest.approx((-20.0, 30.0))
    assert rig.ack(204, 1.0).result == ACCEPTED
    assert angles(rig) == pytest.approx((0.0, 0.0))
    home = rig.vehicle.state.home
    assert rig.ack(205, 0.0, 0.0, 0.0, home.alt_m, home.lat_deg, home.lon_deg, 4.0).result == ACCEPTED
    assert angles(rig)[0] < -10.0
    assert rig.ack(205, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0).result == UNSUPPORTED
    rig.to(1, REQUEST, 265)
    assert len([m for m in rig.frame() if m.name == "MOUNT_ORIENTATION"]) == 1


def test_camera_looks_along_the_gimbal_whatever_the_vehicle_does(rig):
    """The joints undo the attitude by estimate: estimate times joints is where the gimbal points."""
    gimbal = rig.vehicle.gimbal.gimbal
    rig.ack(PITCHYAW, -30.0, 40.0, nan, nan, 0.0, 0.0, 0.0)
    rig.frame(100)
    x, y, z, w = gimbal.q_frd_from_rdf()
    ex, ey, ez, ew = rig.vehicle.state.estimate.q_ned_from_frd
    product_w = ew * w - ex * x - ey * y - ez * z
    assert abs(product_w) == pytest.approx(abs(gimbal.q_ned_from_rdf()[3]), abs=1e-6)
