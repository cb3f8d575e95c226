"""How our flight controller is set where a vehicle follows by its senses, in training and in flight: quicker than else.

So it stands sooner before who stops.
"""

from collections.abc import Iterable
from math import radians, tan

from common.geodesy import GRAVITY_M_S2
from policies.tasks.follow_me.tracked.keep_off import OWNER_BRAKE_M_S2

QUICK = {"MPC_ACC_HOR": 7.0, "MPC_JERK_MAX": 40.0}
BRAKE_PARAMETERS = (*QUICK, "MPC_TILTMAX_AIR")
"""Those that tell how a vehicle brakes, as `brake_m_s2` takes them."""
MEASURED = "x500", "f450", "f550", "x500-fitted", "f550-fitted"  # airframes, by bench.follow.braking
_BRAKES = 0.925  # of the acceleration that is allowed; measured, as
_JERK_S, _MOST_M_S2 = 0.2, 7.0  # in which it comes to it, and the most that was measured
_LEAST_M_S2 = 0.5  # below it no rule can be made
_WIND_M_S2 = 3.0  # what wind may take of the level thrust; guess


def brake_m_s2(acceleration: float, jerk: float, tilt_deg: float) -> float:
    """With which it is taken to brake [m/s²].

    Args:
        acceleration: MPC_ACC_HOR [m/s²]; more than was measured does not count.
        jerk: MPC_JERK_MAX [m/s³]; what it takes long to come to does not, either.
        tilt_deg: MPC_TILTMAX_AIR; nor what it may not lean for, against the wind.
    """
    leaning = max(GRAVITY_M_S2 * tan(radians(tilt_deg)) - _WIND_M_S2, 0.1)
    return max(_BRAKES * min(acceleration, _JERK_S * jerk, leaning, _MOST_M_S2), _LEAST_M_S2)


QUICK_BRAKE_M_S2 = brake_m_s2(QUICK["MPC_ACC_HOR"], QUICK["MPC_JERK_MAX"], 45.0)


def believed_m_s2(brake: float, *, is_measured: bool) -> float:
    """What a guard takes of that [m/s²]: where it was not measured, no more than any vehicle brakes with."""
    return brake if is_measured else min(brake, OWNER_BRAKE_M_S2)


def trained_brake_m_s2(airframes: Iterable[str]) -> float:
    """With which a guard takes quick vehicles of these airframes to brake [m/s²]."""
    return believed_m_s2(QUICK_BRAKE_M_S2, is_measured=set(airframes) <= set(MEASURED))
