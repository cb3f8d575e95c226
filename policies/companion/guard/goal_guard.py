"""The guard under a policy that goes to goals: how fast it may, by what the ranges show and how old they are.

In: ranges all round with their age, telemetry, and the velocity that the policy asks for. Out: the velocity that is
flown or driven, the stance, and what was done how often. Graded: slower, stop; the end is the companion's. It keeps its
own map of the last scans and asks no policy.
"""

from enum import Enum
from math import isfinite, radians, sin

import numpy as np
from numpy.typing import NDArray

from common.attitude import rotated, yaw_of
from common.range_sectors import RangeLayout
from policies.companion.guard.interventions import (
    HEIGHT,
    NEAR_SOMETHING,
    OLD_TELEMETRY,
    TILTED,
    TOO_FAST,
    Interventions,
)
from policies.companion.guard.limits import (
    braking_speed,
    capped,
    faded,
    is_tilted,
    stopping_speed,
    way_along_m,
    within_heights,
)
from policies.companion.guard.rollouts import Rollouts
from policies.companion.guard.settings import GuardSettings
from policies.companion.ranges import Ranges
from policies.companion.senses.local_map import LocalMap
from policies.companion.senses.poses import Pose
from policies.companion.skills.skill import Velocity
from policies.companion.telemetry import NEVER_US, Own

Floats = NDArray[np.float64]
_MISSED_US = 300_000  # one in a hundred sectors misses what is there: so long what it told before counts
_COUNTED_M_S = 0.3  # less than this off what was wanted is no intervention
_STEERED = 1.15  # [1/m] no car turns on less: 0.5 m between axles, 30 degrees
_STANDS_M_S = 0.05


class GoalStance(Enum):
    """How far the policy is trusted."""

    FREE = "as the policy asks"
    SLOW = "slower: old ranges"
    STOP = "holding: old ranges"
    DIM = "slower: the ranges see nothing"
    DARK = "holding: the ranges see nothing"


STANDING = (GoalStance.STOP, GoalStance.DARK)


