"""Landing detection of a plane: slow over ground, in height and through the air for a while, as PX4's (LNDFW_*).

One whose motor runs is landed, too, where it does not move at all and no wind can carry it: it lies in a field.
"""

from math import hypot
from typing import Any

from autopilot.ports import AIRSPEED_VALID, TERRAIN_VALID
from common.params import ParameterTable

_IDLE_THRUST = 0.1  # more throttle is flown with; guess
_STILL_M_S = 1.0  # slower, for longer, nothing flies but against the wind; guess
_STILL_S = 10.0
_LYING_M = 1.0  # over the ground as measured, where nothing stands in the wind for so long; guess


class PlaneLandingDetector:
    """Landing detection of one plane; its modes see to it that it stays on its wheels meanwhile.

    Args:
        params: LNDFW_*.
    """

    lift_timeout_s = 60.0  # a Cessna rolls for 15 s, from a high field for longer; guess

    __slots__ = ("_params", "_still_s", "_time_s", "has_contact", "has_struck", "is_landed")

    def __init__(self, params: ParameterTable) -> None:
        self._params = params
        self._time_s = self._still_s = 0.0
        self.has_contact = self.has_struck = self.is_landed = False

    def reset(self) -> None:
        """The vehicle is on the ground and about to leave it."""
        self._time_s = self._still_s = 0.0
        self.has_contact = self.has_struck = self.is_landed = False

    def update(self, estimate: Any, thrust: float, descent_sp: float, dt_s: float) -> bool:  # noqa: ARG002
        """Takes one frame and returns whether the vehicle stands on the ground."""
        number = self._params
        north, east, down = estimate.vel_ned
        is_slow = hypot(north, east) < number["LNDFW_VEL_XY_MAX"] and abs(down) < number["LNDFW_VEL_Z_MAX"]
        is_still = is_slow and hypot(north, east) < _STILL_M_S
        if estimate.flags & AIRSPEED_VALID and estimate.airspeed > number["LNDFW_AIRSPD_MAX"]:
            is_slow = is_slow and is_still
            is_low = estimate.flags & TERRAIN_VALID and estimate.terrain_d - estimate.pos_ned[2] < _LYING_M
            is_still = is_still and bool(is_low)
        self._time_s = self._time_s + dt_s if is_slow and thrust < _IDLE_THRUST else 0.0
        self._still_s = self._still_s + dt_s if is_still else 0.0
        self.is_landed = self._time_s >= float(number["LNDFW_TRIG_TIME"]) or self._still_s >= _STILL_S
        self.has_contact = self.is_landed
        return self.is_landed

    @property
    def is_down(self) -> bool:
        """It lies still, its motor off."""
        return self.is_landed
