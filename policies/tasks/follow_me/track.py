"""What an episode of following was, sampled at even times: all that the scorecard needs to know.

In: distances, bearings and what the camera saw, from a batch of environments or from a flight over MAVLink, always the
simulator's truth. Out: sums over the episode, and the times when its owner was lost.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Ranges:
    """EVT-Bench's ranges (TrackVLA, arXiv 2505.23189), kept at their size: scale 1.

    Distances are from the vehicle to the owner's chest, in space. "Faced" is EVT-Bench's: enough of the owner is seen.
    """

    near_m: float = 1.0
    """Nearer than this is too near."""
    far_m: float = 3.0
    """Farther than this is not following."""
    collision_m: float = 0.5
    """Nearer than this is a collision with the owner."""
    lost_m: float = 4.0
    """Farther than this the owner is being lost."""
    loss_s: float = 0.5
    """Shorter losses are not counted: a trunk passing through the image (guess)."""
    reacquired_s: float = 5.0
    """A loss that ends within this was made good."""


@dataclass(frozen=True, slots=True)
class Track:
    """One episode or flight. Arrays have one entry per sample, at even times."""

    time_s: NDArray[np.float64]  # since the episode's start: the first sample one interval after it
    distance_m: NDArray[np.float64]  # vehicle to the owner's chest
    bearing_rad: NDArray[np.float64]  # of the owner from the vehicle's true heading, in [-pi, pi]
    is_in_view: NDArray[np.bool_]  # some of the owner is in the camera's image, not hidden
    is_collided: NDArray[np.bool_]  # touches a tree, a wall or the ground, or is too near the owner
    planned_s: float  # how long the episode would have lasted had nothing ended it
    trees_per_ha: float = math.nan
    owner_speed_max: float = math.nan  # [m/s] of the owner's fastest walk or run

    def __post_init__(self) -> None:
        lengths = {len(column) for column in (self.distance_m, self.bearing_rad, self.is_in_view, self.is_collided)}
        if not len(self.time_s) or lengths != {len(self.time_s)}:
            raise ValueError("a track's arrays must have one entry per sample, and at least one")
        if self.time_s[0] <= 0.0:
            raise ValueError("a track's first sample is one interval after its start")

    @property
    def interval_s(self) -> float:
        """Between two samples."""
        return float(self.time_s[-1]) / len(self.time_s)

    @property
    def planned_count(self) -> int:
        """Samples of an episode that nothing ended early; at least those there are."""
        return max(len(self.time_s), round(self.planned_s / self.interval_s))

    @property
    def is_whole(self) -> bool:
        """Whether nothing ended it early; one sample fewer may be rounding."""
        return len(self.time_s) >= self.planned_count - 1

    def has_collision(self, ranges: Ranges) -> bool:
        """Whether it touched anything, or came too near its owner."""
        return bool((self.is_collided | (self.distance_m < ranges.collision_m)).any())


@dataclass(frozen=True, slots=True)
class Loss:
    """A time when the owner was out of view, or too far away."""

    start_s: float
    length_s: float
    is_reacquired: bool  # ended while the episode went on


def spans(is_true: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and end of each time that something was true without a break."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_true, [False])).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def losses(track: Track, ranges: Ranges) -> list[Loss]:
    """Every loss that lasted long enough to count, in order."""
    is_lost = ~track.is_in_view | (track.distance_m > ranges.lost_m)
    found = []
    for first, end in spans(is_lost):
        is_reacquired = end < len(is_lost)
        end_s = track.time_s[end] if is_reacquired else track.time_s[-1] + track.interval_s
        length_s = float(end_s - track.time_s[first])
        if length_s >= ranges.loss_s:
            found.append(Loss(float(track.time_s[first]), length_s, is_reacquired))
    return found
