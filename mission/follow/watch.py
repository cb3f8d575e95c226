"""How well a flight follows: the truth of its owner and its obstacles, ten times a second, for a scorecard.

In: a flight with an owner, frame by frame. Out: a `Track`. It looks at the truth: nothing of it goes back.
"""

from dataclasses import replace
from math import nan

import numpy as np
import warp as wp
from numpy.typing import NDArray

from mission.flight import Flight
from policies.tasks.follow_me.measuring import COLUMNS, measure_rows
from policies.tasks.follow_me.observe import DECISION_S
from policies.tasks.follow_me.track import Track

_SAMPLE_US = round(DECISION_S * 1e6)


class FollowWatch:
    """Watches vehicle 0 of a flight from now on: call `frame` after each of the flight's.

    Args:
        flight: with an owner.
        planned_s: how long it is to follow.
        touch_m: nearer to any part of the owner is a collision.

    Raises:
        ValueError: the flight has no owner.
    """

    def __init__(self, flight: Flight, planned_s: float, touch_m: float = 0.5) -> None:
        if flight.owner is None:
            raise ValueError("there is nobody to follow in this flight")
        self._flight = flight
        self._planned_s = planned_s
        self._out = wp.zeros((1, len(COLUMNS)), dtype=float)
        impact_before = float(flight.rig.arrays.body.numpy()["impact_speed"][0])  # of standing on the ground
        self._inputs = [flight.rig.arrays, flight.owner.people, touch_m, impact_before, self._out]
        self._rows: list[NDArray[np.float32]] = []
        self._start_us = flight.time_us
        self._due_us = self._start_us + _SAMPLE_US

    @property
    def is_complete(self) -> bool:
        """Whether it has followed for as long as planned."""
        return self._flight.time_us >= self._start_us + round(self._planned_s * 1e6)

    @property
    def sample_count(self) -> int:
        """Samples taken so far."""
        return len(self._rows)

    @property
    def has_collided(self) -> bool:
        """Whether it has touched anything since it is watched."""
        return any(row[3] > 0.5 for row in self._rows[-1:])

    def frame(self) -> None:
        """Takes a sample if one is due."""
        if self._flight.time_us < self._due_us:
            return
        self._due_us += _SAMPLE_US
        wp.launch(measure_rows, 1, self._inputs)
        self._rows.append(self._out.numpy()[0].copy())

    def track(self, trees_per_ha: float = nan, owner_speed_max: float = nan) -> Track:
        """What was seen so far; at least one frame must have been."""
        distance, bearing, is_in_view, is_collided = np.array(self._rows, dtype=np.float64).T
        time_s = DECISION_S * np.arange(1, len(self._rows) + 1, dtype=np.float64)
        track = Track(time_s, distance, bearing, is_in_view > 0.5, is_collided > 0.5, self._planned_s)
        return replace(track, trees_per_ha=trees_per_ha, owner_speed_max=owner_speed_max)
