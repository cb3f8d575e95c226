"""Launches that are recorded once and made again while they are given the same arrays."""

from collections.abc import Callable
from typing import Any


class RecordedLaunches:
    """Of one maker: to pack the arguments of a launch takes as long as a small launch itself.

    Args:
        record: makes the launches for some arrays.
    """

    def __init__(self, record: Callable[..., list[Any]]) -> None:
        self._record = record
        self._given: tuple[Any, ...] | None = None
        self._launches: list[Any] = []

    def of(self, *arrays: Any) -> list[Any]:
        """The launches for these arrays, made anew only if they are others than the last."""
        if self._given != arrays:
            self._given, self._launches = arrays, self._record(*arrays)
        return self._launches
