"""How fast a vehicle may come nearer to each of the people near it: the rule that policies are trained under.

One kernel launch for all of them, on arrays that stay: called function by function it took a third of a decision.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.warp_start import start_warp
from policies.companion.guard.settings import GuardSettings
from policies.companion.senses.seen_owner import PersonNow
from policies.companion.telemetry import Own
from policies.tasks.follow_me.tracked.keep_off import OVER_M, Asked, Bounds, Person, keep_off, keep_off_all

Floats = NDArray[np.float64]
MOST = 16  # people that are reckoned with at a time
_SILENCE_MAX_S = 60.0  # silence that is no number is so long


@dataclass(frozen=True)
class Somebody:
    """A person near the vehicle."""

    way: Floats
    """Unit, from the vehicle to them, north and east."""
    closing_max: float
    """[m/s] towards them; negative: it has to give way."""
    then_m: float
    """How far away they are when the vehicle answers [m]."""
    sinking_max: float
    """[m/s] how fast it may sink; negative: it has to climb."""
    is_passed_over: bool = False
    """It keeps its height, far enough over them."""


class PeopleRule:
    """Of one guard.

    Args:
        s: of the guard.
    """

    def __init__(self, s: GuardSettings) -> None:
        start_warp()
        rule = keep_off(s.owner_m, s.owner_brake, s.reaction_s, s.escape_climb)
        asked, people = wp.zeros(1, dtype=Asked), wp.zeros(MOST, dtype=Person)
        kept, out = wp.zeros(1, dtype=wp.vec2), wp.zeros(MOST, dtype=Bounds)
        self._asked, self._people = asked.numpy(), people.numpy()  # live views, as of what comes out
        self._kept, self._out = kept.numpy(), out.numpy()
        self._launch: Any = wp.launch(keep_off_all, 1, [rule, asked, people, kept, out], record_cmd=True)

    def bound(
        self, level: Floats, own: Own, people: Sequence[PersonNow], *, has_depth: bool, passes_over: bool
    ) -> tuple[Floats, list[Somebody]]:
        """The velocity [m/s] without what is too fast towards anybody, and what it has to do with each, the first 16.

        Args:
            level: north and east.
            own: telemetry.
            people: as they are by now.
            has_depth: ranges are measured, not told from looks.
            passes_over: it keeps its height: whoever is far enough below does not count.
        """
        here, count = np.array(own.pos_ned[:2]), min(len(people), MOST)
        self._asked[0] = (level, own.vel_ned, count, has_depth, passes_over)
        for row, known in zip(self._people, people, strict=False):
            silence_s, over_m = min(known.silence_s, _SILENCE_MAX_S), float(known.pos_ned[2]) - own.pos_ned[2]
            row["way"], row["vel"], row["vel_var"] = known.pos_ned[:2] - here, known.vel, known.vel_var
            row["age_s"], row["over_m"] = silence_s, over_m
        self._launch.launch()
        near = [_somebody(row, bound, passes_over) for row, bound in zip(self._people[:count], self._out, strict=False)]
        return self._kept[0].astype(np.float64), near


def _somebody(row: Any, bound: Any, passes_over: bool) -> Somebody:
    way = row["way"].astype(np.float64)
    closing_max, then_m, sinking_max = (float(bound[name]) for name in ("closing_max", "then_m", "sinking_max"))
    unit = way / max(float(np.hypot(*way)), 1e-3)
    return Somebody(unit, closing_max, then_m, sinking_max, passes_over and float(row["over_m"]) >= float(OVER_M))
