"""Parameters of a task: each physical or difficulty number declared once, set or randomised by name.

A task has a `wp.struct` of floats, one row per environment, and one `TaskParam` per field. Every row is drawn anew when
an episode starts, from the samplers below, so any parameter can be randomised by configuration, without a line of code.
Sampler kinds are ML-Agents': constant, uniform, multirangeuniform, gaussian.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from common.rng import draw_key
from common.warp_start import start_warp

wp.set_module_options({"enable_backward": False})

MAX_INTERVALS = 4
_NUMBER_STREAM = wp.constant(4096)  # streams of the draws below; tasks use those under it
_GAUSSIAN = wp.constant(-1.0)
_MINIMUM = wp.constant(1)
_MAXIMUM = wp.constant(2)
_STREAM = wp.constant(3)
_FIRST = wp.constant(4)
_COLUMNS = 4 + 2 * MAX_INTERVALS  # intervals (or -1: gaussian), minimum, maximum, stream, then pairs


class NumberError(ValueError):
    """A number that does not exist or a value it cannot have; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class TaskParam:
    """The declaration of one number; `name` is the field of the task's struct."""

    name: str
    default: float
    minimum: float
    maximum: float
    unit: str
    meaning: str
    source: str  # document, code, datasheet, paper, measured, or guess


@dataclass(frozen=True, slots=True)
class Sampler:
    """What a number is drawn from at the start of each episode."""

    intervals: tuple[tuple[float, float], ...] = ()  # chosen in proportion to their lengths; equal ends: a constant
    mean: float = 0.0  # of a gaussian, if there are no intervals
    st_dev: float = 0.0
    seed: int = 0

    @staticmethod
    def constant(value: float) -> "Sampler":
        return Sampler(intervals=((value, value),))


class TaskParamTable:
    """The samplers of one task's numbers, as the kernel reads them: shape (numbers, columns)."""

    def __init__(self, declarations: Iterable[TaskParam], device: str = "cpu") -> None:
        self.declarations = {number.name: number for number in declarations}
        self.names = list(self.declarations)
        self.rows = np.zeros((len(self.names), _COLUMNS), dtype=np.float32)
        start_warp()
        self._device = wp.zeros(self.rows.shape, dtype=float, device=device)
        self.update({name: number.default for name, number in self.declarations.items()})
        self.keep_as_own()

    @property
    def array(self) -> Any:
        """The samplers on the device."""
        return self._device

    def typical(self) -> np.ndarray[Any, Any]:
        """Of each number the constant it is, the least it is drawn from or its mean, shape (1, numbers)."""
        return self.rows[:, _FIRST][None].copy()

    def update(self, values: Mapping[str, float | Sampler]) -> None:
        """Sets numbers, or what they are drawn from; it takes effect at the start of the next episodes.

        Raises:
            NumberError: no such number, or a value out of its bounds.
        """
        for name, value in values.items():
            number = self.declarations.get(name)
            if number is None:
                raise NumberError(f"{name}: this task has no such number; it has {', '.join(self.names)}")
            self._write(self.names.index(name), number, _sampler(name, value))
        self._device.assign(self.rows)

    def keep_as_own(self) -> None:
        """From now on `changed` is what is drawn otherwise than now."""
        self._own = self.rows.copy()

    def changed(self) -> dict[str, str]:
        """The numbers that are drawn otherwise than the task draws them by itself, and from what, as text."""
        return {
            name: _text(row)
            for name, row, own in zip(self.names, self.rows, self._own, strict=True)
            if (row != own).any()
        }

    def _write(self, k: int, number: TaskParam, sampler: Sampler) -> None:
        if any(len(interval) != 2 for interval in sampler.intervals):
            raise NumberError(f"{number.name}: an interval is a pair of numbers")
        if not 0.0 <= sampler.st_dev < math.inf:
            raise NumberError(f"{number.name}: st_dev: must be at least 0 and finite, not {sampler.st_dev}")
        ends = [end for interval in sampler.intervals for end in interval] or [sampler.mean]
        wrong = [end for end in ends if not number.minimum <= end <= number.maximum]
        if wrong:
            raise NumberError(f"{number.name}: {wrong[0]:g} is not between {number.minimum:g} and {number.maximum:g}")
        if len(sampler.intervals) > MAX_INTERVALS:
            raise NumberError(f"{number.name}: more than {MAX_INTERVALS} intervals")
        if any(low > high for low, high in sampler.intervals):
            raise NumberError(f"{number.name}: an interval ends before it begins")
        row = self.rows[k]
        row[:] = 0.0
        row[_MINIMUM], row[_MAXIMUM] = number.minimum, number.maximum
        row[_STREAM] = k + 97 * (sampler.seed % 1024)
        if sampler.intervals:
            row[0] = len(sampler.intervals)
            row[_FIRST : _FIRST + 2 * len(sampler.intervals)] = ends
        else:
            row[0] = _GAUSSIAN
            row[_FIRST], row[_FIRST + 1] = sampler.mean, sampler.st_dev


