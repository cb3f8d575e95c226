"""Our flight controller's setpoints as the sticks of a Betaflight that flies in angle mode.

In: what the cascade of `autopilot` asks for after each tick: lean, yaw rate, thrust. Out: the channels of a receiver
[us]. What full sticks mean stands here once; Betaflight is set up to it (mission/boards/betaflight_setup.py).
"""

from math import asin, atan2, degrees, sqrt
from typing import Any

from autopilot.ports import SETPOINT_IDLE, SETPOINT_RATE
from autopilot.vehicles.multirotor.defaults import hover_thrust
from common.airframes.multirotor import MultirotorAirframe
from common.attitude import inverse, product, quat_of, rotated, yaw_of

ANGLE_LIMIT_DEG = 60.0
"""Lean at full stick, in angle mode."""
RATE_LIMIT_DEG_S = 400.0
"""Rate at full stick: of yaw, and of roll and pitch without angle mode."""
MIN_CHECK_US = 1050
"""Below it the throttle is low, from here on it grows."""
LOW_US, MIDDLE_US, HIGH_US = 1000, 1500, 2000
_HALF_US = 500.0
AUX_ARM, AUX_ANGLE, AUX_AIRBORNE = range(3)
"""Its switches, as AUX1 and further; airborne it keeps its full authority at low throttle."""
AT_REST_US = (MIDDLE_US, MIDDLE_US, LOW_US, MIDDLE_US, *(LOW_US,) * 4, *(MIDDLE_US,) * 8)
"""Disarmed."""
_DOWN = (0.0, 0.0, 1.0)


def hover_us(airframe: MultirotorAirframe) -> int:
    """The throttle that carries it."""
    return Sticks(airframe).throttle_us(hover_thrust(airframe))


class Sticks:
    """The hand at the sticks.

    Args:
        airframe: how a motor command becomes thrust.
    """

    def __init__(self, airframe: MultirotorAirframe) -> None:
        self._curve = airframe.rotor_model.command_curve
        self._idle = airframe.rotor_model.idle_command

    def channels_us(self, setpoint: Any, control: Any, q_ned_from_frd: Any, *, is_low: bool = False) -> tuple[int, ...]:
        """The 16 channels: roll, pitch, throttle, yaw, then switches.

        Args:
            setpoint: a row of `Setpoint`.
            control: a row of the cascade's `ControlState` after it.
            q_ned_from_frd: the estimate, x, y, z, w.
            is_low: the throttle stays low, whatever is asked for.
        """
        if not setpoint["is_armed"]:
            return AT_REST_US
        kind = int(control["kind"])
        if is_low or setpoint["is_landed"] or kind == SETPOINT_IDLE:
            return (MIDDLE_US, MIDDLE_US, LOW_US, MIDDLE_US, HIGH_US, HIGH_US, LOW_US, LOW_US, *AT_REST_US[8:])
        actuators = control["actuators"]
        omega_sp_frd = actuators["omega_sp_frd"].tolist()
        is_rate = kind == SETPOINT_RATE
        if is_rate:
            roll, pitch, yaw = (degrees(rate) / RATE_LIMIT_DEG_S for rate in omega_sp_frd)
        else:
            roll, pitch = lean(actuators["q_sp_ned_from_frd"].tolist(), q_ned_from_frd)
            roll, pitch = degrees(roll) / ANGLE_LIMIT_DEG, degrees(pitch) / ANGLE_LIMIT_DEG
            yaw = degrees(rotated(q_ned_from_frd, omega_sp_frd)[2]) / RATE_LIMIT_DEG_S
        switches = (HIGH_US, LOW_US if is_rate else HIGH_US, HIGH_US, LOW_US)
        throttle_us = self.throttle_us(float(actuators["thrust_sp"]))
        return (_stick_us(roll), _stick_us(-pitch), throttle_us, _stick_us(yaw), *switches, *AT_REST_US[8:])

    def throttle_us(self, thrust: float) -> int:
        """The stick at which every motor gives this fraction [0..1] of its greatest thrust."""
        speed = sqrt(min(max(thrust, 0.0), 1.0))
        straight = 1.0 - self._curve
        root = 2.0 * speed / max(straight + sqrt(straight * straight + 4.0 * self._curve * speed), 1e-9)
        fraction = min(max((root * root - self._idle) / (1.0 - self._idle), 0.0), 1.0)
        return round(MIN_CHECK_US + fraction * (HIGH_US - MIN_CHECK_US))


def lean(q_sp_ned_from_frd: Any, q_ned_from_frd: Any) -> tuple[float, float]:
    """Roll and pitch [rad] that point the thrust where a setpoint points it, at the heading that the vehicle has."""
    heading = quat_of(yaw_of(q_ned_from_frd), 0.0)
    ahead, right, down = rotated(product(inverse(heading), q_sp_ned_from_frd), _DOWN)
    return -asin(min(max(right, -1.0), 1.0)), atan2(ahead, down)


def _stick_us(deflection: float) -> int:
    return round(MIDDLE_US + _HALF_US * min(max(deflection, -1.0), 1.0))
