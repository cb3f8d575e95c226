"""Numbers of any size: whatever message they come in, the vehicle is asked for nothing that it cannot mean."""

from dataclasses import astuple, is_dataclass
from math import inf, isfinite, isnan, nan
from zlib import crc32

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import TargetReport
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.wire.codec import frame_bytes, known_type
from autopilot.mavlink.wire.number_bounds import (
    PARAMETER_MAX,
    POSITION_MAX_M,
    RATE_MAX_RAD_S,
    SPEED_MAX_M_S,
    first_outside,
    is_known,
    is_within,
)
from tests.unit.autopilot.mavlink.components.payload_rig import PayloadRig
from tests.unit.autopilot.mavlink.rig import Rig, texts

LARGEST = 3.4028234e38  # that single precision knows
EXTREMES = [nan, inf, -inf, LARGEST, -LARGEST, 3.4e38, -3.4e38, 1e30, -1e30, 1e-45, -1e-45, 2e10, 2e6, 0.0, 1.0, -1.0]
HANDLED = sorted(Rig().server.message_handlers())
TURNED_M = 2.0**0.5 * POSITION_MAX_M + 100.0  # an offset across the axes, counted from where the vehicle is


@pytest.mark.parametrize("value", [0.0, -0.5, 2.0, -2.0])
def test_what_is_within_its_limit_is_both(value):
    assert is_within(2.0, 0.0, value)
    assert is_known(2.0, 0.0, value)
    assert first_outside(2.0, [0.0, value]) is None


@pytest.mark.parametrize("value", [2.0001, -2.0001, inf, -inf])
def test_what_is_beyond_is_neither(value):
    assert not is_within(2.0, 0.0, value)
    assert not is_known(2.0, 0.0, value)
    assert first_outside(2.0, [nan, 0.0, value, value]) == 2


def test_what_is_not_set_is_within_and_not_known():
    assert is_within(2.0, nan)
    assert not is_known(2.0, nan)


def floats_in(value):
    if isinstance(value, float):
        yield value
    elif is_dataclass(value):
        yield from floats_in(astuple(value))
    elif isinstance(value, tuple | list):
        for element in value:
            yield from floats_in(element)


def fields_of(rng, kind, commands):
    """Any bits, and in the floats extremes."""
    fields = kind.unpack(rng.bytes(kind.size))._asdict()
    for name, value in fields.items():
        if isinstance(value, float):
            fields[name] = float(rng.choice(EXTREMES))
        elif isinstance(value, tuple) and isinstance(value[0], float):
            fields[name] = [float(extreme) for extreme in rng.choice(EXTREMES, len(value))]
        elif isinstance(value, int) and rng.random() < 0.8:
            fields[name] = value & int(rng.choice((0x0, 0x1, 0x3, 0xF)))
    if kind.name.startswith("COMMAND_"):
        fields["command"] = int(rng.choice(commands))
    return fields | {name: 1 for name in ("target_system", "target_component") if name in fields}


@pytest.mark.parametrize("dialect", [PX4, ARDUPILOT], ids=lambda dialect: dialect.name)
@pytest.mark.parametrize("name", HANDLED)
def test_extremes_in_any_message_become_no_request_that_cannot_be_meant(name, dialect):
    rig = PayloadRig(dialect=dialect)
    rng = np.random.default_rng(crc32(name.encode()))
    kind, commands = known_type(name), sorted(rig.server.command_handlers())
    for _ in range(200 if name.startswith("COMMAND_") else 20):
        fields = fields_of(rng, kind, commands)
        rig.client.link.send(frame_bytes(kind, kind.pack(**fields), 0, 255, 190))
        rig.frame()
        asked = [*floats_in(rig.vehicle.calls), *floats_in(rig.vehicle.setpoints)]
        assert all(isnan(value) or abs(value) <= max(PARAMETER_MAX, TURNED_M) for value in asked), fields
        rig.vehicle.calls.clear()
        rig.vehicle.setpoints.clear()


def refused(name, rig=None, **fields):
    """The texts that a message causes, with nothing asked of the vehicle."""
    rig = rig or Rig()
    rig.client.send(name, **fields)
    reported = texts(rig.frame())
    assert not rig.vehicle.calls
    assert not rig.vehicle.setpoints
    return reported


@pytest.mark.parametrize(
    ("mask", "fields", "what"),
    [
        (0b110111000111, {"vx": 3.4e38, "vy": -3.4e38}, "velocity"),  # turned by the heading: beyond single precision
        (0b110111000111, {"vx": 1500.0}, "velocity"),
        (0b110111111000, {"x": 2.0e6}, "position"),
        (0b110000111111, {"afx": 1e30}, "acceleration"),
        (0b100111000111, {"yaw": inf}, "heading"),
        (0b010111000111, {"yaw_rate": 1e9}, "yaw rate"),
    ],
)
@pytest.mark.parametrize("frame", [1, 8])
def test_setpoints_out_of_range_are_refused_with_the_reason(mask, fields, what, frame):
    reported = refused("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=frame, type_mask=mask, **fields)
    assert reported == [f"Offboard: the {what} is out of range"]


def test_what_is_masked_may_be_anything():
    rig = Rig()
    garbage = {"x": inf, "y": 3.4e38, "z": -inf, "afx": inf, "afy": 1e30, "yaw": inf, "yaw_rate": -3.4e38}
    rig.client.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=0b110111000111, vx=2.0, **garbage)
    rig.frame()
    assert [setpoint.vel_ned for setpoint in rig.vehicle.setpoints] == [(2.0, 0.0, 0.0)]


