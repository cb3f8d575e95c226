"""Whose flights are judged: an ONNX file, or a class of anybody's Python. What fits a task is the task's to say."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from policies.companion.pilot import PilotError
from policies.companion.skills.skill import Floats


def is_class(name: str) -> bool:
    """Whether a name is module:Class, and not that of a file or folder whose path has a colon."""
    return ":" in name and not Path(name).exists()


def made_by_name(name: str, parts: tuple[str, ...]) -> Any:
    """What a class makes that is named module:Class, looked for in the working folder too.

    Raises:
        PilotError: there is none, or what it makes lacks some of the parts.
    """
    from pkgutil import resolve_name

    sys.path.insert(0, str(Path.cwd()))
    try:
        made = resolve_name(name)()
    except Exception as error:  # whatever anybody's code raises
        raise PilotError(f"{name}: no class that can be made without arguments: {error}") from error
    finally:
        sys.path.pop(0)
    missing = [part for part in parts if not hasattr(made, part)]
    if missing:
        raise PilotError(f"{name}: a pilot has {', '.join(missing)} too")
    return made


class CheckedPilot:
    """Anybody's pilot, whose mistakes are told as such: an exception, or an action of another size.

    Args:
        made: the pilot.
        name: for the message.
        action_size: numbers of an action.
        seen: what it acts on once, before anything is flown.

    Raises:
        PilotError: it cannot act.
    """

    def __init__(self, made: Any, name: str, action_size: int, *seen: NDArray[Any]) -> None:
        self._made, self._name, self._action_size = made, name, action_size
        self.reset()
        self.act(*seen)
        self.reset()

    def __getattr__(self, part: str) -> Any:
        if part.startswith("_"):
            raise AttributeError(part)
        return getattr(self._made, part)

    def reset(self) -> None:
        """Forgets what came before."""
        self._ask("reset")

    def act(self, *seen: NDArray[Any]) -> Floats:
        """The action for an observation, shape (action_size,).

        Raises:
            PilotError: there is none.
        """
        given = self._ask("act", *seen)
        try:
            action: Floats = np.asarray(given, dtype=np.float32)
        except Exception:  # a tensor that is learnt, a string: no numbers
            action = np.zeros(0, np.float32)
        if action.shape != (self._action_size,):
            gave = f"{action.size} in shape {action.shape}" if action.ndim and action.size else repr(given)[:40]
            raise PilotError(f"{self._name}: act gives {self._action_size} numbers, not {gave}")
        return action

    def _ask(self, method: str, *seen: NDArray[Any]) -> Any:
        try:
            return getattr(self._made, method)(*seen)
        except Exception as error:  # whatever anybody's code raises
            raise PilotError(f"{self._name}: {method}: {type(error).__name__}: {error}") from error


class OnnxNetwork:
    """A policy as `honeyguide export` writes it, or anything of the same inputs and outputs, with its memory.

    Args:
        path: of the file.

    Raises:
        PilotError: it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime's own kinds, which it does not name
            raise PilotError(f"{path}: {str(error).splitlines()[0]}") from error
        self.shapes: dict[str, list[Any]] = {put.name: put.shape for put in self._session.get_inputs()}
        self._memory = next((name for name in self.shapes if "recurrent" in name or "memor" in name), None)
        self._size = self.shapes[self._memory][-1] if self._memory is not None else 0
        outputs: dict[str, list[Any]] = {put.name: put.shape for put in self._session.get_outputs()}
        self._action = next((n for n in outputs if n.startswith("deterministic_continuous")), next(iter(outputs)))
        self._next = next((name for name in outputs if "recurrent" in name or "memor" in name), None)
        self.action_shape = outputs[self._action]
        self.reset()

    @property
    def observed(self) -> dict[str, list[Any]]:
        """The shapes of the inputs by name, but for the memory's."""
        return {name: shape for name, shape in self.shapes.items() if name != self._memory}

    def in_words(self) -> str:
        """What it takes and gives, for a sentence: obs_0 [batch, 165], and gives [batch, 4]."""

        def words(shape: list[Any]) -> str:
            return f"[{', '.join(str(size) for size in shape)}]"

        taken = ", ".join(f"{name} {words(shape)}" for name, shape in self.observed.items())
        return f"{taken or 'nothing'}, and gives {words(self.action_shape)}"

    def reset(self) -> None:
        """Forgets what came before."""
        self._state = np.zeros((1, 1, self._size), np.float32)

    def run(self, fed: dict[str, Any]) -> Floats:
        """The action, in [-1, 1], on inputs by name."""
        if self._memory is not None:
            fed[self._memory] = self._state
        wanted = [self._action] + ([self._next] if self._next is not None else [])
        action, *state = self._session.run(wanted, fed)
        if state:
            self._state = state[0]
        bounded: Floats = np.clip(action[0], -1.0, 1.0)
        return bounded
