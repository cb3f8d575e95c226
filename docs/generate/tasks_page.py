"""The text of docs/reference/tasks.md, made from the layouts, settings and numbers of the tasks themselves."""

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from policies.tasks.catalogue import CATALOGUE, build_task, settings_class, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.layout import Branch, Element, Layout
from policies.tasks.task import Task

HEADER = """\
# Tasks

Written by `python -m docs.generate` from the code: do not edit.

What each task shows, takes and can be set to, as a reference. Gymnasium knows them as `honeyguide/NAME-v0` after
`import policies`, and as `policies:honeyguide/NAME-v0` without it (it has no entry point for plug-ins since its
version 1.0), with the settings as keyword arguments; `honeyguide` takes settings as `--env-args KEY=VALUE`, and
training configurations set or randomise the numbers by name under `environment_parameters`.

| task | what is to be done |
|---|---|
| [RollerBall](#rollerball) | roll a ball to a cube, by forces: ML-Agents' tutorial. +1 for the cube |
| [ReachTarget](#reachtarget) | drive a car with four driven wheels to a pose: [more](../explanation/reach-target.md) |
| [Parking1](#parking1) | park a car between three blocks: [more](../explanation/parking.md) |
| [Parking2](#parking2) | park a car on one of two storeys, past moving obstacles: [more](../explanation/parking.md) |
| [FollowMe](#followme) | a drone follows a person through hills and trees: [more](../explanation/following.md) |
| [Hover](#hover) | hold a drone at a point by body rates and thrust; 1 per decision at the point |
| [Drive](#drive) | drive a rover to a pose on hills, or into a spot of a car park: [more](../explanation/drive.md) |
| [Navigate](#navigate) | fly a drone through forest to a goal, at speed: [more](../explanation/navigate.md) |
| [NavigateRover](#navigaterover) | drive one between trees and walls: [more](../explanation/navigate.md#on-wheels) |

The linked pages say what the presets are made of, how rewards are paid, and which spots are held out for tests. Every
reward is among the numbers. In the tables of observations `#` stands for a number, an element times its scale is the
quantity in its unit, and elements of the goal are what hyper-networks and hindsight replay use. Coordinates on the
ground are Unity's: x right, y up, z forward, yaw clockwise from +z seen from above; tasks that are flown say `hfrd`
(level along the heading: ahead, right, down) and `frd` (the body's axes).

| outcome | an episode that |
|---|---|
"""
OUTCOMES = {
    Outcome.SUCCESS: "reached what was to be reached, or lasted until its time was up",
    Outcome.TIMEOUT: "was cut at its limit of decisions: a truncation",
    Outcome.HIT_WALL: "ended at a wall",
    Outcome.HIT_OBSTACLE: "ended at a block, a moving obstacle, a tree or, of flights and rovers, a wall or ground",
    Outcome.FELL: "ended under the floor",
    Outcome.HIT_OTHER: "rolled over, struck an edge, or came too near a person",
    Outcome.LOST: "lost whom it followed, or left the forest upwards, the ball it hovers in, or the way to its goal",
    Outcome.ENDED: "was ended by an environment of Gymnasium, which does not say how",
}


def tasks_text() -> str:
    """The whole page."""
    outcomes = "".join(f"| `{outcome.name.lower()}` | {meaning} |\n" for outcome, meaning in OUTCOMES.items())
    return "\n".join([HEADER + outcomes, *(_section(name) for name in CATALOGUE)])


def _section(name: str) -> str:
    presets = {preset: build_task(name, 1, task_settings(name, {"preset": preset})) for preset in _presets(name)}
    parts = [f"## {name}\n", _preset_table(presets), "Settings:\n", _settings_table(name)]
    shown: dict[tuple[Element, ...], str] = {}
    for preset, task in presets.items():
        frame = task.layout.frame
        shown[frame] = f"{shown[frame]}, `{preset}`" if frame in shown else f"`{preset}`"
    parts += [f"Observation {titles}:\n\n{_frame_table(frame)}" for frame, titles in shown.items()]
    return "\n".join([*parts, "Parameters:\n", _param_table(presets)])


def _presets(name: str) -> list[str]:
    """The presets that a task has."""
    return _choices_of(settings_class(name).model_json_schema()["properties"]["preset"])


