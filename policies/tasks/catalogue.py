"""Tasks by name: what `honeyguide train NAME` and `gymnasium.make("honeyguide/NAME-v0")` build.

A name is one of the catalogue below, one that an installed package has given in its entry points `honeyguide.tasks`,
`module:Class` of a task of one's own, `gym:ID` of any Gymnasium environment, or `model:PATH` of a model learnt from
logs. Light to import: a task's kernels are imported when it is asked for.
"""

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

from pydantic import ValidationError
from pydantic_core import ErrorDetails

if TYPE_CHECKING:
    from policies.tasks.task import Task, TaskSettings

ENTRY_POINTS = "honeyguide.tasks"
GYM = "gym:"
"""What the names of Gymnasium's environments begin with here."""
MODEL = "model:"
"""What the names of models that were learnt from logs begin with; a path follows."""


_MODULE_CLASS = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*")


class UnknownTask(ValueError):
    """No task of that name, or a setting it has not; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A task of the catalogue."""

    task_at: "str | type[Task] | Callable[[Any, int, str], Task]"
    """Its class, or where that is defined in this folder."""
    max_episode_steps: int = 1000
    """Decisions after which Gymnasium cuts an episode: no fewer than any preset's own limit, if it has one."""


CATALOGUE: dict[str, Entry] = {
    "RollerBall": Entry("roller_ball:RollerBall", 500),
    "ReachTarget": Entry("reach_target.reach_target:ReachTarget", 200),
    "Parking1": Entry("parking.level1:Parking1", 1000),
    "Parking2": Entry("parking.level2:Parking2", 50000),
    "FollowMe": Entry("follow_me.follow_me:FollowMe", 600),
    "Hover": Entry("hover.hover:Hover", 500),
    "Drive": Entry("drive.drive:Drive", 3000),
    "Navigate": Entry("navigate.navigate:Navigate", 3000),
    "NavigateRover": Entry("navigate.navigate:NavigateRover", 3000),
}


def task_class(name: "str | type[Task]") -> "type[Task]":
    """The class of a task.

    Raises:
        UnknownTask: there is none of that name, or what is there is no task.
    """
    if not isinstance(name, str):
        return name
    if name in CATALOGUE:
        at = CATALOGUE[name].task_at
        return cast("type[Task]", resolve_name(f"policies.tasks.{at}") if isinstance(at, str) else at)
    if name.startswith(GYM):
        return _gym_class(name)
    if name.startswith(MODEL):
        model_class: Callable[[str], type[Task]] = resolve_name("policies.offline.dynamics.model_task:model_class")
        return model_class(name.removeprefix(MODEL))
    package_entry = _package_entries().get(name)
    if package_entry is None and ":" not in name:
        raise UnknownTask(f"{name}: no such task; there are {', '.join(task_names())}, and module:Class for your own")
    return _checked(name, _loaded(name, package_entry.value if package_entry is not None else name))


def _gym_class(name: str) -> "type[Task]":
    try:
        gym_class = resolve_name("policies.tasks.gym_task:gym_class")
    except ModuleNotFoundError as error:
        raise UnknownTask(f"{name}: {error.name} is not installed: pip install 'honeyguide[gym]'") from None
    return cast("type[Task]", gym_class(name.removeprefix(GYM)))


def _package_entries() -> dict[str, EntryPoint]:
    """The tasks of installed packages, by name."""
    return {each.name: each for each in entry_points(group=ENTRY_POINTS)}


def _loaded(name: str, value: str) -> object:
    """What lies at `module:Class`."""
    module, _, attribute = value.partition(":")
    found: object = import_users_module(name, module)
    for part in attribute.split("."):
        if not hasattr(found, part):
            raise UnknownTask(f"{name}: {module} has no {attribute or 'class without a name'}")
        found = getattr(found, part)
    return found


def import_users_module(name: str, module: str) -> ModuleType:
    """A module that the user has named; those in the working directory are found, as by `python -m`.

    Args:
        name: of the task, for messages.
        module: its name.

    Raises:
        UnknownTask: it is not there, or something that it imports.
    """
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise UnknownTask(f"{name}: {module} imports {error.name}, which is not there") from None
        raise UnknownTask(f"{name}: there is no module {module}") from None
    except (TypeError, ValueError):  # of a name like "" or ".a"
        raise UnknownTask(f"{name}: {module or 'nothing'} cannot be the name of a module") from None


def _checked(name: str, found: object) -> "type[Task]":
    from policies.tasks.task import Task  # noqa: PLC0415  (imports Warp)

    if not (isinstance(found, type) and issubclass(found, Task)):
        raise UnknownTask(f"{name}: is no task: it must be a subclass of policies.tasks.task.Task")
    return found


def settings_class(task: "str | type[Task]") -> "type[TaskSettings]":
    """What users may choose of a task.

    Raises:
        UnknownTask: no such task.
    """
    from policies.tasks.task import TaskSettings  # noqa: PLC0415  (imports Warp)

    return getattr(task_class(task), "settings_class", TaskSettings)


def task_settings(name: "str | type[Task]", values: Mapping[str, Any]) -> "TaskSettings":
    """The checked settings of a task, from text or plain values.

    Raises:
        UnknownTask: no such task, no such setting, or a value it cannot have.
    """
    kind = settings_class(name)
    try:
        return kind(**values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        called = name if isinstance(name, str) else name.__name__
        raise UnknownTask(f"{called}: {key}: {_sentence(first, kind)}") from None


def _sentence(error: ErrorDetails, kind: "type[TaskSettings]") -> str:
    """What is wrong with one setting; an empty text, which stands for the preset's choice, is not offered."""
    context = error.get("ctx", {})
    if error["type"] == "extra_forbidden":
        return f"no such setting; there are {', '.join(kind.model_fields)}"
    if error["type"] == "literal_error":
        expected = context["expected"].removeprefix("'', ").removeprefix("'' or ").replace("'", "")
        return f"must be {expected}, not {error['input']}" if expected else f"there are none, and no {error['input']}"
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


def build_task(
    name: "str | type[Task]", env_count: int, settings: "TaskSettings | None" = None, device: str = "cpu"
) -> "Task":
    """Environments of a task, not yet reset.

    Raises:
        UnknownTask: no such task, or one that cannot be made of these settings.
    """
    build: Any = task_class(name)
    return cast("Task", build(settings or settings_class(name)(), env_count, device))


def file_stem(name: str) -> str:
    """What files about a task are called: `ReachTarget` is `reach-target`, `gym:CartPole-v1` is `cart-pole-v1`."""
    last = re.split(r"[:/.]", name)[-1]
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", last).lower()


def task_names() -> list[str]:
    """The names that stand for themselves: of the catalogue, and of installed packages."""
    return list(dict.fromkeys([*CATALOGUE, *_package_entries()]))


def is_task_name(name: str) -> bool:
    """Whether it names a task, and not a policy: one of `task_names`, `gym:ID`, `model:PATH` or `module:Class`."""
    return (
        name in CATALOGUE
        or name.startswith((GYM, MODEL))
        or bool(_MODULE_CLASS.fullmatch(name))
        or name in task_names()
    )


def runs_code(name: str) -> bool:
    """Whether building a task imports a module that the name itself names: what a file says is not done by itself."""
    return not name.startswith(MODEL) and ":" in name.removeprefix(GYM)


def check_name(name: str) -> None:
    """Refuses a name that no task has.

    Raises:
        UnknownTask: no such task.
    """
    if name not in CATALOGUE:
        task_class(name)
