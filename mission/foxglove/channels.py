"""The channels that Foxglove gets: topic, schema, rate. The table of the documentation is made from them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite, pi
from typing import Any

from common.attitude import roll_pitch_yaw_of
from mission.foxglove.vehicle_state import Motion, VehicleState

ONCE = 0.0  # [Hz] of what stays as it is
MOTION_HZ, SLOW_HZ = 25.0, 5.0
Json = dict[str, Any]
_MOTIONS = ("true", "estimate", "setpoint")


@dataclass(frozen=True, slots=True)
class ChannelSpec:
    """One channel."""

    topic: str
    schema: str  # one of Foxglove's, or the title of one of ours
    rate_hz: float  # at most, in simulated time
    meaning: str

    @property
    def period_us(self) -> int:
        return round(1e6 / self.rate_hz) if self.rate_hz else 0


@dataclass(frozen=True, slots=True)
class NumbersSpec(ChannelSpec):
    """One whose messages are JSON objects of numbers, to be plotted."""

    properties: Mapping[str, Any]  # of the JSON schema
    read: Callable[[VehicleState], Json]

    def json_schema(self) -> Json:
        """What a message holds."""
        return {"title": self.schema, "type": "object", "properties": dict(self.properties)}


def _number(meaning: str) -> Json:
    return {"type": "number", "description": meaning}


def _of_motions(fields: Mapping[str, str]) -> Json:
    """The same numbers of truth, estimate and setpoint."""
    one = {"type": "object", "properties": {name: _number(meaning) for name, meaning in fields.items()}}
    return dict.fromkeys(_MOTIONS, one)


def _each_motion(state: VehicleState, names: tuple[str, ...], read: Callable[[Motion], Any]) -> Json:
    motions = (state.true, state.est, state.setpoint)
    return {
        which: dict(zip(names, read(motion), strict=True))
        for which, motion in zip(_MOTIONS, motions, strict=True)
        if motion is not None
    }


_NED, _ANGLES, _RATES = ("north", "east", "down"), ("roll", "pitch", "yaw"), ("p", "q", "r")


def _degrees(motion: Motion) -> list[float]:
    return [angle * 180.0 / pi for angle in roll_pitch_yaw_of(motion.q_ned_from_frd)]


def _state(state: VehicleState) -> Json:
    return {"mode": state.mode, "is_armed": state.is_armed}


def _battery(state: VehicleState) -> Json:
    return {} if state.battery is None else state.battery._asdict()


NUMBERS = (
    NumbersSpec(
        "/position", "honeyguide.Position", MOTION_HZ, "position of truth, estimate and setpoint",
        _of_motions(dict.fromkeys(_NED, "[m] from home")),
        lambda state: _each_motion(state, _NED, lambda motion: motion.pos_ned),
    ),
    NumbersSpec(
        "/velocity", "honeyguide.Velocity", MOTION_HZ, "velocity of truth, estimate and setpoint",
        _of_motions(dict.fromkeys(_NED, "[m/s]")),
        lambda state: _each_motion(state, _NED, lambda motion: motion.vel_ned),
    ),
    NumbersSpec(
        "/attitude", "honeyguide.Attitude", MOTION_HZ, "angles of truth, estimate and setpoint",
        _of_motions(dict.fromkeys(_ANGLES, "[deg] ZYX, of frd in ned")),
        lambda state: _each_motion(state, _ANGLES, _degrees),
    ),
    NumbersSpec(
        "/rates", "honeyguide.Rates", MOTION_HZ, "angular rates of truth, estimate and setpoint",
        _of_motions(dict.fromkeys(_RATES, "[rad/s] about ahead, right, down")),
        lambda state: _each_motion(state, _RATES, lambda motion: motion.omega_frd),
    ),
    NumbersSpec(
        "/outputs", "honeyguide.Outputs", MOTION_HZ, "commands of motors and servos",
        {"command": {"type": "array", "items": _number("[0..1] or [-1..1], motors before servos")}},
        lambda state: {"command": [value if isfinite(value) else 0.0 for value in state.outputs]},
    ),
    NumbersSpec(
        "/estimator/test_ratios", "honeyguide.TestRatios", 10.0,
        "innovations of the estimator: largest innov² / (gate² innov_var) by what is fused; above 1 is rejected",
        {}, lambda state: dict(state.test_ratios),
    ),
    NumbersSpec(
        "/battery", "honeyguide.Battery", SLOW_HZ, "battery",
        {"voltage_v": _number("[V]"), "current_a": _number("[A]"), "remaining": _number("[0..1] as believed")},
        _battery,
    ),
    NumbersSpec(
        "/state", "honeyguide.State", SLOW_HZ, "flight mode, and whether it is armed",
        {"mode": {"type": "string"}, "is_armed": {"type": "boolean"}}, _state,
    ),
)  # fmt: skip

TRANSFORMS = ChannelSpec("/tf", "foxglove.FrameTransforms", MOTION_HZ, "where the frames are")
POSE_TRUE = ChannelSpec("/pose/true", "foxglove.PoseInFrame", MOTION_HZ, "true pose")
POSE_EST = ChannelSpec("/pose/estimate", "foxglove.PoseInFrame", MOTION_HZ, "estimated pose")
POSE_SP = ChannelSpec("/pose/setpoint", "foxglove.PoseInFrame", MOTION_HZ, "setpoint flown: position and attitude")
TRAIL_TRUE = ChannelSpec("/trail/true", "foxglove.PosesInFrame", 1.0, "true poses of the last five minutes")
TRAIL_EST = ChannelSpec("/trail/estimate", "foxglove.PosesInFrame", 1.0, "estimated poses of the last five minutes")
FIX_TRUE = ChannelSpec("/location/true", "foxglove.LocationFix", SLOW_HZ, "true place on the map")
FIX_EST = ChannelSpec("/location/estimate", "foxglove.LocationFix", SLOW_HZ, "estimated place on the map")
FIX_GNSS = ChannelSpec("/location/gnss", "foxglove.LocationFix", SLOW_HZ, "fixes of the GNSS receiver, with variances")
WORLD = ChannelSpec("/scene/world", "foxglove.SceneUpdate", ONCE, "ground, trees, walls and standing boxes")
VEHICLE_SHAPE = ChannelSpec("/scene/vehicle", "foxglove.SceneUpdate", ONCE, "the vehicle's shape")
PLAN = ChannelSpec("/scene/plan", "foxglove.SceneUpdate", ONCE, "the way of the plan")
MOVING = ChannelSpec("/scene/moving", "foxglove.SceneUpdate", 10.0, "the owner, moving boxes, where it goes to")
IMAGE = ChannelSpec("/camera/image", "foxglove.CompressedImage", 10.0, "JPEG of the camera on board")
CALIBRATION = ChannelSpec("/camera/calibration", "foxglove.CameraCalibration", 10.0, "its pinhole model")
POINTS = ChannelSpec("/camera/points", "foxglove.PointCloud", 10.0, "its depth image as coloured points")
RING = ChannelSpec("/ring", "foxglove.LaserScan", 10.0, "the ring of range finders (`--lidar`)")
TEXTS = ChannelSpec("/log", "foxglove.Log", 50.0, "what the vehicle says (STATUSTEXT)")

CHANNELS: tuple[ChannelSpec, ...] = (
    TRANSFORMS, POSE_TRUE, POSE_EST, POSE_SP, TRAIL_TRUE, TRAIL_EST, FIX_TRUE, FIX_EST, FIX_GNSS, WORLD, VEHICLE_SHAPE,
    PLAN, MOVING, IMAGE, CALIBRATION, POINTS, RING, TEXTS, *NUMBERS,
)  # fmt: skip
