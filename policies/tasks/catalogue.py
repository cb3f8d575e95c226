"""The tasks by name: what `honeyguide train NAME` and `gymnasium.make("honeyguide/NAME-v0")` build.

Light to import: a task's kernels are imported when it is asked for.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, cast

from pydantic import ValidationError
from pydantic_core import ErrorDetails

if TYPE_CHECKING:
    from policies.tasks.task import Task, TaskSettings


class UnknownTask(ValueError):
    """No task of that name, or a setting it has not; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A task as users ask for it: its settings and what builds it, or where these are defined in this folder."""

    settings_at: "str | type[TaskSettings]"
    task_at: "str | Callable[[Any, int, str], Task]"

    @property
    def settings(self) -> "type[TaskSettings]":
        return cast("type[TaskSettings]", _found(self.settings_at))

    @property
    def build(self) -> "Callable[[Any, int, str], Task]":
        return cast("Callable[[Any, int, str], Task]", _found(self.task_at))


def _found(entry: object) -> object:
    return resolve_name(f"policies.tasks.{entry}") if isinstance(entry, str) else entry


CATALOGUE: dict[str, Entry] = {
    "RollerBall": Entry("task:TaskSettings", "roller_ball:RollerBall"),
    "ReachTarget": Entry("reach_target.settings:ReachSettings", "reach_target.reach_target:ReachTarget"),
    "Parking1": Entry("parking.settings:ParkingSettings", "parking.level1:Parking1"),
    "Parking2": Entry("parking.settings:Parking2Settings", "parking.level2:Parking2"),
    "FollowMe": Entry("follow_me.settings:FollowSettings", "follow_me.follow_me:FollowMe"),
    "Hover": Entry("hover.hover:HoverSettings", "hover.hover:Hover"),
    "Drive": Entry("drive.settings:DriveSettings", "drive.drive:Drive"),
    "Navigate": Entry("navigate.settings:NavigateSettings", "navigate.navigate:Navigate"),
    "NavigateRover": Entry("navigate.settings:NavigateSettings", "navigate.navigate:NavigateRover"),
}


def task_settings(name: str, values: Mapping[str, Any]) -> "TaskSettings":
    """The checked settings of a task, from text or plain values.

    Raises:
        UnknownTask: no such task, no such setting, or a value it cannot have.
    """
    kind = _entry(name).settings
    try:
        return kind(**values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise UnknownTask(f"{name}: {key}: {_sentence(first, kind)}") from None


def _sentence(error: ErrorDetails, kind: "type[TaskSettings]") -> str:
    """What is wrong with one setting; an empty text, which stands for the preset's choice, is not offered."""
    context = error.get("ctx", {})
    if error["type"] == "extra_forbidden":
        return f"no such setting; there are {', '.join(kind.model_fields)}"
    if error["type"] == "literal_error":
        expected = context["expected"].removeprefix("'', ").removeprefix("'' or ").replace("'", "")
        return f"must be {expected}, not {error['input']}"
    return str(context.get("error", error["msg"][0].lower() + error["msg"][1:]))


def settings_of(name: str, pairs: Sequence[str], others: Mapping[str, Any] | None = None) -> "TaskSettings":
    """The checked settings of a task from the pairs of `env_args`, and from `others` where they say nothing.

    Raises:
        UnknownTask: as `task_settings`, or no pair.
    """
    values = dict(others or {})
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise UnknownTask(f"--env-args {pair}: must be KEY=VALUE")
        values[key] = value
    return task_settings(name, values)


def build_task(name: str, env_count: int, settings: "TaskSettings | None" = None, device: str = "cpu") -> "Task":
    """Environments of a task, not yet reset.

    Raises:
        UnknownTask: no such task.
    """
    entry = _entry(name)
    return entry.build(settings or entry.settings(), env_count, device)


def file_stem(name: str) -> str:
    """What files about a task are called: `ReachTarget` is `reach-target`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower()


def check_name(name: str) -> None:
    """Refuses a name that no task has.

    Raises:
        UnknownTask: no such task.
    """
    if name not in CATALOGUE:
        raise UnknownTask(f"{name}: no such task; there are {', '.join(CATALOGUE)}")


def _entry(name: str) -> Entry:
    check_name(name)
    return CATALOGUE[name]