def _preset_table(presets: dict[str, Task]) -> str:
    rows = ["| preset | observation | actions | a decision is |", "|---|---|---|---|"]
    for preset, task in presets.items():
        layout = task.layout
        floats = f"{layout.observation_size} floats"
        floats += f" ({layout.stack} frames of {layout.frame_size})" if layout.stack > 1 else ""
        if layout.image is not None:
            height, width, _ = layout.image_shape
            floats += f", an image of {height} x {width} ({', '.join(layout.image.channels)})"
        rows.append(f"| `{preset}` | {floats} | {_actions(layout)} | {task.decision_s:g} s |")
    return "\n".join(rows) + "\n"


def _actions(layout: Layout) -> str:
    if layout.branches:
        return "; ".join(_choices(branch) for branch in layout.branches)
    return ", ".join(f"`{element.name}`" for element in layout.continuous) + " in -1 … 1"


def _choices(branch: Branch) -> str:
    return f"`{branch.name}`: " + ", ".join(f"{k} {choice}" for k, choice in enumerate(branch.choices))


def _settings_table(name: str) -> str:
    rows = ["| setting | default | values | meaning |", "|---|---|---|---|"]
    for key, schema in settings_class(name).model_json_schema()["properties"].items():
        default = str(schema["default"]).lower() if schema["default"] not in {"", "auto"} else "as the preset"
        rows.append(f"| `{key}` | {default} | {_values(schema)} | {_one_line(schema.get('description', ''))} |")
    return "\n".join(rows) + "\n"


def _values(schema: dict[str, Any]) -> str:
    """What a setting may have; an empty text and `auto` stand for the preset's choice."""
    kinds = schema.get("anyOf", [schema])
    choices = [choice for kind in kinds for choice in _choices_of(kind) if choice not in {"", "auto"}]
    if choices:
        return ", ".join(choices)
    if schema.get("type") == "boolean":
        return "true, false"
    return f"{schema['minimum']} … {schema['maximum']}" if "minimum" in schema else "text"


def _choices_of(schema: dict[str, Any]) -> list[Any]:
    """What a literal may be; JSON Schema calls a single choice otherwise."""
    return [schema["const"]] if "const" in schema else list(schema.get("enum", []))


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _frame_table(frame: Iterable[Element]) -> str:
    """Elements whose names differ in their last word or in a number share a row."""
    groups: dict[tuple[str, str, float, bool], list[str]] = {}
    for element in frame:
        stem, _, last = element.name.rpartition("_")
        key = (re.sub(r"\d+", "#", stem), element.unit, element.scale, element.is_goal)
        groups.setdefault(key, []).append(re.sub(r"\d+", "#", last))
    rows = ["| elements | floats | unit | scale | of the goal |", "|---|---|---|---|---|"]
    for (stem, unit, scale, is_goal), lasts in groups.items():
        different = list(dict.fromkeys(lasts))
        word = different[0] if len(different) == 1 else "{" + ", ".join(different) + "}"
        name = f"{stem}_{word}" if stem else word
        rows.append(f"| `{name}` | {len(lasts)} | {unit} | {scale:g} | {'yes' if is_goal else ''} |")
    return "\n".join(rows) + "\n"


def _param_table(presets: dict[str, Task]) -> str:
    rows = ["| parameter | default | range | unit | meaning | source |", "|---|---|---|---|---|---|"]
    for param in next(iter(presets.values())).params:
        meaning = f"{param.meaning} | {param.source}"
        bounds = f"{param.minimum:g} … {param.maximum:g}"
        rows.append(f"| `{param.name}` | {_defaults(param.name, presets)} | {bounds} | {param.unit} | {meaning} |")
    return "\n".join(rows) + "\n"


def _defaults(name: str, presets: dict[str, Task]) -> str:
    """The value, or each preset's where they differ."""
    values = {preset: _drawn_from(task, name) for preset, task in presets.items()}
    if len(set(values.values())) == 1:
        return next(iter(values.values()))
    return "; ".join(f"{preset}: {value}" for preset, value in values.items())


def _drawn_from(task: Task, name: str) -> str:
    declared = task.param_table.declarations[name].default
    low, high = task.param_table.rows[task.param_table.names.index(name)][4:6]
    if low != high:
        return f"drawn from {low:g} … {high:g}"
    return f"{declared if low == np.float32(declared) else low:g}"