def test_body_rates_out_of_range_are_refused_with_the_reason():
    reported = refused("SET_ATTITUDE_TARGET", type_mask=128, body_yaw_rate=2.0 * RATE_MAX_RAD_S, thrust=0.5)
    assert reported == ["Offboard: the body rate is out of range"]


def follow_target(rig, **fields):
    position = {"lat": 473977420, "lon": 85455940, "alt": 490.0}
    rig.client.send("FOLLOW_TARGET", **position | fields)
    reported = texts(rig.frame())
    return [call for call in rig.vehicle.calls if isinstance(call, TargetReport)], reported


def test_target_faster_than_anything_is_refused_with_the_reason():
    reports, reported = follow_target(Rig(), est_capabilities=3, vel=(3.4e38, 0.0, 0.0))
    assert not reports
    assert reported == ["Follow: the target's velocity is out of range"]


def test_target_without_a_velocity_is_still_a_place():
    (report,), _ = follow_target(Rig(), est_capabilities=3, vel=(nan, 0.0, 0.0), position_cov=(3.4e38, inf, nan))
    assert report.vel_ned is None
    assert report.pos_std < 2.0


@pytest.mark.parametrize(
    "fields",
    [
        {"distance": inf},  # times an angle of zero it would be NaN, and stay
        {"distance": 3.4e38, "angle_x": 0.1},
        {"position_valid": 1, "frame": 8, "x": 3.4e38, "y": -3.4e38, "z": 3.4e38},
        {"position_valid": 1, "frame": 1, "x": 2e6},
    ],
)
def test_landing_target_out_of_range_is_refused_with_the_reason(fields):
    (reported,) = refused("LANDING_TARGET", **fields)
    assert reported.startswith("Landing target: the ")
    assert reported.endswith(" is out of range")


@pytest.mark.parametrize("value", [inf, 3.4e38, -2e10])
def test_command_out_of_range_is_denied_with_its_place(value):
    rig = Rig()
    rig.client.command(mavlink.MAV_CMD_DO_GO_AROUND, value)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [mavlink.MAV_RESULT_DENIED]
    assert texts(messages) == ["Abort landing: parameter 1 is out of range"]
    assert not rig.vehicle.calls


def test_gimbal_is_not_pointed_at_angles_out_of_range():
    rig = PayloadRig()
    take_control(rig)
    aim = rig.vehicle.gimbal.gimbal.aim
    for extreme in (inf, 3.4e38, -1e30):
        rig.client.send("GIMBAL_MANAGER_SET_PITCHYAW", pitch=extreme, yaw=0.0, pitch_rate=nan, yaw_rate=nan)
        rig.client.send("GIMBAL_MANAGER_SET_PITCHYAW", pitch=nan, yaw=nan, pitch_rate=extreme, yaw_rate=nan)
        rig.frame()
    after = rig.vehicle.gimbal.gimbal.aim
    assert (after.pitch, after.yaw) == (aim.pitch, aim.yaw)
    assert not isfinite(after.pitch_rate) or abs(after.pitch_rate) <= RATE_MAX_RAD_S


def take_control(rig):
    rig.client.command(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, -2.0, -2.0, -1.0, -1.0, nan, nan, 0.0)
    rig.frame()


@pytest.mark.parametrize("fields", [{"angle_offset": 3.4e38}, {"increment_f": inf}, {"angle_offset": nan}])
def test_obstacles_at_no_bearing_are_refused_with_the_reason(fields):
    rig = Rig()
    before = list(rig.vehicle.obstacles._seen_us)
    distances = {"distances": (100,) * 72, "max_distance": 1000, "frame": 12, "increment": 5}
    rig.client.send("OBSTACLE_DISTANCE", **distances | fields)
    assert texts(rig.frame()) == ["Obstacles: the bearing is out of range"]
    assert rig.vehicle.obstacles._seen_us == before


def test_vision_beyond_any_hall_is_refused_and_an_endless_variance_is_none():
    rig = Rig()
    rig.vehicle.params.set("EKF2_EV_CTRL", 15)
    rig.client.send("VISION_POSITION_ESTIMATE", x=2.0 * POSITION_MAX_M)
    assert texts(rig.frame()) == ["External position: the position is not one"]
    rig.client.send("VISION_SPEED_ESTIMATE", x=2.0 * SPEED_MAX_M_S)
    assert not rig.vehicle.external.waiting
    rig.client.send("VISION_POSITION_ESTIMATE", x=1.0, covariance=(3.4e38,) * 21)
    rig.frame()
    assert not rig.vehicle.external.waiting
