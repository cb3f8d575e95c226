"""Which task judges logged decisions, and with which settings its dataset is made."""

from collections.abc import Callable

from policies.datasets.decisions import Judge
from policies.datasets.episodes import DatasetError
from policies.datasets.follow_me import SETTINGS, FollowMeJudge, ImageFollowMeJudge
from policies.datasets.goal_tasks import DriveJudge, NavigateJudge
from policies.tasks.task import Task

_JUDGES: dict[str, Callable[[Task], Judge]] = {
    "FollowMe": FollowMeJudge,
    "Navigate": NavigateJudge,
    "NavigateRover": NavigateJudge,
    "Drive": DriveJudge,
}
HOVER = "Hover"  # needs no decisions: any log tells of it
TASKS = (*_JUDGES, HOVER)


def task_pairs(task: str, pairs: tuple[str, ...]) -> tuple[str, ...]:
    """The settings of a task whose decisions are logged: those given, after those that it takes.

    Raises:
        DatasetError: no flight logs what it needs.
    """
    if task not in TASKS:
        raise DatasetError(f"--task {task}: datasets are built of {', '.join(TASKS)}")
    return (*SETTINGS, *pairs) if task == "FollowMe" else pairs


def judge_of(task: Task) -> Judge:
    """Who judges decisions of a task."""
    if task.layout.image is not None:  # FollowMe alone of them can show one
        return ImageFollowMeJudge(task)
    return _JUDGES[task.layout.task](task)
