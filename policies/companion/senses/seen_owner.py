"""Somebody by sights, the owner first of all: place, velocity and looks.

The filter is the one that policies are trained with.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.warp_start import start_warp
from policies.companion.senses.looks import Looks
from policies.companion.senses.poses import Pose
from policies.tasks.follow_me.tracked.owner_filter import OwnerFilter, now_rows, see_rows

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Somebody in an image."""

    place_ned: Floats
    """[m] Of the chest, (3,)."""
    has_depth: bool
    """Their range is measured."""
    colours: Floats | None = None
    """As a detection has them."""

    def off_m(self, place: Floats) -> float:
        """From a place, level."""
        return float(np.hypot(*(self.place_ned - place)[:2]))


@dataclass(frozen=True, slots=True)
class PersonNow:
    """What is known of somebody by now."""

    pos_ned: Floats
    """[m] of the chest, (3,)."""
    pos_var: Floats
    """[m²] its covariance, level."""
    vel: Floats
    """[m/s] north and east."""
    vel_var: Floats
    """[m²/s²] its covariance."""
    silence_s: float
    """Since they were seen; inf: never."""


class SeenOwner:
    """Of one person: one row of the filter."""

    def __init__(self) -> None:
        start_warp()
        self.filters: Any = wp.zeros(1, dtype=OwnerFilter)
        place, eye, velocity = (wp.zeros(1, dtype=kind) for kind in (wp.vec3, wp.vec3, wp.vec2))
        asked, out = wp.zeros(1, dtype=OwnerFilter), wp.zeros(1, dtype=wp.vec3)
        has_depth, age_s = wp.zeros(1, dtype=int), wp.zeros(1, dtype=float)
        self._row: NDArray[Any] = self.filters.numpy()  # live views, as of the others
        self._place, self._eye, self._velocity = place.numpy(), eye.numpy(), velocity.numpy()
        self._asked, self._out, self._has_depth, self._age_s = (
            asked.numpy(), out.numpy(), has_depth.numpy(), age_s.numpy(),
        )  # fmt: skip
        self._see = wp.launch(see_rows, 1, [self.filters, place, eye, has_depth, age_s], record_cmd=True)
        self._now = wp.launch(now_rows, 1, [asked, out, velocity], record_cmd=True)
        self.time_us = 0
        """Of the newest sight."""
        self.sights = 0
        """So many there were."""
        self.looks = Looks()

    def see(self, sight: Sight, pose: Pose) -> None:
        """An image, newer than the last, shows them."""
        self._row["age_s"] = max(pose.time_us - self.time_us, 0) * 1e-6
        self.time_us = pose.time_us
        self.sights += 1
        self.looks.see(sight.colours)
        self._place[0], self._eye[0] = sight.place_ned, pose.pos_ned
        self._has_depth[0], self._age_s[0] = int(sight.has_depth), 0.0
        self._see.launch()

    def at(self, time_us: int) -> Any:
        """The filter as of a time: array of one, which is kept and changes."""
        self._row["age_s"] = max(time_us - self.time_us, 0) * 1e-6
        return self.filters

    def now(self, time_us: int) -> tuple[Floats, Floats]:
        """Place [m], ned, and level velocity [m/s] at a time."""
        self._asked[:] = self._row
        self._asked["age_s"] = (time_us - self.time_us) * 1e-6
        self._now.launch()
        return self._out[0].astype(np.float64), self._velocity[0].astype(np.float64)

    def person_now(self, time_us: int) -> PersonNow:
        """What is known of them at a time."""
        place, velocity = self.now(time_us)
        pos_var, vel_var = (np.asarray(self._row["both"][name][0], np.float64) for name in ("pos_var", "vel_var"))
        return PersonNow(place, pos_var, velocity, vel_var, max(time_us - self.time_us, 0) * 1e-6)
