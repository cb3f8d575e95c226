"""The guard under a policy that follows: what it wants is flown as far as evidence that is not the policy's allows.

In: senses that are not the policy's (policies/companion/senses), telemetry, and the velocity that the policy asks for.
Out: the velocity that is flown, the stance, and what was done how often. Graded: slower, stop, search, and at last the
end.
"""

from enum import Enum
from math import atan2, inf, isfinite

import numpy as np
from numpy.typing import NDArray

from common.attitude import wrapped, yaw_of
from policies.companion.guard.interventions import (
    HEIGHT,
    NEAR_SOMEBODY,
    NEAR_SOMETHING,
    NO_DEPTH,
    NO_GNSS,
    OLD_TELEMETRY,
    OVER_OWNER,
    OVER_SOMEBODY,
    TILTED,
    Interventions,
)
from policies.companion.guard.limits import CLIMB_M_S, capped, faded, is_tilted, stopping_speed, within_heights
from policies.companion.guard.people import PeopleRule, Somebody
from policies.companion.guard.rollouts import Rollouts
from policies.companion.guard.settings import GuardSettings
from policies.companion.senses.senses import Senses
from policies.companion.skills.skill import Velocity
from policies.companion.telemetry import NEVER_US, Own

Floats = NDArray[np.float64]
_FACE_GAIN = 1.5  # [1/s] from a bearing to a yaw rate
_YAW_MAX = 1.5  # [rad/s]
_SEARCH_PERIOD_S = 24.0  # of a search towards the phone: at first it looks there,
_SEARCH_FACES_S = 4.0  # then there from other sides, since trees may hide who is there,
_SEARCH_ROUNDS_S = 13.0  # and then round itself
_THERE_M = 2.0  # so near the stand-off it looks round
GOES_ON_S = 4.0  # an owner whom nobody hears is looked for where they would be in so long; guess
SHORT_OF_M = 2.0  # and no nearer to there than this; guess
_STAYS_M_S = 0.5  # as fast it goes back to where it stays
_RISEN_US = 2_000_000  # for so long it stays over the owner
_COUNTED_M_S = 0.3  # less than this off what was wanted is no intervention
_KEPT_M_S = 1.5  # so much of what things take off a velocity the next decision may go on from


class Stance(Enum):
    """How far the policy is trusted."""

    FREE = "following"
    SLOW = "slower: the owner is not seen"
    STOP = "holding: the owner is not seen"
    SEARCH = "searching the owner"
    BLIND = "holding: old pictures"
    LATE = "slower: old pictures"


