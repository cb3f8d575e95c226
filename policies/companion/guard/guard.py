"""The guard under a policy that follows: what it wants is flown as far as evidence that is not the policy's allows.

In: pictures, telemetry, the phone's reports, and the velocity that the policy asks for. Out: the velocity that is
flown, the stance, and what was done how often. The owner is where a detector of its own sees them and a tracker
expects them; what is solid, where depth shows it. Graded: slower, stop, search, and at last the end.
"""

from collections import Counter
from enum import Enum
from math import atan2, inf, isfinite

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, inverse, quat_of, rotated, wrapped, yaw_of
from common.image_stream import ImageFrame
from policies.companion.guard.limits import faded, kept_off, stopping_speed, within_room
from policies.companion.guard.local_map import LocalMap
from policies.companion.guard.poses import Pose, PoseHistory
from policies.companion.guard.settings import GuardSettings
from policies.companion.owner_watch import OwnerWatch, sighting_from
from policies.companion.skills.skill import Velocity
from policies.companion.vehicle_link import Own, Owner
from policies.person_detector.detector import Detection, PersonDetector

Floats = NDArray[np.float64]
_FACE_GAIN = 1.5  # [1/s] from a bearing to a yaw rate
_YAW_MAX = 1.5  # [rad/s]
_COUNTED_M_S = 0.3  # less than this off what was wanted is no intervention
_CLIMB_M_S = 1.0
_PHONE_OLD_S = 3.0
_GATE_M = 3.0  # from where the tracker expects the owner; who is farther off is somebody else
_GATE_M_S = 2.5  # and wider by so much with each second without a sight


class Stance(Enum):
    """How far the policy is trusted."""

    FREE = "following"
    SLOW = "slower: the owner is not seen"
    STOP = "holding: the owner is not seen"
    SEARCH = "searching the owner"
    BLIND = "holding: old pictures"