class GoalGuard:
    """Over one vehicle that flies, or drives by velocities; a subclass bounds what drives along its nose.

    Args:
        settings: what it allows.
        drives: it is on the ground.
    """

    def __init__(self, settings: GuardSettings, *, drives: bool) -> None:
        brake, reaction_s = settings.brake, settings.goal_reaction_s
        if drives:
            brake, reaction_s = settings.drive_brake, settings.drive_reaction_s
        update = {"brake": brake, "solid_m": settings.goal_solid_m}
        update |= dict.fromkeys(("reaction_s", "hears_s"), reaction_s)
        self.settings = settings.model_copy(update=update)
        # a scanner sees 120 degrees to either side; asked for what is beside, it was slower among 600 trees a hectare
        self._rollouts = Rollouts(self.settings, asks_beside=False)
        self._drives = drives
        self.stance = GoalStance.FREE
        self.interventions = Interventions()
        self._forget()

    def _forget(self) -> None:
        """The vehicle's clock and frame begin anew."""
        self._boot_us = 0
        self._map = LocalMap()
        self._flown = np.zeros(2)  # what was let be flown last
        self._stamp_us = -1
        self.taken_us = NEVER_US
        """When the newest scan was taken, on the vehicle's clock."""
        self._lit_us = NEVER_US  # when a scan with a return was, the last time
        self._had_none = np.array(True)  # which sectors had no return in the scan before
        self._has_beams = False  # which see the ground, wherever it is: without any return it is blind
        self._ceiling_m = np.inf  # above the vehicle, by the beams that look up

    def sense(self, own: Own, ranges: Ranges) -> None:
        """Takes in telemetry, and a new scan if there is one."""
        if own.boot_us < self._boot_us:
            self._forget()
            self._stamp_us = ranges.stamp_us
        self._boot_us = own.boot_us
        if ranges.stamp_us == self._stamp_us or not isfinite(own.pos_ned[0]):
            return
        self._stamp_us, self.taken_us = ranges.stamp_us, ranges.taken_us
        pose = ranges.poses.at(self.taken_us)
        if pose is None:
            return
        if bool((ranges.ranges_m < ranges.layout.range_m).any()) or self._lit_us == NEVER_US:
            self._lit_us = self.taken_us
        self._has_beams = bool(ranges.layout.beam_elevations_deg)
        self._scanned(ranges, pose, own.boot_us)

    def _scanned(self, ranges: Ranges, pose: Pose, now_us: int) -> None:
        layout = ranges.layout
        has_none = ranges.ranges_m[: layout.sectors] >= layout.range_m
        has_missed = has_none & ~self._had_none  # one in a hundred sectors misses what is there
        self._had_none = has_none
        bearings, sector_m = sectors_of(ranges)
        counts = ~has_missed[ranges.is_known]
        self._map.sweep(bearings[counts], radians(layout.sector_deg), sector_m[counts], layout.range_m, pose, now_us)
        beams_m = ranges.ranges_m[layout.sectors :]
        up = [(far_m, elevation) for far_m, elevation in zip(beams_m, layout.beam_elevations_deg, strict=True)]
        over = [float(far_m) * sin(radians(e)) for far_m, e in up if e > 20.0 and far_m < layout.range_m]
        self._ceiling_m = min(over, default=np.inf)

    def filtered(self, wanted: Velocity, own: Own) -> Velocity:
        """What is flown of a velocity and a yaw rate that a policy asks for."""
        self.interventions.decide()
        age_s = max(own.boot_us - self.taken_us, 0) * 1e-6
        dark_s = max(own.boot_us - self._lit_us, 0) * 1e-6
        scale, most = self._trust(age_s, dark_s)
        (velocity, yaw_rate) = wanted
        level = np.array(velocity[:2])
        kept = capped(scale * level, min(most, self.settings.speed_max))
        self._count(TOO_FAST if self.stance is GoalStance.FREE else self.stance.value, level, kept)
        if self.stance is GoalStance.FREE and is_tilted(own.q_ned_from_frd, self.settings):
            as_it_goes = capped(np.array(own.vel_ned[:2]), self.settings.speed_max)  # asks for no more tilt
            kept = np.zeros(2) if self._drives else as_it_goes
            self.interventions.note(TILTED)
        if own.late_s > self.settings.telemetry_slow_s:  # then ages on the vehicle's clock stand still
            heard = faded(own.late_s, self.settings.telemetry_slow_s, self.settings.telemetry_stop_s)
            kept, scale = heard * kept, heard * scale
            self.interventions.note(OLD_TELEMETRY)
        yaw_rate *= self._turning(level, kept, scale)
        return self._bounded(kept, scale * velocity[2], yaw_rate, own, age_s)

    def _turning(self, level: Floats, kept: Floats, scale: float) -> float:  # noqa: ARG002
        """The fraction of the yaw rate that is kept: who flies may look about as it slows down."""
        return 1.0

    def begin(self, own: Own) -> None:
        """The policy takes over."""
        self.stance = GoalStance.FREE
        self._flown = np.array(own.vel_ned[:2])

    def _bounded(self, level: Floats, down: float, yaw_rate: float, own: Own, age_s: float) -> Velocity:  # noqa: ARG002
        """The nearest velocity that can be flown and stopped in what is clear, between the ground and the crowns."""
        kept = self._rollouts.clear_velocity(level, self._flown, own, self._map)
        self._flown = kept
        self._count(NEAR_SOMETHING, level, kept)
        if not self._drives:
            down = self._within_heights(down, own)
        return (float(kept[0]), float(kept[1]), float(down)), yaw_rate

    def _trust(self, age_s: float, dark_s: float) -> tuple[float, float]:
        """Takes a stance; the fraction [1] that is flown of what is asked for, and the most [m/s]."""
        s = self.settings
        scale, most = faded(age_s, s.scan_slow_s, s.scan_stop_s), np.inf
        self.stance = GoalStance.FREE
        if dark_s > s.dark_slow_s and self._has_beams:
            most = s.no_depth_speed if dark_s < s.dark_stop_s else 0.0
            self.stance = GoalStance.DIM if most > 0.0 else GoalStance.DARK
        if age_s > s.scan_slow_s:
            self.stance = GoalStance.STOP if scale <= 0.0 else GoalStance.SLOW
        return scale, most

    def _within_heights(self, down: float, own: Own) -> float:
        s = self.settings
        height_m = own.height_m
        kept = within_heights(down, height_m, s) if isfinite(height_m) else 0.0
        is_low = isfinite(height_m) and height_m < s.height_min_m
        if not is_low:  # from the ground it goes up, whatever is above
            kept = max(kept, -stopping_speed(self._ceiling_m - s.crown_m, s.reaction_s, 1.0))
        if abs(kept - down) > _COUNTED_M_S:
            self.interventions.note(HEIGHT)
        return kept

    def _count(self, why: str, wanted: Floats, kept: Floats) -> None:
        if float(np.hypot(*(wanted - kept))) > _COUNTED_M_S:
            self.interventions.note(why)


