"""How our flight controller is set to follow, and what a guard has to know of that.

In: who flies, and a flight's parameters. Out: those that it is set by, and a guard that knows how it brakes.
"""

from common.params import ParameterTable
from policies.companion.guard.settings import GuardSettings
from policies.companion.skills.following import Pilot
from policies.companion.vector_pilot import NavigationPilot
from policies.tasks.follow_me.observe import TRACKED
from policies.tasks.follow_me.tracked.quick_vehicle import QUICK, brake_m_s2

BY_SIGHT = {"EKF2_EV_CTRL": 4.0}
"""The parameter by which our flight controller uses the velocity that the companion sees while GNSS is away."""


def setup_of(pilot: Pilot | NavigationPilot) -> dict[str, float]:
    """The parameters that a pilot's vehicle is set by, as in training: who goes by the senses has a quick one."""
    goes_by_senses = not isinstance(pilot, NavigationPilot) and pilot.kind == TRACKED
    return BY_SIGHT | QUICK if goes_by_senses else dict(BY_SIGHT)


def knowing_brakes(guard: GuardSettings, table: ParameterTable) -> GuardSettings:
    """The guard that knows how our vehicle with these parameters brakes, unless it was told otherwise.

    Args:
        guard: as set.
        table: of the flight controller; of one that does not say how fast it speeds up nothing is known.
    """
    if "owner_brake" in guard.model_fields_set or not all(name in table for name in QUICK):
        return guard
    return guard.model_copy(update={"owner_brake": brake_m_s2(table["MPC_ACC_HOR"], table["MPC_JERK_MAX"])})
