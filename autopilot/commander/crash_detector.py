"""Is the vehicle still under control? PX4's failure detector (roll, pitch) and ArduPilot's crash check (lean error).

In: estimate and attitude setpoint, each frame while armed. Out: what is lost, as bits of `failsafe`. A vehicle that is
told to lean that far, or flown by body rates (its attitude setpoint is its attitude), is not judged by its attitude.
What stays on the ground is never told to lean: it lies as the ground does, or it has tipped over.
"""

from math import cos, radians

from autopilot.commander.failsafe import ATTITUDE_LOST, CRASHED
from autopilot.interface.vehicle_state import VehicleState
from autopilot.ports import TILT_ALIGNED
from common.params import Parameter, ParameterTable

STALE_US = 100_000  # an attitude older than that is gone: 25 IMU samples
_JUDGED_RAD = radians(30.0)  # less roll and pitch than that is never a crash
_LEAN_ERROR_COS = cos(radians(30.0))  # ArduPilot: CRASH_CHECK_ANGLE_DEVIATION_DEG
_LEAN_ERROR_S = 2.0  # ArduPilot: CRASH_CHECK_TRIGGER_SEC

Quaternion = tuple[float, float, float, float]


class AttitudeWatch:
    """Judges the attitude of one vehicle.

    Args:
        params: FD_*.
        leans: whether its attitude setpoint says how it shall lean; not of what stays on the ground.
    """

    __slots__ = (
        "_error_s", "_fail_cos", "_leans", "_params", "_pitch_max", "_pitch_s", "_pitch_time_s", "_roll_max", "_roll_s",
        "_roll_time_s",
    )  # fmt: skip

    def __init__(self, params: ParameterTable, *, leans: bool = True) -> None:
        self._params = params
        self._leans = leans
        self._load()
        self.reset()
        params.on_change(self._on_parameter)

    def reset(self) -> None:
        """Forgets what was seen before."""
        self._roll_s = self._pitch_s = self._error_s = 0.0  # for which each has been too large

    def update(self, state: VehicleState, dt_s: float) -> int:
        """Takes one frame and returns ATTITUDE_LOST, CRASHED or 0."""
        estimate = state.estimate
        if state.time_us - estimate.time_us > STALE_US or not estimate.flags & TILT_ALIGNED:
            return ATTITUDE_LOST
        roll, pitch = abs(state.roll_rad), abs(state.pitch_rad)
        if roll < _JUDGED_RAD and pitch < _JUDGED_RAD:
            self._roll_s = self._pitch_s = self._error_s = 0.0
            return 0
        wanted = _down_axis(state.actuators.q_sp_ned_from_frd)
        is_asked_for = self._leans and wanted[2] < self._fail_cos
        error_cos = sum(a * b for a, b in zip(_down_axis(estimate.q_ned_from_frd), wanted, strict=True))
        self._error_s = self._error_s + dt_s if error_cos < _LEAN_ERROR_COS else 0.0
        self._roll_s = self._roll_s + dt_s if roll > self._roll_max and not is_asked_for else 0.0
        self._pitch_s = self._pitch_s + dt_s if pitch > self._pitch_max and not is_asked_for else 0.0
        is_crashed = (
            self._roll_s >= self._roll_time_s or self._pitch_s >= self._pitch_time_s or self._error_s >= _LEAN_ERROR_S
        )
        return CRASHED if is_crashed else 0

    def _load(self) -> None:
        params = self._params
        self._roll_max = radians(float(params["FD_FAIL_R"]))
        self._pitch_max = radians(float(params["FD_FAIL_P"]))
        self._fail_cos = cos(min(self._roll_max, self._pitch_max))
        self._roll_time_s = float(params["FD_FAIL_R_TTRI"])
        self._pitch_time_s = float(params["FD_FAIL_P_TTRI"])

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith("FD_"):
            self._load()


def _down_axis(q_ned_from_frd: Quaternion) -> tuple[float, float, float]:
    """The body's down axis in ned: (0, 0, 1) when level."""
    x, y, z, w = q_ned_from_frd
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
