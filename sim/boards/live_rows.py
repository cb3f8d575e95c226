"""The rows of a Warp array as NumPy sees them, asked for once: of structs, NumPy takes longest to make their type."""

from typing import Any

from numpy.typing import NDArray


class LiveRows:
    """Live views of the arrays that are given; on the CPU."""

    def __init__(self) -> None:
        self._array: Any = None
        self._rows: Any = None

    def of(self, array: Any) -> NDArray[Any]:
        """`array.numpy()`, made anew only if the array is another than the last."""
        if array is not self._array:
            self._array, self._rows = array, array.numpy()
        rows: NDArray[Any] = self._rows
        return rows
