"""Where each velocity that it could be asked for leads a vehicle: the nearest to the wanted one that stays clear.

A rollout is what the vehicle does by what it was asked last, until it hears the new velocity, the change to that, and
braking to a stand from there, all level. It answers with a lag, and no faster than by an acceleration that it is taken
to have. What is clear is so from the first sample to the last: whoever takes one of them can go on taking it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.warp_start import start_warp
from policies.companion.guard.limits import capped
from policies.companion.guard.people import Somebody
from policies.companion.guard.settings import GuardSettings
from policies.companion.senses.local_map import Clearance, LocalMap
from policies.companion.telemetry import Own
from policies.tasks.flight.rollout import roll

Floats = NDArray[np.float64]
_FRACTIONS = (1.0, 0.8, 0.6, 0.4, 0.2)  # of the speed that is wanted
_TURNS = np.arange(-17, 19) * (np.pi / 18.0)
_MOST = 256  # candidates
_STEP_S, _STEPS = 0.05, 90  # coarser, it would pass over a trunk
_NEARER_M = 0.1  # who is too near already may come so much nearer on the way out,
_NEAREST_M = 0.1  # but by no more than this too near
_STEADY = 0.3  # how much what was flown last counts beside what is wanted: not left, right and left again
_SLOWER = 1.5  # how much a metre per second less counts besides: who goes slower and slower is left behind;
_GRAZING = 4.0  # [1/s] how much a metre nearer counts than it should keep off besides, where it may:
_SLACK_M = 0.25  # so much, since the map, and how a vehicle answers, are known as well as that;
_BUMP_M = 0.1  # so much less may be a touch
_THAT_WAY = 0.5  # whoever turns by 60 degrees and more does not go there at all


@dataclass(frozen=True, slots=True)
class _Judged:
    """What becomes of candidates, one element of each."""

    is_clear: NDArray[np.bool_]  # of what is solid, and where nobody has looked
    too_fast: Floats  # [m/s] by how much it comes nearer to somebody than the rule of people lets it; 0: to nobody
    least_m: Floats  # how near it comes to anything


class Rollouts:
    """Of one guard.

    Args:
        s: of the guard.
        asks_beside: a way counts as seen only if what is next to it is, too: the hull is wider than the way of its
            middle, and a camera looks ahead.
    """

    def __init__(self, s: GuardSettings, *, asks_beside: bool) -> None:
        start_warp()
        self._s, self._asks_beside = s, asks_beside
        asked, now = wp.zeros(_MOST, dtype=wp.vec2), wp.zeros(2, dtype=wp.vec2)
        way = wp.zeros((_MOST, _STEPS + 1), dtype=wp.vec2)
        self._asked, self._now, self._way = asked.numpy(), now.numpy(), way.numpy()  # live views
        hears_s = min(s.hears_s, s.reaction_s)
        inputs = [asked, now, hears_s, s.reaction_s - hears_s, s.brake, s.solid_m, _STEP_S, way]
        self._launch: Any = wp.launch(roll, _MOST, inputs, record_cmd=True)
        self._launch_one: Any = wp.launch(roll, 1, inputs, record_cmd=True)
        self._launch_bare: Any = wp.launch(roll, _MOST, [*inputs[:5], 0.0, *inputs[6:]], record_cmd=True)

    def clear_velocity(
        self, wanted: Floats, last: Floats, own: Own, around: LocalMap, people: Sequence[Somebody] = ()
    ) -> Floats:
        """The level velocity nearest to the wanted one [m/s] whose rollout is clear; if none is, the one farthest off.

        Who cannot give way to people without touching what is solid does so as fast as it can past that.

        Args:
            wanted: north and east [m/s].
            last: that was asked for last, and is being answered.
            own: telemetry.
            around: what is known.
            people: who are kept off besides; the wanted velocity does so, as far as it can be.
        """
        s = self._s
        here, clearance = np.array(own.pos_ned[:2]), around.clearance(own.pos_ned, own.boot_us)
        if self._asks_beside:
            clearance = clearance.with_room_seen(here)
        here_m = float(clearance.at(here)[0])
        wants = self._judged(wanted[None], last, own, clearance, here_m, people)
        if wants.is_clear[0] and wants.too_fast[0] <= 0.0 and wants.least_m[0] >= s.solid_m + _SLACK_M:
            return wanted  # nothing costs less
        asked = _candidates(wanted, last, s.unseen_speed, is_too_near=here_m < s.solid_m)
        found = self._judged(asked, last, own, clearance, here_m, people)
        is_clear, is_allowed, least_m = found.is_clear, found.too_fast <= 0.0, found.least_m
        speed, wanted_speed = np.hypot(*asked.T), float(np.hypot(*wanted))
        is_that_way = asked @ wanted > _THAT_WAY * speed * wanted_speed
        slower = wanted_speed - np.where(is_that_way, np.minimum(speed, wanted_speed), 0.0)
        cost = np.hypot(*(asked - wanted).T) + _STEADY * np.hypot(*(asked - last).T) + _SLOWER * slower
        cost[0] = 0.0  # what is wanted, if it is clear
        cost += _GRAZING * np.maximum(s.solid_m + _SLACK_M - least_m, 0.0)
        if (is_clear & is_allowed).any():
            return np.asarray(asked[int(np.argmin(np.where(is_clear & is_allowed, cost, np.inf)))])
        if not is_allowed.any():  # between people
            return np.zeros(2)
        bumps = self._bumps(asked, last, own, clearance, here_m)
        is_past = ~bumps & ~_is_towards(asked, people)
        if bumps[is_allowed].all() and is_past.any():
            least = np.argmin(np.where(is_past, found.too_fast + 1e-3 * cost, np.inf))
            return np.asarray(asked[int(least)])
        return np.asarray(asked[int(np.argmax(np.where(is_allowed, least_m - 1e-3 * speed, -np.inf)))])

    def _judged(
        self, asked: Floats, last: Floats, own: Own, clearance: Clearance, here_m: float, people: Sequence[Somebody]
    ) -> _Judged:
        """What becomes of candidates, (candidates, 2)."""
        s, here = self._s, np.array(own.pos_ned[:2])
        near_m, is_seen = clearance.at(here + self._rolled(asked, np.array(own.vel_ned[:2]), last))
        speed = np.hypot(asked[:, 0], asked[:, 1])
        may_be_unseen = speed <= s.unseen_speed + 1e-6
        too_fast = np.zeros(len(asked))
        for person in people:
            too_fast = np.maximum(too_fast, asked @ person.way - person.closing_max - 1e-6)
            if person.then_m < s.pressed_m:
                gives_way = speed <= s.unseen_speed + max(-person.closing_max, 0.0) + 1e-6
                may_be_unseen |= gives_way & (asked @ person.way < 0.0)
        is_blocked = (near_m < _room_m(here_m, s.solid_m)) | ~(is_seen | may_be_unseen[:, None])
        answered = 1 + round(s.reaction_s / _STEP_S)
        least_m = np.where(is_seen | may_be_unseen[:, None], near_m, 0.0)[:, answered:].min(1)
        return _Judged(np.asarray(~is_blocked.any(1)), too_fast, least_m)

    def _bumps(self, asked: Floats, last: Floats, own: Own, clearance: Clearance, here_m: float) -> NDArray[np.bool_]:
        """Which of some candidates would touch what is solid before the vehicle stands."""
        way = self._rolled(asked, np.array(own.vel_ned[:2]), last, looks_ahead=False)
        near_m, _ = clearance.at(np.array(own.pos_ned[:2]) + way)
        return np.asarray((near_m < _room_m(here_m, self._s.solid_m - _BUMP_M)).any(1))

    def _rolled(self, asked: Floats, own: Floats, last: Floats, *, looks_ahead: bool = True) -> Floats:
        """Where each candidate leads from here [m], and so far ahead; shape (candidates, _STEPS + 1, 2)."""
        self._asked[: len(asked)] = asked
        self._now[:] = own, last
        ahead = self._launch_one if len(asked) == 1 else self._launch
        (ahead if looks_ahead else self._launch_bare).launch()
        return np.asarray(self._way[: len(asked)], np.float64)


def _is_towards(asked: Floats, people: Sequence[Somebody]) -> NDArray[np.bool_]:
    """Which of some velocities lead nearer to somebody, and faster than they may."""
    is_towards = np.zeros(len(asked), bool)
    for person in people:
        is_towards |= asked @ person.way > max(person.closing_max, 0.0) + 1e-6
    return is_towards


def _room_m(here_m: float, solid_m: float) -> float:
    """What a rollout has to keep off [m], of who is so near to something now."""
    if here_m >= solid_m:
        return solid_m
    return max(here_m - _NEARER_M, min(here_m, solid_m - _NEAREST_M))


def _candidates(wanted: Floats, last: Floats, unseen_speed: float, *, is_too_near: bool) -> Floats:
    """The wanted velocity, that of before, the wanted one turned and slower, none; who is too near, slowly anywhere."""
    cos, sin = np.cos(_TURNS), np.sin(_TURNS)
    north, east = wanted
    turned = np.stack([cos * north - sin * east, sin * north + cos * east], -1)
    speed = max(float(np.hypot(*wanted)), 1e-6)
    creeping = min(unseen_speed / speed, 1.0)
    slower = np.concatenate([fraction * turned for fraction in (*_FRACTIONS, creeping)])
    away = unseen_speed * np.stack([cos, sin], -1)[: None if is_too_near else 0]
    before = capped(last, speed)
    return np.concatenate([wanted[None], before[None], slower, away, np.zeros((1, 2))])