class NoseGuard(GoalGuard):
    """Over one vehicle that drives along its nose: an arc at a time, forwards or backwards.

    Args:
        settings: what it allows.
    """

    def __init__(self, settings: GuardSettings) -> None:
        super().__init__(settings, drives=True)

    def _forget(self) -> None:
        super()._forget()
        self._points = np.zeros((0, 2))  # what is solid, north and east [m]
        self._seen_us = np.zeros(0, np.int64)  # when each of them was

    def _scanned(self, ranges: Ranges, pose: Pose, now_us: int) -> None:
        layout = ranges.layout
        bearings, sector_m = sectors_of(ranges)
        is_return = sector_m < layout.range_m
        third = radians(layout.sector_deg) / 3.0  # a return may be anywhere in its sector
        yaw = yaw_of(pose.q_ned_from_frd)
        angles = yaw + (bearings[is_return, None] + np.array([-third, 0.0, third]))
        units = np.stack([np.cos(angles), np.sin(angles)], -1).reshape(-1, 2)
        points = np.array(pose.pos_ned[:2]) + np.repeat(sector_m[is_return], 3)[:, None] * units
        off = self._points - np.array(pose.pos_ned[:2])
        sectors = self._sector_of(np.arctan2(off[:, 1], off[:, 0]) - yaw, layout)
        has_missed = np.ones(layout.sectors, np.bool_)
        has_missed[np.flatnonzero(ranges.is_known)[is_return]] = False
        is_kept = has_missed[sectors] & (now_us - self._seen_us < _MISSED_US)
        self._points = np.concatenate([points, self._points[is_kept]])
        self._seen_us = np.concatenate([np.full(len(points), now_us), self._seen_us[is_kept]])

    @staticmethod
    def _sector_of(bearings_rad: Floats, layout: RangeLayout) -> NDArray[np.int64]:
        """In which sector each of some bearings from the nose lies, of a ring all round."""
        off_deg = np.degrees(bearings_rad) - layout.first_edge_deg
        return np.floor(off_deg / layout.sector_deg).astype(np.int64) % layout.sectors

    def _bounded(self, level: Floats, down: float, yaw_rate: float, own: Own, age_s: float) -> Velocity:  # noqa: ARG002
        s, speed = self.settings, float(level[0])
        if speed == 0.0:
            return (0.0, 0.0, 0.0), yaw_rate
        curvature = float(np.clip(yaw_rate / speed, -_STEERED, _STEERED))
        way_m = way_along_m(self._round(own), curvature, speed < 0.0, s)
        nose = rotated(own.q_ned_from_frd, (1.0, 0.0, 0.0))
        delay_s = age_s + s.reaction_s + s.goal_period_s  # from the scan to the motion that follows, at the latest
        own_speed = np.copysign(1.0, speed) * float(np.dot(nose, own.vel_ned))
        scale = min(1.0, braking_speed(way_m, own_speed, delay_s, s.brake) / abs(speed))
        self._count(NEAR_SOMETHING, level, scale * level)
        turns = yaw_rate if abs(speed) < _STANDS_M_S else scale * yaw_rate  # along the same arc, or on the spot
        return (scale * speed, 0.0, 0.0), turns

    def _turning(self, level: Floats, kept: Floats, scale: float) -> float:
        """As much as of the speed, so that the arc stays; on the spot, as much as the ranges are trusted."""
        wanted = float(np.hypot(*level))
        return float(np.hypot(*kept)) / wanted if wanted > 0.0 else scale

    def _round(self, own: Own) -> Floats:
        """What is solid, ahead and right of the vehicle [m]."""
        yaw = yaw_of(own.q_ned_from_frd)
        off = self._points - np.array(own.pos_ned[:2])
        cos, sine = np.cos(yaw), np.sin(yaw)
        return np.stack([off @ (cos, sine), off @ (-sine, cos)], -1)


def sectors_of(ranges: Ranges) -> tuple[Floats, Floats]:
    """Bearings of the sectors' middles from the nose [rad] and their ranges [m], of those that told something."""
    layout = ranges.layout
    bearings = np.radians(layout.first_edge_deg + layout.sector_deg * (np.arange(layout.sectors) + 0.5))
    return bearings[ranges.is_known], ranges.ranges_m[: layout.sectors][ranges.is_known].astype(np.float64)