class Guard:
    """Over one vehicle.

    Args:
        settings: what it allows.
        senses: what it goes by; fed by somebody else.
    """

    def __init__(self, settings: GuardSettings, senses: Senses) -> None:
        self.settings = self._usual = settings
        self._set = settings.model_fields_set
        self.senses = senses
        self._people, self._rollouts = _rules(settings)
        self.stance = Stance.FREE
        self.interventions = Interventions()
        self._late_s = 0.0  # that setpoints are later than usual
        self._begun_us = 0  # when the policy took over, on the vehicle's clock
        self._flown = np.zeros(2)  # what was let be flown last
        self.goes_on_from = np.zeros(2)
        """The level velocity [m/s] from which a pilot goes on who changes it by steps: as flown, with some of what
        things took off it. From what was flown alone, steps towards a trunk and turns off it come to a stand there."""
        self.vel_std: float | None = None
        """[m/s] How well the velocity is known while GNSS is away; None: it is there."""
        self._is_too_near = False
        self._sinking_max = 0.0  # [m/s] of who is too near
        self._risen_us = NEVER_US  # when it rose over the owner last
        self._there_us = 0  # when a search came to where the phone says
        self._search_us = 0  # when it began to search,
        self._stays_ned: Floats | None = None  # and where it stays in the end

    def begin(self, own: Own) -> None:
        """The policy takes over."""
        self.stance = Stance.FREE
        self._begun_us = own.boot_us
        self._flown = self.goes_on_from = np.array(own.vel_ned[:2])
        self._risen_us = NEVER_US

    def reckon_with(self, late_s: float) -> None:
        """Setpoints take so much longer [s] than usual to reach the vehicle."""
        if late_s != self._late_s:
            self._late_s = late_s
            self._make_rules()

    def reckon_with_brake(self, brake: float) -> None:
        """The vehicle brakes so hard [m/s²], before people and before what does not move; what was set stays."""
        known = {"owner_brake", "brake"} - self._set
        self._usual = self._usual.model_copy(update=dict.fromkeys(known, brake))
        self._make_rules()

    def _make_rules(self) -> None:
        usual, late_s = self._usual, self._late_s
        later = {"reaction_s": usual.reaction_s + late_s, "hears_s": usual.hears_s + late_s}
        self.settings = usual.model_copy(update=later)
        self._people, self._rollouts = _rules(self.settings)

    def is_lost(self, own: Own) -> bool:
        """Whether the owner was not seen for so long that it is the end; who has just begun may look for them first."""
        s = self.settings
        return self._alone_s(own) > (s.lost_s if self.vel_std is None else min(s.lost_s, s.sight_lost_s))

    def _alone_s(self, own: Own) -> float:
        """Since the owner was seen, or since the policy took over."""
        return min(self.senses.silence_s(own), max(own.boot_us - self._begun_us, 0) * 1e-6)

    def filtered(self, wanted: Velocity, own: Own) -> Velocity:
        """What is flown of a velocity in ned and a yaw rate that a policy asks for."""
        self.interventions.decide()
        s, (velocity, yaw_rate) = self.settings, wanted
        age_s = max(own.boot_us - self.senses.image_us, 0) * 1e-6
        silence_s = self.senses.silence_s(own)
        self.stance = self._stance(silence_s, age_s)
        if self.stance is not Stance.SEARCH:
            self._search_us, self._stays_ned = own.boot_us, None
        level = np.array(velocity[:2])
        down = velocity[2]
        if self.stance in (Stance.SEARCH, Stance.STOP):
            level, down, yaw_rate = self._searched(own, self.stance is Stance.SEARCH)
            self.interventions.note(self.stance.value)
        elif self.stance is not Stance.FREE:
            scale = faded(silence_s, s.slow_s, s.stop_s) * faded(age_s, s.image_slow_s, s.image_stop_s)
            level, down = scale * level, scale * down
            yaw_rate = self._facing_owner(own, yaw_rate)
            self.interventions.note(self.stance.value)
        if self.stance is Stance.FREE and is_tilted(own.q_ned_from_frd, s):
            level = np.array(own.vel_ned[:2])  # asks for no more tilt
            self.interventions.note(TILTED)
        if own.late_s > s.telemetry_slow_s:  # then ages on the vehicle's clock stand still
            scale = faded(own.late_s, s.telemetry_slow_s, s.telemetry_stop_s)
            level, down = scale * level, scale * down
            self.interventions.note(OLD_TELEMETRY)
        let_be, people = self._past_people(self._by_sight(level), own)
        level = self._flown = self._past_solids(let_be, own, people)
        taken = let_be - level
        self.goes_on_from = level + capped(taken, _KEPT_M_S)
        down = self._within_heights(down, own)
        return (float(level[0]), float(level[1]), float(down)), yaw_rate

    def _by_sight(self, level: Floats) -> Floats:
        """The velocity, as fast as who has no GNSS may go: as well as it knows how fast it goes."""
        if self.vel_std is None:
            return level
        s = self.settings
        most = s.sight_speed * faded(self.vel_std, s.sight_slow_std, s.sight_stop_std)
        slower = capped(level, most)
        self._count(NO_GNSS, level, slower)
        return slower

    def _stance(self, silence_s: float, age_s: float) -> Stance:
        s = self.settings
        if age_s > s.image_stop_s:
            return Stance.BLIND
        search_s = s.search_among_s if self._is_among_others else s.search_s
        if silence_s > search_s or (self.stance is Stance.SEARCH and silence_s > s.slow_s):
            return Stance.SEARCH
        if silence_s > s.stop_s:
            return Stance.STOP
        if silence_s > s.slow_s:
            return Stance.SLOW
        return Stance.LATE if age_s > s.image_slow_s else Stance.FREE

    @property
    def _is_among_others(self) -> bool:
        """Whom it has lost is likely behind somebody, and the phone says where."""
        return self.senses.is_heard and self.senses.has_met_others

    def _searched(self, own: Own, is_searching: bool) -> tuple[Floats, float, float]:
        """Up, out of people's way; towards the phone, no nearer than a stand-off, and round it.

        Without one it turns, first on its flight to where they may be, then on the spot; with one now and then too: the
        phone may be wrong.
        """
        s, among = self.settings, self._is_among_others
        height_m = s.search_among_height_m if among else s.search_height_m
        down = -CLIMB_M_S * float(np.clip(2.0 * (height_m - own.height_m), -0.5, 1.0))
        down = down if isfinite(own.height_m) else 0.0
        if self.vel_std is not None:  # nobody searches where it does not know how far it has come
            has_known = self.senses.seen.sights > 0 and not is_searching
            turns = self._facing(self.senses.seen.now(own.boot_us)[0], own) if has_known else s.search_yaw_rate
            return self._staying(own), down, turns
        track = self.senses.watch.track
        if self.senses.is_heard and track is not None and track.is_known:
            way = np.array(track.pos_ned[:2]) - np.array(own.pos_ned[:2])
            far_m = float(np.hypot(*way))
            yaw_rate = self._facing(track.pos_ned, own)
            if not is_searching or far_m < 0.1:
                self._there_us = own.boot_us
                return np.zeros(2), down, yaw_rate
            stand_off_m = s.search_among_m if among else s.search_stand_off_m
            level = self._approaching(way, stand_off_m, s.search_speed)
            if far_m > stand_off_m + _THERE_M:
                self._there_us = own.boot_us
            phase_s = max(own.boot_us - self._there_us, 0) * 1e-6 % _SEARCH_PERIOD_S
            if phase_s < _SEARCH_FACES_S:
                return level, down, yaw_rate
            if phase_s < _SEARCH_ROUNDS_S:
                return level + s.search_round_speed * np.array([-way[1], way[0]]) / far_m, down, yaw_rate
            return level, down, s.search_yaw_rate
        has_seen = self.senses.seen.sights > 0
        if has_seen and not is_searching:
            return np.zeros(2), down, self._facing(self.senses.seen.now(own.boot_us)[0], own)  # where they were going
        if not has_seen or own.boot_us - self._search_us >= s.search_ahead_s * 1e6:
            return self._staying(own), down, s.search_yaw_rate
        way = self._likely_place() - np.array(own.pos_ned[:2])
        return self._approaching(way, SHORT_OF_M, s.search_ahead_speed), down, s.search_yaw_rate

    def _approaching(self, way: Floats, short_of_m: float, speed_max: float) -> Floats:
        """The level velocity along a way that ends in a stand, so far short of its end."""
        far_m = float(np.hypot(*way))
        speed = min(stopping_speed(far_m - short_of_m, self.settings.reaction_s, 1.0), speed_max)
        return np.asarray(speed * way / max(far_m, 1e-6))

    def _staying(self, own: Own) -> Floats:
        """The level velocity that keeps it where it was when it was asked first: none at all lets it drift."""
        here = np.array(own.pos_ned[:2])
        if self._stays_ned is None:
            self._stays_ned = here
        off = self._stays_ned - here
        return capped(off, _STAYS_M_S)

    def _likely_place(self) -> Floats:
        """Where an owner whom nobody hears is looked for [m], north and east: as they were last seen to go."""
        seen = self.senses.seen
        place, velocity = seen.now(seen.time_us)
        return np.asarray(place[:2] + GOES_ON_S * velocity[:2])

    def _facing_owner(self, own: Own, yaw_rate: float) -> float:
        """Towards where sights and phone put an owner who is not seen; a yaw rate if nobody knows."""
        known = self.senses.owner_now(own)
        if known is None or not self.senses.is_heard:
            return yaw_rate
        return self._facing(known.pos_ned, own)

    def _facing(self, place_ned: Floats, own: Own) -> float:
        """The yaw rate with which it turns its nose to a place."""
        north, east = np.array(place_ned[:2]) - np.array(own.pos_ned[:2])
        error = wrapped(atan2(east, north) - yaw_of(own.q_ned_from_frd))
        return float(np.clip(_FACE_GAIN * error, -_YAW_MAX, _YAW_MAX))

    def _past_people(self, level: Floats, own: Own) -> tuple[Floats, list[Somebody]]:
        """The velocity without what brings it too near to anybody who was seen, and what it has to do with them."""
        owner, people = self.senses.owner_now(own), self.senses.others_now(own)
        everybody = people if owner is None else [owner, *people]
        kept, near = self._people.bound(
            level, own, everybody, has_depth=self.senses.map.has_depth, passes_over=self.stance is Stance.SEARCH
        )
        self._is_too_near = any(person.then_m < self.settings.owner_m for person in near)
        self._sinking_max = min((person.sinking_max for person in near), default=inf)
        self._count(NEAR_SOMEBODY, level, kept)
        return kept, [person for person in near if not person.is_passed_over]

    def _past_solids(self, level: Floats, own: Own, people: list[Somebody]) -> Floats:
        s, around = self.settings, self.senses.map
        slower = level
        if not around.has_depth:
            slower = capped(level, s.no_depth_speed)
            self._count(NO_DEPTH, level, slower)
        kept = self._rollouts.clear_velocity(slower, self._flown, own, around, people)
        self._count(NEAR_SOMETHING, slower, kept)
        return kept

    def _within_heights(self, down: float, own: Own) -> float:
        s = self.settings
        if self._is_too_near and not own.height_m > s.height_max_m:
            self._risen_us = own.boot_us
            if self._sinking_max < min(down, 0.0):
                self.interventions.note(OVER_OWNER)
                return self._sinking_max
        if own.boot_us - self._risen_us < _RISEN_US:  # they may be right below, where it cannot see them
            down = min(down, 0.0)
        if down - self._sinking_max > _COUNTED_M_S:
            self.interventions.note(OVER_SOMEBODY)
        down = allowed = min(down, self._sinking_max)
        room_m = self.senses.map.room_up_m(own.pos_ned, own.boot_us) - s.crown_m
        if isfinite(room_m):
            down = max(down, -stopping_speed(room_m, s.reaction_s, CLIMB_M_S))
        kept = within_heights(down, own.height_m, s) if own.is_range_heard else 0.0
        if abs(kept - allowed) > _COUNTED_M_S:
            self.interventions.note(HEIGHT)
        return kept

    def _count(self, why: str, wanted: Floats, kept: Floats) -> None:
        if float(np.hypot(*(wanted - kept))) > _COUNTED_M_S:
            self.interventions.note(why)


def _rules(s: GuardSettings) -> tuple[PeopleRule, Rollouts]:
    """Of people, and of what is solid; its camera looks ahead."""
    return PeopleRule(s), Rollouts(s, asks_beside=True)
