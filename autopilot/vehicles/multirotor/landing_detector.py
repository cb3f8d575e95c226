"""Landing detection: ground contact, then perhaps landed, then landed (the three stages of PX4's detector).

In: estimate and collective thrust, each frame of a flight. Out: whether the vehicle stands. A vehicle in the air cannot
pass: with less than a third of its hover thrust it gathers a speed of LNDMC_Z_VEL_MAX within 0.04 s, while each stage
needs a third of LNDMC_TRIG_TIME. A range finder that sees air below only delays the answer, in case it is stuck.
"""

from math import nan, radians, sqrt
from typing import Any

from autopilot.ports import TERRAIN_VALID, VELOCITY_VALID
from common.geodesy import GRAVITY_M_S2
from common.params import Parameter, ParameterTable

_CONTACT_FRACTION = 0.3  # of the way from least to hover thrust (PX4: MulticopterLandDetector)
_LANDED_FRACTION = 0.15  # PX4 has 0.1; the thrust floor of the control part is approached slowly
_TOUCH_HEIGHT_M = 0.1  # above standing height, as measured, from which a descent that stalls is a touch; guess
_TOUCH_SINK_FRACTION = 0.5  # of the wanted descent below which it stalls
_TOUCH_DESCENT_M_S = 0.1  # a slower descent is a hover
_TOUCH_S = 0.1  # a gust near the ground stalls a descent for less than that, or it does no harm to stop there
_FALL_M_S = (
    1.0  # a vehicle that sinks faster than this after a contact is in the air again: a tenth of a second of fall
)
_FALLS_MAX = 3  # a range finder that told of ground so often where there is none lies; bounces are fewer; guess
# What lies still with its motors off is down, even if the impact has upset the estimate of its speed. In the air it
# would feel 1 g only near its terminal velocity, which is well above this speed. Guesses.
_STILL_M_S = 10.0
_STILL_FORCE_FRACTION = 0.2  # of gravity, by which the specific force may differ from it
_STILL_S = 1.0
_BLOW_M_S2 = 4.0 * GRAVITY_M_S2  # without thrust nothing in the air pushes that hard, drag at most as hard as gravity
_AIR_BELOW_M = 1.0  # range finder reading that speaks against a landing; guess
_AIR_BELOW_FACTOR = 5.0  # by which such a reading stretches the time needed


_PX4 = "PX4 1.15 default"

LANDING_DETECTOR_PARAMETERS: list[Parameter] = [
    Parameter("LNDMC_Z_VEL_MAX", 0.25, 0.1, 1.0, "m/s", "largest vertical speed of a landed vehicle", _PX4),
    Parameter("LNDMC_XY_VEL_MAX", 1.5, 0.5, 5.0, "m/s", "largest horizontal speed of a landed vehicle", _PX4),
    Parameter("LNDMC_ROT_MAX", 20.0, 5.0, 100.0, "deg/s", "largest body rate of a landed vehicle", _PX4),
    Parameter("LNDMC_TRIG_TIME", 1.0, 0.1, 10.0, "s", "time for which a vehicle must look landed", _PX4),
]  # fmt: skip


