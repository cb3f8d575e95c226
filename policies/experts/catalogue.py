"""The scripted experts by the name of their task."""

from collections.abc import Callable

from policies.experts.expert import Expert
from policies.experts.hover import HoverExpert
from policies.experts.parking import Parking1Expert, Parking2Expert
from policies.experts.reach_target import ReachTargetExpert
from policies.experts.roller_ball import RollerBallExpert


class NoExpert(ValueError):
    """No scripted expert for that task; the message is one sentence for the user."""


EXPERTS: dict[str, Callable[[], Expert]] = {
    "Hover": HoverExpert,
    "Parking1": Parking1Expert,
    "Parking2": Parking2Expert,
    "RollerBall": RollerBallExpert,
    "ReachTarget": ReachTargetExpert,
}


def build_expert(task: str) -> Expert:
    """The scripted expert of a task.

    Raises:
        NoExpert: there is none.
    """
    if task not in EXPERTS:
        raise NoExpert(f"{task}: no scripted expert drives this task; there are experts for {', '.join(EXPERTS)}")
    return EXPERTS[task]()
