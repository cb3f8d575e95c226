"""ReachTarget's expert: pure pursuit, or, where the settings ask for a pose, along Reeds-Shepp paths."""

from policies.experts.expert import Expert
from policies.experts.pose_pursuit import PosePursuitExpert
from policies.experts.pursuit import PursuitExpert
from policies.tasks.reach_target.reach_target import ReachTarget
from policies.tasks.task import Task


class ReachTargetExpert:
    """Drives to the target, or into its pose."""

    def __init__(self) -> None:
        self._expert: Expert | None = None

    def act(self, task: Task) -> None:
        """Writes the actions of every row of a `ReachTarget`."""
        if not isinstance(task, ReachTarget):
            raise TypeError(f"{task.layout.task} is not ReachTarget")
        if self._expert is None:
            self._expert = PosePursuitExpert() if task.settings.success == "pose" else PursuitExpert()
        self._expert.act(task)