class LandingDetector:
    """Landing detection of one vehicle.

    Args:
        params: LNDMC_* and MPC_THR_MIN.
        hover_thrust: [0..1] collective thrust that carries the vehicle.
        standing_height_m: of the vehicle's centre over level ground, NaN: not known, and a touch is felt later.
    """

    lift_timeout_s = 10.0  # guess

    __slots__ = (
        "_contact_thrust", "_fall_count", "_hover_thrust", "_landed_thrust", "_params", "_rate_max_sq",
        "_speed_xy_max_sq", "_speed_z_max", "_stage_s", "_still_s", "_time_s", "_touch_height", "_touch_s",
        "has_contact", "has_struck", "is_landed",
    )  # fmt: skip

    def __init__(self, params: ParameterTable, hover_thrust: float, standing_height_m: float = nan) -> None:
        self._params = params
        self._hover_thrust = hover_thrust
        self._touch_height = standing_height_m + _TOUCH_HEIGHT_M
        self._touch_s = 0.0  # for which a descent has stalled just above the ground
        self._fall_count = 0  # contacts after which the vehicle fell
        self._time_s = 0.0  # for which it has looked landed, stage after stage
        self._still_s = 0.0  # for which it has lain still without thrust
        # Something else than the rotors has carried the vehicle. It stays so while the vehicle settles: control that
        # came back at each bounce would tip it over.
        self.has_contact = False
        self.has_struck = False  # something, while it fell without thrust
        self.is_landed = False
        self._load()
        params.on_change(self._on_parameter)

    def reset(self) -> None:
        """The vehicle is on the ground and about to leave it."""
        self._time_s = self._touch_s = self._still_s = 0.0
        self._fall_count = 0
        self.has_contact = self.has_struck = self.is_landed = False

    def update(self, estimate: Any, thrust: float, descent_sp: float, dt_s: float) -> bool:
        """Takes one frame and returns whether the vehicle stands on the ground; `has_contact` comes before that.

        Args:
            estimate: the Estimate record.
            thrust: [0..1] collective thrust setpoint.
            descent_sp: [m/s] downward speed asked for, 0 if it shall not end on the ground.
            dt_s: [s] since the last frame.
        """
        self.is_landed = self._looks_landed(estimate, thrust, descent_sp, dt_s)
        if self._time_s >= self._stage_s:
            self.has_contact = True
        elif estimate.vel_ned[2] > _FALL_M_S and self.has_contact:
            self.has_contact = False
            self._fall_count += 1
        if thrust == 0.0:
            self._still_s = self._still_s + dt_s if self._is_still(estimate) else 0.0
            x, y, z = estimate.accel_frd
            self.has_struck = self.has_struck or x * x + y * y + z * z > _BLOW_M_S2**2
        else:
            self._still_s = 0.0
        return self.is_landed

    @property
    def is_down(self) -> bool:
        """Whether a vehicle without thrust has struck the ground or lies still; means nothing while it has thrust."""
        return self.has_struck or self._still_s >= _STILL_S

    def _looks_landed(self, estimate: Any, thrust: float, descent_sp: float, dt_s: float) -> bool:
        """Carries the time of the stages on; true at the end of the last."""
        if not self.has_contact and self._touches(estimate, descent_sp, dt_s):
            self._time_s = max(self._time_s, self._stage_s)
            return False
        if thrust >= self._contact_thrust or not self._is_supported(estimate):
            self._time_s = 0.0
            return False
        stage_s = self._stage_s
        time_s = self._time_s + dt_s
        if time_s > stage_s and (thrust >= self._landed_thrust or self._is_turning(estimate)):
            time_s = stage_s  # contact, but not yet perhaps landed
        self._time_s = time_s
        needed_s = 3.0 * stage_s
        if estimate.flags & TERRAIN_VALID and estimate.terrain_d - estimate.pos_ned[2] > _AIR_BELOW_M:
            needed_s *= _AIR_BELOW_FACTOR
        return time_s >= needed_s

    def _touches(self, estimate: Any, descent_sp: float, dt_s: float) -> bool:
        """Whether a descent stalls where the range finder sees the ground: felt before the thrust has faded."""
        is_stalled = (
            self._fall_count < _FALLS_MAX
            and descent_sp > _TOUCH_DESCENT_M_S
            and estimate.flags & TERRAIN_VALID
            and estimate.terrain_d - estimate.pos_ned[2] < self._touch_height
            and estimate.vel_ned[2] < _TOUCH_SINK_FRACTION * descent_sp
        )
        self._touch_s = self._touch_s + dt_s if is_stalled else 0.0
        return self._touch_s >= _TOUCH_S

    def _is_supported(self, estimate: Any) -> bool:
        """Whether something else than the rotors carries the vehicle."""
        if estimate.flags & VELOCITY_VALID:
            north, east, down = estimate.vel_ned
            return bool(abs(down) < self._speed_z_max and north * north + east * east < self._speed_xy_max_sq)
        # Without a velocity: rotors alone at this thrust would be felt as less than a third of gravity.
        x, y, z = estimate.accel_frd
        return bool(x * x + y * y + z * z > (0.7 * GRAVITY_M_S2) ** 2)

    def _is_still(self, estimate: Any) -> bool:
        x, y, z = estimate.accel_frd
        north, east, down = estimate.vel_ned
        return bool(
            estimate.flags & VELOCITY_VALID
            and north * north + east * east + down * down < _STILL_M_S**2
            and abs(sqrt(x * x + y * y + z * z) - GRAVITY_M_S2) < _STILL_FORCE_FRACTION * GRAVITY_M_S2
            and not self._is_turning(estimate)
        )

    def _is_turning(self, estimate: Any) -> bool:
        p, q, r = estimate.omega_frd
        return bool(p * p + q * q + r * r > self._rate_max_sq)

    def _load(self) -> None:
        params = self._params
        least = float(params["MPC_THR_MIN"])
        self._contact_thrust = least + _CONTACT_FRACTION * (self._hover_thrust - least)
        self._landed_thrust = least + _LANDED_FRACTION * (self._hover_thrust - least)
        self._rate_max_sq = radians(float(params["LNDMC_ROT_MAX"])) ** 2
        self._speed_z_max = float(params["LNDMC_Z_VEL_MAX"])
        self._speed_xy_max_sq = float(params["LNDMC_XY_VEL_MAX"]) ** 2
        self._stage_s = float(params["LNDMC_TRIG_TIME"]) / 3.0

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith("LNDMC_") or parameter.name == "MPC_THR_MIN":
            self._load()