class Guard:
    """Over one vehicle.

    Args:
        settings: what it allows.
        hears: the phone counts.
        detector: of people; None: the one that ships.
    """

    def __init__(self, settings: GuardSettings, *, hears: bool = True, detector: PersonDetector | None = None) -> None:
        self.settings = settings
        self.stance = Stance.FREE
        self.interventions: Counter[str] = Counter()
        """How many decisions were changed, by the reason."""
        self._detector = detector or PersonDetector()
        self._watch = OwnerWatch(hears=hears)
        self._reports = 0
        self._forget()

    def _forget(self) -> None:
        """The vehicle's clock and frame begin anew."""
        self._boot_us = self._begun_us = 0  # the newest, of the vehicle's clock; and when the policy took over
        self._poses = PoseHistory()
        self._map = LocalMap()
        self._seen_us: int | None = None  # when the newest picture with the owner was taken, the vehicle's clock
        self._image_us = 0  # when the newest picture was taken
        self._heard_us: int | None = None  # on the vehicle's clock
        self._bearing_rad = 0.0  # in ned, where the owner was seen last
        self._way = np.zeros(2)  # unit, to where the owner is now
        self._is_pressed = self._is_too_near = False

    def begin(self, own: Own) -> None:
        """The policy takes over."""
        self.stance = Stance.FREE
        self._begun_us = own.boot_us

    def is_lost(self, own: Own) -> bool:
        """Whether the owner was not seen for so long that it is the end; who has just begun may look for them first."""
        searched_s = max(own.boot_us - self._begun_us, 0) * 1e-6
        return min(self.silence_s(own), searched_s) > self.settings.lost_s

    @property
    def watch(self) -> OwnerWatch:
        """Where the owner is."""
        return self._watch

    def sense(self, own: Own, owner: Owner, image: ImageFrame | None) -> None:
        """Takes in telemetry, the phone's reports, and a new picture if there is one."""
        if own.boot_us < self._boot_us:  # it has restarted: what was seen before was at no time that it knows
            self._forget()
        self._boot_us = own.boot_us
        self._poses.note(own)
        if owner.count != self._reports:
            self._reports, self._heard_us = owner.count, own.boot_us
        if image is None or not isfinite(own.pos_ned[0]):
            return
        pose = self._poses.at(image.time_us)
        if pose is None:
            return
        self._image_us = image.time_us
        down = rotated(inverse(pose.q_ned_from_frd), (0.0, 0.0, 1.0))
        seen = self._owner_among(self._detector.find(image.pixels, (down[0], down[1])), pose, own)
        sighting = None if seen is None else sighting_from(seen.chest_hfrd, pose.pos_ned, pose.q_ned_from_frd)
        is_taken = self._watch.take(image.time_us, own.boot_us, owner, sighting)
        if seen is not None and is_taken:
            self._seen_us = image.time_us
            north, east, _ = _ned_of(seen.chest_hfrd, pose)
            self._bearing_rad = atan2(east - pose.pos_ned[1], north - pose.pos_ned[0])
        track = self._watch.track
        owner_ned = None
        if track is not None and self.silence_s(own) < _PHONE_OLD_S:  # where they were when it was taken
            owner_ned = tuple((track.pos_ned + (image.time_us - track.time_us) * 1e-6 * track.vel_ned).tolist())
        self._map.see(image.pixels, pose, owner_ned, own.boot_us)

    def silence_s(self, own: Own) -> float:
        """Since the owner was seen."""
        return inf if self._seen_us is None else max(own.boot_us - self._seen_us, 0) * 1e-6

    def filtered(self, wanted: Velocity, own: Own) -> Velocity:
        """What is flown of a velocity in ned and a yaw rate that a policy asks for."""
        s, (velocity, yaw_rate) = self.settings, wanted
        age_s = max(own.boot_us - self._image_us, 0) * 1e-6
        silence_s = self.silence_s(own)
        self.stance = self._stance(silence_s, age_s)
        level = np.array(velocity[:2])
        down = velocity[2]
        if self.stance in (Stance.SEARCH, Stance.STOP):
            level, down, yaw_rate = self._searched(own, self.stance is Stance.SEARCH)
            self.interventions[self.stance.value] += 1
        elif self.stance is not Stance.FREE:
            scale = faded(silence_s, s.slow_s, s.stop_s) * faded(age_s, s.image_slow_s, s.image_stop_s)
            level, down = scale * level, scale * down
            self.interventions[self.stance.value] += 1
        delay_s = s.reaction_s + age_s
        level = self._past_owner(level, own, s.reaction_s)
        level = self._past_solids(level, own, delay_s)
        down = self._within_heights(down, own)
        return (float(level[0]), float(level[1]), float(down)), yaw_rate

    def _stance(self, silence_s: float, age_s: float) -> Stance:
        s = self.settings
        if age_s > s.image_stop_s:
            return Stance.BLIND
        if silence_s > s.search_s or (self.stance is Stance.SEARCH and silence_s > s.slow_s):
            return Stance.SEARCH
        if silence_s > s.stop_s:
            return Stance.STOP
        return Stance.SLOW if silence_s > s.slow_s or age_s > s.image_slow_s else Stance.FREE

    def _searched(self, own: Own, is_searching: bool) -> tuple[Floats, float, float]:
        """Up, out of people's way; towards the phone, no nearer than a stand-off; without one a turn on the spot."""
        s = self.settings
        down = -_CLIMB_M_S * float(np.clip(2.0 * (s.search_height_m - own.range_m), -0.5, 1.0))
        down = down if isfinite(own.range_m) else 0.0
        track = self._watch.track
        is_heard = self._heard_us is not None and own.boot_us - self._heard_us < _PHONE_OLD_S * 1e6
        if is_heard and track is not None and track.is_known:
            way = np.array(track.pos_ned[:2]) - np.array(own.pos_ned[:2])
            far_m = float(np.hypot(*way))
            yaw_rate = self._facing(atan2(way[1], way[0]), own)
            if not is_searching or far_m < 0.1:
                return np.zeros(2), down, yaw_rate
            speed = min(stopping_speed(far_m - s.search_stand_off_m, s.reaction_s, 1.0), s.search_speed)
            return speed * way / far_m, down, yaw_rate
        if is_searching:
            return np.zeros(2), down, s.search_yaw_rate
        return np.zeros(2), down, self._facing(self._bearing_rad, own)

    def _facing(self, bearing_rad: float, own: Own) -> float:
        error = wrapped(bearing_rad - yaw_of(own.q_ned_from_frd))
        return float(np.clip(_FACE_GAIN * error, -_YAW_MAX, _YAW_MAX))

    def _past_owner(self, level: Floats, own: Own, delay_s: float) -> Floats:
        track = self._watch.track
        self._is_pressed = self._is_too_near = False
        if track is None or not track.is_known:
            return level
        ahead_s = max(own.boot_us - track.time_us, 0) * 1e-6
        place = track.pos_ned + ahead_s * track.vel_ned
        way = np.array(place[:2]) - np.array(own.pos_ned[:2])
        vel = np.array(track.vel_ned[:2])
        far_m = float(np.hypot(*way))
        self._way = way / max(far_m, 1e-3)
        own_vel = np.array(own.vel_ned[:2])
        coming_m_s = float((own_vel - vel) @ self._way)
        self._is_pressed = far_m - delay_s * max(coming_m_s, 0.0) < self.settings.pressed_m
        self._is_too_near = far_m - delay_s * max(coming_m_s, 0.0) < self.settings.owner_m
        kept = kept_off(level, way, own_vel, vel, delay_s, self.settings)
        self._count("near the owner", level, kept)
        return kept

    def _past_solids(self, level: Floats, own: Own, delay_s: float) -> Floats:
        s = self.settings
        if not self._map.has_depth:
            speed = float(np.hypot(*level))
            kept = level * min(1.0, s.no_depth_speed / max(speed, 1e-6))
            self._count("no depth", level, kept)
            return np.asarray(kept)
        free_m, known_m = self._map.clear_m(own.pos_ned, own.boot_us)
        if self._is_pressed:  # back into what is not seen rather than wait for who comes
            free_m = np.where(self._map.units @ self._way < 0.0, known_m, free_m)
        kept = within_room(level, self._map.units, free_m, known_m, delay_s, s)
        self._count("near something", level, kept)
        return kept

    def _within_heights(self, down: float, own: Own) -> float:
        s = self.settings
        if self._is_too_near and not own.range_m > s.height_max_m:
            self.interventions["over the owner"] += 1
            return -s.escape_climb
        if not isfinite(own.range_m):
            return max(down, 0.0)
        if own.range_m < s.height_min_m:
            return min(down, -0.5 * _CLIMB_M_S)
        if own.range_m > s.height_max_m:
            return max(down, 0.0)
        return min(down, stopping_speed(own.range_m - s.height_min_m, s.reaction_s, _CLIMB_M_S))

    def _count(self, why: str, wanted: Floats, kept: Floats) -> None:
        if float(np.hypot(*(wanted - kept))) > _COUNTED_M_S:
            self.interventions[why] += 1

    def _owner_among(self, found: list[Detection], pose: Pose, own: Own) -> Detection | None:
        """Who of them is the owner: the one nearest to where they are expected, if any is near enough."""
        sure = [detection for detection in found if detection.probability >= self.settings.sure]
        track = self._watch.track
        if not sure:
            return None
        if track is None or not track.is_known:
            return min(sure, key=lambda detection: np.hypot(*detection.chest_hfrd[:2]))
        expected = track.pos_ned + (pose.time_us - track.time_us) * 1e-6 * track.vel_ned

        def off_m(detection: Detection) -> float:
            place = _ned_of(detection.chest_hfrd, pose)
            return float(np.hypot(place[0] - expected[0], place[1] - expected[1]))

        best = min(sure, key=off_m)
        gate_m = _GATE_M + _GATE_M_S * min(self.silence_s(own), 10.0)
        return best if off_m(best) < gate_m else None


def _ned_of(chest_hfrd: Vector, pose: Pose) -> Floats:
    """A place ahead, right and down of the vehicle at a pose."""
    level = quat_of(yaw_of(pose.q_ned_from_frd), 0.0)
    return np.asarray(np.array(pose.pos_ned) + np.array(rotated(level, chest_hfrd)))
