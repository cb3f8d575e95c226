"""Top-down images of a task, drawn with OpenCV in metres."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]

GROUND: Rgb = (244, 241, 234)
GRID: Rgb = (228, 223, 212)
INK: Rgb = (58, 56, 52)
VEHICLE: Rgb = (38, 101, 168)
GOAL: Rgb = (196, 61, 52)
OBSTACLE: Rgb = (120, 113, 100)
GOOD: Rgb = (58, 140, 82)

_SHIFT = 4  # OpenCV's sub-pixel bits


class Canvas:
    """An image of a rectangle of the ground: x to the right, y up, both in metres."""

    def __init__(self, x_m: tuple[float, float], y_m: tuple[float, float], height_px: int) -> None:
        self._left, self._top = x_m[0], y_m[1]
        self._scale = height_px / (y_m[1] - y_m[0])
        width_px = 2 * max(1, round((x_m[1] - x_m[0]) * self._scale / 2))  # even: video encoders ask for it
        self.pixels: NDArray[np.uint8] = np.empty((height_px, width_px, 3), dtype=np.uint8)
        self.pixels[:] = GROUND

    def grid(self, spacing_m: float) -> None:
        """Lines at multiples of a distance."""
        height, width = self.pixels.shape[:2]
        first_x = np.ceil(self._left / spacing_m) * spacing_m
        for x in np.arange(first_x, self._left + width / self._scale, spacing_m):
            self.line([(x, self._top), (x, self._top - height / self._scale)], GRID, 1)
        first_y = np.ceil((self._top - height / self._scale) / spacing_m) * spacing_m
        for y in np.arange(first_y, self._top, spacing_m):
            self.line([(self._left, y), (self._left + width / self._scale, y)], GRID, 1)

    def box(self, centre: tuple[float, float], size: tuple[float, float], angle_rad: float, colour: Rgb) -> None:
        """A filled rectangle; `size` along its own x and y, `angle_rad` counter-clockwise from x."""
        half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(size) / 2
        turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad)], [np.sin(angle_rad), np.cos(angle_rad)]])
        self.polygon(half @ turn.T + np.array(centre), colour)

    def polygon(self, corners: NDArray[np.float64], colour: Rgb) -> None:
        """A filled polygon, corners of shape (n, 2) [m]."""
        cv2.fillPoly(self.pixels, [self._points(corners)], colour, cv2.LINE_AA, _SHIFT)

    def disc(self, centre: tuple[float, float], radius_m: float, colour: Rgb) -> None:
        """A filled circle."""
        x, y = (int(value) for value in self._points([centre])[0])
        cv2.circle(
            self.pixels, (x, y), max(1, round(radius_m * self._scale * 2**_SHIFT)), colour, -1, cv2.LINE_AA, _SHIFT
        )

    def line(self, points: Sequence[tuple[float, float]], colour: Rgb, width_px: int = 2) -> None:
        """An open line through points."""
        cv2.polylines(self.pixels, [self._points(points)], False, colour, width_px, cv2.LINE_AA, _SHIFT)

    def text(self, words: str, row: int = 0) -> None:
        """A line of text at the top left."""
        position = (8, 20 + 18 * row)
        cv2.putText(self.pixels, words, position, cv2.FONT_HERSHEY_SIMPLEX, 0.45, INK, 1, cv2.LINE_AA)

    def _points(self, points: "Sequence[tuple[float, float]] | NDArray[np.float64]") -> NDArray[np.int32]:
        metres = np.asarray(points, dtype=np.float64)
        pixels = np.stack([metres[:, 0] - self._left, self._top - metres[:, 1]], axis=1) * self._scale
        return np.round(pixels * 2**_SHIFT).astype(np.int32)
