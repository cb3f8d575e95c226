"""A person at a keyboard as a task's driver: what the keys that are held mean to each of its actions.

Actions are known by the words of their names, so that every preset of a task is driven alike.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from policies.tasks.layout import Branch, Element, Layout
from policies.tasks.task import Task


class Control(StrEnum):
    """What a held key asks for."""

    FORWARD = "forward"
    BACK = "back"
    LEFT = "left"
    RIGHT = "right"
    BRAKE = "brake"


@dataclass(frozen=True, slots=True)
class _Axis:
    """What a continuous action is pulled up and down by, and where it lies when no key is held."""

    up: Control | None
    down: Control | None
    idle: float = 0.0


_AXES = {
    "steering": _Axis(Control.RIGHT, Control.LEFT),
    "throttle": _Axis(Control.FORWARD, Control.BACK),
    "brake": _Axis(Control.BRAKE, None),
    "force_x": _Axis(Control.RIGHT, Control.LEFT),
    "force_z": _Axis(Control.FORWARD, Control.BACK),
    "speed_sp": _Axis(Control.FORWARD, Control.BACK),
    "forward_sp": _Axis(Control.FORWARD, Control.BACK),
    "right_sp": _Axis(None, None),
    "down_sp": _Axis(None, Control.BRAKE),  # a drone climbs while the key is held that a car brakes with
    "roll_rate_sp": _Axis(None, None),
    "pitch_rate_sp": _Axis(Control.BACK, Control.FORWARD),  # nose down to go ahead
    "thrust_sp": _Axis(Control.BRAKE, None),
    "yaw_rate_sp": _Axis(Control.RIGHT, Control.LEFT),
}
# In this order: whoever steers and pushes steers, where an action can do one of them only.
_CHOICES = {
    Control.BRAKE: {"brake", "up"},
    Control.LEFT: {"left"},
    Control.RIGHT: {"right"},
    Control.FORWARD: {"forward", "push", "accelerate", "drive"},
    Control.BACK: {"back", "backward", "reverse"},
}


class NoKeys(ValueError):
    """An action of the task that no key is known for; the message is one sentence for the user."""


class KeyboardDriver:
    """Does what the held keys ask for, in every row."""

    def __init__(self, layout: Layout) -> None:
        """Looks up the keys of every action.

        Raises:
            NoKeys: an action has none.
        """
        self.held: set[Control] = set()
        self._axes = [_axis(layout, element) for element in layout.continuous]
        self._branches = [_choices(layout, branch) for branch in layout.branches]

    def act(self, task: Task) -> None:
        """Writes the actions."""
        if self._axes:
            values = np.array([self._value(axis) for axis in self._axes], dtype=np.float32)
            task.buffers.continuous.assign(np.tile(values, (task.env_count, 1)))
        if self._branches:
            chosen = np.array([self._chosen(choices) for choices in self._branches], dtype=np.int32)
            task.buffers.branches.assign(np.tile(chosen, (task.env_count, 1)))

    def _value(self, axis: _Axis) -> float:
        pull = float(axis.up in self.held) - float(axis.down in self.held)
        return pull or axis.idle

    def _chosen(self, choices: dict[Control, int]) -> int:
        return next((choices[control] for control in _CHOICES if control in self.held and control in choices), 0)


def _axis(layout: Layout, element: Element) -> _Axis:
    if element.name not in _AXES:
        raise NoKeys(f"{layout.task}: no key is known for its action {element.name}")
    return _AXES[element.name]


def _choices(layout: Layout, branch: Branch) -> dict[Control, int]:
    """The choice of each control; whatever no key asks for is the first choice or has none."""
    known: dict[Control, int] = {}
    for k, choice in enumerate(branch.choices):
        for control, words in _CHOICES.items():
            if words & set(choice.replace("-", "_").split("_")):
                known.setdefault(control, k)
    if not known:
        raise NoKeys(f"{layout.task}: no key is known for its action {branch.name}")
    return known
