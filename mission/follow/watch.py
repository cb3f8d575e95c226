"""How well a flight follows: the truth of its owner and its obstacles, for a scorecard.

In: a flight with an owner, frame by frame, and whether somebody follows. Out: a `Track` from then on, a sample for each
decision; it ends with the planned time, with a collision, or when nobody follows any more. Nothing of the truth goes
back to who flies.
"""

from collections.abc import Callable

import numpy as np
import warp as wp
from numpy.typing import NDArray

from mission.flight import Flight
from policies.tasks.follow_me.measuring import COLUMNS, forget_impacts, measure_rows
from policies.tasks.follow_me.observe import DECISION_S
from policies.tasks.follow_me.track import Ranges, Track

_SAMPLE_US = round(DECISION_S * 1e6)


class FollowWatch:
    """Watches vehicle 0 of a flight: call `frame` after each of the flight's.

    Args:
        flight: with an owner.
        is_following: whether somebody makes the vehicle follow now.
        planned_s: how long it is to follow.

    Raises:
        ValueError: the flight has no owner.
    """

    def __init__(self, flight: Flight, is_following: Callable[[], bool], planned_s: float) -> None:
        if flight.owner is None:
            raise ValueError("there is nobody to follow in this flight")
        self._flight = flight
        self._is_following = is_following
        self._planned_s = planned_s
        self._out = wp.zeros((1, len(COLUMNS)), dtype=float)
        self._row: NDArray[np.float32] = self._out.numpy()[0]  # live
        self._inputs = [flight.rig.arrays, flight.owner.people, Ranges().collision_m, self._out]
        self._rows: list[NDArray[np.float32]] = []
        self._start_us = -1  # of the flight, when it began to follow; -1: not yet
        self.is_over = False

    @property
    def sample_count(self) -> int:
        """Samples taken so far."""
        return len(self._rows)

    def begin(self) -> None:
        """It is to follow from now on, whether it does or not; otherwise that begins by itself."""
        self._start_us = self._flight.time_us
        wp.launch(forget_impacts, 1, [self._flight.rig.arrays])

    def frame(self) -> None:
        """Looks for collisions, and takes a sample if one is due or the following is over."""
        if self.is_over:
            return
        if self._start_us < 0:
            if self._is_following():
                self.begin()
            return
        wp.launch(measure_rows, 1, self._inputs)
        passed_us = self._flight.time_us - self._start_us
        has_collided = self._row[COLUMNS.index("is_collided")] > 0.5
        is_left = not self._is_following()
        self.is_over = has_collided or is_left or passed_us >= round(self._planned_s * 1e6)
        is_due = passed_us >= (len(self._rows) + 1) * _SAMPLE_US
        if is_due or has_collided or (is_left and not self._rows):
            self._rows.append(self._row.copy())

    def track(self) -> Track | None:
        """What was seen so far; none before the first sample."""
        if not self._rows:
            return None
        distance, bearing, is_in_view, is_collided = np.array(self._rows, dtype=np.float64).T
        time_s = DECISION_S * np.arange(1, len(self._rows) + 1, dtype=np.float64)
        return Track(time_s, distance, bearing, is_in_view > 0.5, is_collided > 0.5, self._planned_s)
