"""What a plot is made of: curves against time, thinned for display so that no peak is lost.

A `Panel` is one plot of the page; several make a section. Numbers travel as base64 float32, each array once.
"""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[Any]
POINTS_MAX = 3000  # of a curve: more than twice the pixels of a wide window


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a plot."""

    name: str
    time_s: Rows
    values: Rows
    is_setpoint: bool = False
    is_step: bool = False  # a state, which holds until the next row
    flight: int = 0


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot."""

    key: str
    title: str
    unit: str
    curves: tuple[Curve, ...]
    bounds: tuple[tuple[float, str], ...] = ()  # levels drawn across, with their meaning
    least_span: float = 0.0  # of the vertical axis: noise on a quantity that stands still does not fill the plot
    starts_at_zero: bool = False
    is_of_flight: bool = False  # the vertical axis fits what happened in the air: before, it may be anything
    wraps: bool = False  # an angle: its jump by a turn is no line
    ceiling: float | None = None  # the vertical axis ends there at the latest


@dataclass(frozen=True, slots=True)
class Section:
    """Plots that belong together, and what the log does not hold of them."""

    key: str
    title: str
    panels: tuple[Panel, ...]
    missing: tuple[str, ...] = ()
    remark: str = ""


def curves(time_s: Rows, columns: Rows, names: Sequence[str], **style: Any) -> list[Curve]:
    """Curves of one topic, thinned together: they share their times."""
    columns = np.asarray(columns, float).reshape(len(time_s), -1)
    is_seen = np.isfinite(columns).any(axis=0)
    times, thin = thinned(time_s, columns[:, is_seen])
    shown = [name for name, seen in zip(names, is_seen, strict=True) if seen]
    return [Curve(name, times, thin[:, k], **style) for k, name in enumerate(shown)]


def thinned(time_s: Rows, columns: Rows, points_max: int = POINTS_MAX) -> tuple[Rows, Rows]:
    """The least and the greatest value in each of `points_max / 2` stretches of time, in the order they came in."""
    if len(time_s) <= points_max or columns.shape[1] == 0:
        return time_s, columns
    stretches = points_max // 2
    edges = np.linspace(time_s[0], time_s[-1], stretches + 1)[:-1]
    begins = np.unique(np.searchsorted(time_s, edges))
    begins = begins[begins < len(time_s)]
    ends = np.append(begins[1:], len(time_s)) - 1
    low = np.fmin.reduceat(columns, begins, axis=0)
    high = np.fmax.reduceat(columns, begins, axis=0)
    rises = columns[ends] >= columns[begins]
    thin = np.empty((2 * len(begins), columns.shape[1]))
    thin[0::2] = np.where(rises, low, high)
    thin[1::2] = np.where(rises, high, low)
    times = np.empty(2 * len(begins))
    times[0::2], times[1::2] = time_s[begins], time_s[ends]
    return times, thin


class ArrayPool:
    """Arrays of the page, each kept once: curves of one topic share their times."""

    def __init__(self) -> None:
        self._places: dict[str, int] = {}

    def add(self, values: Rows) -> int:
        """The number under which the page finds it."""
        text = b64encode(np.asarray(values, "<f4").tobytes()).decode()
        return self._places.setdefault(text, len(self._places))

    def texts(self) -> list[str]:
        return list(self._places)
