"""Who goes to goals and is judged: a policy of ours, an ONNX file, or a class of anybody's Python.

All of them take a vector, the last frames of the task (docs/reference/tasks.md), and answer with an action in [-1, 1],
ten times a second. A class needs `act(vector)` and `reset()`; `stack` says how many frames it takes.
"""

from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mission.benchmark.any_pilot import CheckedPilot, OnnxNetwork, is_class, made_by_name
from policies.companion.pilot import PilotError
from policies.companion.skills.skill import Floats
from policies.companion.vector_pilot import VectorPilot
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy

P = TypeVar("P", bound=VectorPilot)
_OF_THE_TASK = ("task", "drives", "shown_m", "arrived_m")


def goal_pilot(name: str, kind: type[P], stack: int) -> P:
    """The pilot that a name means: a policy's file or run, an .onnx file, or module:Class.

    Args:
        name: as it was given.
        kind: of pilot, which says of which task.
        stack: frames that a class takes, where it does not say.

    Raises:
        PilotError: no such one, or it does not fit the task.
    """
    made: Any
    if name.endswith(".onnx"):
        made = OnnxGoalPilot(Path(name), kind.task.frame_size)
    elif is_class(name):
        made = made_by_name(name, ("reset", "act"))
    else:
        try:
            path = find_policy(name)
            return kind(load_policy(path)[0], str(path))
        except CheckpointError as error:
            raise PilotError(str(error)) from error
    for part, given in {"stack": stack, **{part: getattr(kind, part, None) for part in _OF_THE_TASK}}.items():
        if not hasattr(made, part):
            setattr(made, part, given)
    task = kind.task
    if not isinstance(made.stack, int) or made.stack < 1:
        raise PilotError(f"{name}: stack {made.stack!r}: must be how many frames it takes")
    found: Any = CheckedPilot(made, name, len(task.continuous), np.zeros(made.stack * task.frame_size, np.float32))
    checked: P = found
    return checked


class OnnxGoalPilot:
    """A policy as `honeyguide export` writes it, or anything of the same input and outputs.

    Args:
        path: of the file.
        frame_size: floats of one frame of the task.

    Raises:
        PilotError: it cannot be read, or does not take whole frames.
    """

    def __init__(self, path: Path, frame_size: int) -> None:
        self._network = OnnxNetwork(path)
        shapes = self._network.shapes
        vectors = [
            name for name, shape in shapes.items() if len(shape) == 2 and isinstance(shape[1], int) and shape[1] > 0
        ]
        self._vector = next((name for name in vectors if shapes[name][1] % frame_size == 0), "")
        if not self._vector:
            takes = self._network.in_words()
            raise PilotError(f"{path}: takes {takes}; a pilot of this task takes frames of {frame_size} floats")
        self.stack = shapes[self._vector][1] // frame_size

    def reset(self) -> None:
        self._network.reset()

    def act(self, vector: Floats) -> Floats:
        return self._network.run({self._vector: vector[None]})
