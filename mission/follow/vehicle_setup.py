"""How our flight controller is set to follow, and what a guard has to know of that.

In: a flight's parameters. Out: those that a following vehicle differs by, and a guard that knows how it brakes.
"""

from common.params import ParameterTable
from policies.companion.guard.settings import GuardSettings
from policies.tasks.follow_me.tracked.quick_vehicle import QUICK, brake_m_s2

BY_SIGHT = {"EKF2_EV_CTRL": 4.0}
"""The parameter by which our flight controller uses the velocity that the companion sees while GNSS is away."""
FOLLOWING = BY_SIGHT | QUICK


def knowing_brakes(guard: GuardSettings, table: ParameterTable) -> GuardSettings:
    """The guard that knows how our vehicle with these parameters brakes, unless it was told otherwise.

    Args:
        guard: as set.
        table: of the flight controller; of one that does not say how fast it speeds up nothing is known.
    """
    if "owner_brake" in guard.model_fields_set or not all(name in table for name in QUICK):
        return guard
    return guard.model_copy(update={"owner_brake": brake_m_s2(table["MPC_ACC_HOR"], table["MPC_JERK_MAX"])})