def _sampler(name: str, value: float | Sampler) -> Sampler:
    if isinstance(value, Sampler):
        return value
    try:
        return Sampler.constant(float(value))
    except (TypeError, ValueError):
        raise NumberError(f"{name}: must be a number, or what it is drawn from, not {value!r}") from None


def _text(row: np.ndarray[Any, Any]) -> str:
    """What a row draws from: 3, 1 to 2, or 3 ± 0.5."""
    if row[0] == _GAUSSIAN:
        return f"{row[_FIRST]:g} ± {row[_FIRST + 1]:g}"
    pairs = row[_FIRST : _FIRST + 2 * int(row[0])].reshape(-1, 2)
    return ", ".join(f"{low:g}" if low == high else f"{low:g} to {high:g}" for low, high in pairs)


@wp.func
def draw_param(samplers: wp.array2d(dtype=float), k: int, seed: int, i_env: int, episode: int) -> float:
    """Parameter k of an environment's episode."""
    count = int(samplers[k, 0])
    low = samplers[k, _FIRST]
    high = samplers[k, _FIRST + 1]
    value = low
    if count != 1 or high > low:
        state = draw_key(seed, i_env, episode, _NUMBER_STREAM + int(samplers[k, _STREAM]))
        if count < 0:
            value = low + high * wp.randn(state)
        else:
            total = float(0.0)
            for j in range(count):
                total += samplers[k, _FIRST + 2 * j + 1] - samplers[k, _FIRST + 2 * j]
            left = total * wp.randf(state)
            is_found = int(0)
            for j in range(count):
                length = samplers[k, _FIRST + 2 * j + 1] - samplers[k, _FIRST + 2 * j]
                if is_found == 0 and (left <= length or j == count - 1):
                    value = samplers[k, _FIRST + 2 * j] + wp.min(left, length)
                    is_found = 1
                left -= length
    return wp.clamp(value, samplers[k, _MINIMUM], samplers[k, _MAXIMUM])


@wp.func
def draw_params(
    samplers: wp.array2d(dtype=float), params: wp.array2d(dtype=float), seed: int, i_env: int, episode: int
) -> None:
    """All numbers of an environment's next episode, into its row of `params`."""
    for k in range(samplers.shape[0]):
        params[i_env, k] = draw_param(samplers, k, seed, i_env, episode)


def typed_rows(params: Any, struct: Any, first: int = 0) -> Any:
    """The rows of a float array, shape (environments, params), seen as a task's struct of floats: the same memory.

    Args:
        params: a task's `buffers.params`.
        struct: its fields are the columns from `first` on, in order.
        first: where a task has several structs, the column of this one's first field.
    """
    names = list(struct.vars)
    if first + len(names) > params.shape[1]:
        raise ValueError(f"{struct.key}: {len(names)} fields for {params.shape[1] - first} numbers")
    return wp.array(
        ptr=params.ptr + first * params.strides[1],
        dtype=struct,
        shape=(params.shape[0],),
        strides=(params.strides[0],),
        device=params.device,
    )
