"""The arrays of a rig as live rows on the host, for a flight: read after an advance, written before one.

On the CPU they are the arrays' own memory. An array of a GPU gets a mirror when it is first asked for: all mirrors are
fetched after each advance, and those that the host may write are sent before it.
"""

from typing import Any

import numpy as np
import warp as wp

Rows = np.ndarray[Any, Any]
WRITTEN = frozenset(
    ("body", "faults", "sensor_model", "autopilot.setpoint", "autopilot.airframe", "autopilot.ekf.external")
)


class HostRows:
    """Live rows by the name of their array in `RigArrays`; of a struct within it by a path with dots.

    Args:
        arrays: the `RigArrays`.
        is_mirrored: the host cannot see their memory.
    """

    def __init__(self, arrays: Any, *, is_mirrored: bool) -> None:
        self._arrays = arrays
        self._is_mirrored = is_mirrored
        self._mirrors: dict[str, tuple[Any, Any]] = {}  # the array and its mirror, an array of the host
        self._shown: dict[str, tuple[Any, Rows]] = {}  # the array of the host and its rows, whose type is slow to make

    def __getitem__(self, name: str) -> Rows:
        """The rows; the same memory each time.

        Raises:
            AttributeError: there is no such array.
        """
        array = self._arrays
        for part in name.split("."):
            array = getattr(array, part)
        if self._is_mirrored:
            if name not in self._mirrors:
                self._mirrors[name] = (array, wp.clone(array, device="cpu"))
            array = self._mirrors[name][1]
        of_array, rows = self._shown.get(name, (None, None))
        if rows is None or of_array is not array:
            rows = array.numpy()
            self._shown[name] = (array, rows)
        return rows

    def send(self) -> None:
        """Gives the device what the host has written."""
        if not self._mirrors:
            return
        for name in self._mirrors.keys() & WRITTEN:
            array, mirror = self._mirrors[name]
            wp.copy(array, mirror)

    def fetch(self) -> None:
        """Shows the host what the device has made of it."""
        for array, mirror in self._mirrors.values():
            wp.copy(mirror, array)
