"""Who is seen, where, and what stands around: the senses of a guard, and of policies that look at no image.

In: images, telemetry, the phone's reports. Out: the owner's place and velocity by sights alone, the track of sights and
phone together, since when the owner has not been seen, and a level map of what is solid. The owner is whom the
detector sees where they are expected; farther off, and after a while without them, only who is there in several images
in a row, and where others were met lately only whom phone and looks say.
"""

from dataclasses import replace
from math import dist, inf, isfinite

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, inverse, quat_of, rotated, yaw_of
from common.image_stream import ImageFrame
from policies.companion.owner_watch import OwnerWatch, sighting_from
from policies.companion.senses.local_map import LocalMap, has_depth
from policies.companion.senses.looks import UNLIKE
from policies.companion.senses.other_people import OtherPeople
from policies.companion.senses.phone_check import PhoneCheck, PhoneFit, Suitor, Word
from policies.companion.senses.poses import Pose, PoseHistory
from policies.companion.senses.seen_owner import PersonNow, SeenOwner, Sight
from policies.companion.telemetry import Own, Owner
from policies.mono_depth.network import MonoDepth
from policies.person_detector.detector import SURE, Detection, PersonDetector
from policies.tasks.follow_me.observe import REPORT_LAG_S

Floats = NDArray[np.float64]
PHONE_OLD_S = 3.0
_CHEST_M = 1.0  # above the ground,
_GROUND_US = 2_000_000  # which is where the range finder saw the lowest of so long,
_GROUND_M = 1.0  # and so near: hills rise; guesses
_GATE_M = 1.0  # from where the owner is expected by sights; who is farther off is somebody else,
_GATE_M_S = 2.5  # and wider by so much with each second without a sight,
_GATE_MAX_M = 8.0
_PHONE_GATE_M = 4.0  # at least, where they are expected by phone alone
_COLOUR_GATE = 0.4  # and by this fraction of the range without depth
_GONE_S = 1.0  # after so long without a sight
_DOUBTED_US = 5_000_000  # for so long at least who turned out to be another was not the owner: it is searched at once
_MET_US = 20_000_000  # so long ago somebody else was there not long ago
_STRANGE_S = 4.0  # and after so long anybody may be them
_NEW_US = 1_000_000  # after so long with somebody in sight they are the owner, if nobody was so before
_IN_A_ROW = 4  # as many images must show them, one beside the other
_IN_A_ROW_ASTRAY = 2  # or as many, who is in sight too far from where they are expected
_BESIDE_M = 1.0
_ROW_US = 350_000  # and with no more than this between two
_RISEN_M = 1.0  # until it is so high the map would take the ground for solid,
_DOWN_M = 0.6  # and again once it is as low as this, before the ground comes into the slice that it flies through


class Senses:
    """Of one vehicle.

    Args:
        hears: the phone counts.
        detector: of people; None: the one that ships.
    """

    def __init__(self, *, hears: bool = True, detector: PersonDetector | None = None) -> None:
        self._detector = detector or PersonDetector()
        self._mono_depth = MonoDepth()
        self._hears = hears
        self.watch = OwnerWatch(hears=hears)
        """Where the owner is, by sights and phone."""
        self._reports = 0
        self._forget()

    def _forget(self) -> None:
        """The vehicle's clock and frame begin anew."""
        self._boot_us = 0
        self.poses = PoseHistory()
        """Where the vehicle was in the last seconds."""
        self.map = LocalMap()
        self._grounds: list[tuple[int, Vector]] = []  # when and where [m] the range finder saw something
        self._is_up = True  # until a range says otherwise
        self._is_by_colours = False  # the newest image had no depth: who stands in it is on no map
        self.seen = SeenOwner()
        self.seen_us: int | None = None
        """When the newest image with the owner was taken, on the vehicle's clock."""
        self.image_us = 0
        """When the newest image was taken."""
        self.heard_us: int | None = None
        self._first_us: int | None = None  # when the first image with somebody in it was taken
        self._row: list[tuple[int, Floats]] = []  # when and where who may be the owner was in the last images
        self._others = OtherPeople()
        self._phone = PhoneCheck()
        self._fit = PhoneFit()  # of who is taken for the owner
        self._phone_us = 0  # of the last report
        self._phone_ned: Floats | None = None  # where it puts the owner, its error taken off

    def sense(self, own: Own, owner: Owner, image: ImageFrame | None) -> None:
        """Takes in telemetry, the phone's reports, and a new image if there is one."""
        if own.boot_us < self._boot_us:  # it has restarted: what was seen before was at no time that it knows
            self._forget()
        self._boot_us = own.boot_us
        self.poses.note(own)
        self._grounds = [known for known in self._grounds if own.boot_us - known[0] < _GROUND_US]
        if isfinite(ground := own.pos_ned[2] + own.height_m):
            self._grounds.append((own.boot_us, (*own.pos_ned[:2], ground)))
        if owner.count != self._reports:
            self._reports, self.heard_us = owner.count, own.boot_us
            self._check(own, owner)
        if image is None or not isfinite(own.pos_ned[0]):
            return
        pose = self.poses.at(image.time_us)
        if pose is None:
            return
        self.image_us = image.time_us
        down = rotated(inverse(pose.q_ned_from_frd), (0.0, 0.0, 1.0))
        pixels, by_colours = image.pixels, None
        if not has_depth(pixels[..., 3]):
            by_colours = self._mono_depth.see(pixels, down, own.range_m * down[2])
            pixels = np.concatenate([pixels[..., :3], by_colours.depth[..., None]], -1)
        self._is_by_colours = by_colours is not None
        found = self._detector.find(pixels, (down[0], down[1]))
        if by_colours is not None:
            found = [replace(detection, has_depth=False) for detection in found]
        found = [detection for detection in found if detection.probability >= SURE]
        seen = self._owner_among(found, pose)
        sighting = None if seen is None else sighting_from(seen.chest_hfrd, pose.pos_ned, pose.q_ned_from_frd)
        self.watch.take(image.time_us, own.boot_us, owner, sighting)
        if seen is not None:
            if self.silence_s(own) > _GONE_S:  # found again, or for the first time: who it is the phone has yet to say
                self._fit = PhoneFit()
            self.seen_us = image.time_us
            sight = _sight(seen, pose)
            place = sight.place_ned
            self.seen.see(sight, pose)
        if isfinite(own.height_m):
            self._is_up = own.height_m > (_DOWN_M if self._is_up else _RISEN_M)
        if not self._is_up:
            return
        owner_then = self._owner_then(image.time_us, own)
        if by_colours is None:
            self.map.see(image.pixels[..., 3], pose, owner_then, own.boot_us)
        else:
            self.map.guess(by_colours, pose, owner_then, own.boot_us)
            if seen is not None:
                self.map.sight(pose, place, own.boot_us)

    def _check(self, own: Own, owner: Owner) -> None:
        """Asks a new report whether the owner is whom it takes for them."""
        if not self._hears or not isfinite(own.pos_ned[0]):
            return
        phone_vel = np.array(owner.vel_ned[:2])
        phone = np.array(owner.pos_ned[:2]) + REPORT_LAG_S * phone_vel
        since_s, self._phone_us = max(own.boot_us - self._phone_us, 0) * 1e-6, own.boot_us
        is_seen = self.silence_s(own) <= _GONE_S
        word, index = self._phone.hear(
            phone,
            phone_vel if owner.has_velocity else None,
            min(since_s, PHONE_OLD_S),
            Suitor(self.seen.person_now(own.boot_us), self._fit, self.seen.looks) if is_seen else None,
            self._others.heard(own.boot_us),
            has_met_others=self.has_met_others,
        )
        expected = self._phone.owner(phone)
        self._phone_ned = None if expected is None else np.array([*expected, owner.pos_ned[2]])
        if word is Word.AGREES:
            return
        former = (self.seen, self._fit) if is_seen else None
        if word is Word.ANOTHER:
            self.seen, self._fit = self._others.exchange(index, former, own.boot_us)
            self.seen_us = self.seen.time_us
        elif former is not None:
            self._others.add(*former, own.boot_us)
            self.seen_us, self.seen, self._fit = own.boot_us - _DOUBTED_US, SeenOwner(), PhoneFit()
        self.watch.forget()

    @property
    def has_met_others(self) -> bool:
        """Some were there not long ago, and may have been taken for the owner."""
        met_us = self._others.met_us
        return met_us is not None and self._boot_us - met_us < _MET_US

    def silence_s(self, own: Own) -> float:
        """Since the owner was seen."""
        return inf if self.seen_us is None else max(own.boot_us - self.seen_us, 0) * 1e-6

    @property
    def is_heard(self) -> bool:
        """The phone has spoken not long ago."""
        return self._hears and self.heard_us is not None and self._boot_us - self.heard_us < PHONE_OLD_S * 1e6

    def owner_now(self, own: Own) -> PersonNow | None:
        """Where the owner is: by sights, or if those are old by the phone too; None: nobody knows.

        Who is not seen stands on the ground below the vehicle, where a range finder shows that: a phone's height is
        metres off. It may show a head, and so the lowest about here in the last seconds counts.
        """
        silence_s = self.silence_s(own)
        if silence_s < _GONE_S:
            return self.seen.person_now(own.boot_us)
        track = self.watch.track
        if track is None or not track.is_known:
            return None
        place = track.pos_ned + max(own.boot_us - track.time_us, 0) * 1e-6 * track.vel_ned
        below = [there[2] for _, there in self._grounds if dist(there[:2], own.pos_ned[:2]) < _GROUND_M]
        if below or isfinite(own.carried_height_m):
            place[2] = max(below, default=own.pos_ned[2] + own.carried_height_m) - _CHEST_M
        return PersonNow(place, track.pos_cov[:2, :2], track.vel_ned[:2], track.vel_cov[:2, :2], silence_s)

    def others_now(self, own: Own) -> list[PersonNow]:
        """Where people are who were seen and not taken for the owner: one of them may be."""
        return self._others.now(own.boot_us, may_stand=self._is_by_colours)

    def _owner_then(self, time_us: int, own: Own) -> tuple[Floats, Floats] | None:
        """Where the owner was when an image was taken, and how fast; None: nobody knows."""
        if self.silence_s(own) < _GONE_S:
            return self.seen.now(time_us)
        track = self.watch.track
        if track is None or self.silence_s(own) >= PHONE_OLD_S:
            return None
        return track.pos_ned + (time_us - track.time_us) * 1e-6 * track.vel_ned, track.vel_ned

    def _owner_among(self, found: list[Detection], pose: Pose) -> Detection | None:
        """Who of them is the owner: the one nearest to where they are expected, if any is near enough."""
        silence_s = max(pose.time_us - self.seen_us, 0) * 1e-6 if self.seen_us is not None else inf
        is_gone = silence_s > _GONE_S
        expected, gate_m = self._expected(pose.time_us, silence_s)
        sights = [_sight(detection, pose) for detection in found]
        has_met_others = self.has_met_others
        alike = [self._phone.likeness(sight.colours) if has_met_others else 0.0 for sight in sights]
        if is_gone and self.is_heard and has_met_others:  # the phone says who of them it is
            new = [sights[k] for k in self._others.left(sights, None, alike, pose)]
            self._others.meet(new, None, pose)
            self._row = []
            return None
        gone_us: float | None = self.seen_us if is_gone else None
        if silence_s > _STRANGE_S:  # or nobody was the owner before: anybody may be
            gone_us = -inf
        left = self._others.left(sights, None if is_gone else expected, alike, pose, gone_us)
        may_be = [k for k in left if alike[k] > UNLIKE]
        best = self._nearest(found, sights, may_be, expected, gate_m) if may_be else None
        is_astray = best is None or self._is_astray(found[best], sights[best], expected)
        if is_astray and not is_gone:
            in_row = self._next_in_row(sights, may_be, pose.time_us)
            best = best if in_row is None else in_row
        asked = _IN_A_ROW if is_gone else _IN_A_ROW_ASTRAY if is_astray else 1
        is_owner = best is not None and self._is_there_to_stay(sights[best].place_ned, pose.time_us, asked)
        if best is None:
            self._row = []
        is_met = is_gone and not is_owner  # who may be the owner is kept off, too
        strangers = [sights[k] for k in left if k != best or is_met]
        self._others.meet(strangers, None if best is None or is_met else sights[best].place_ned, pose)
        return found[best] if best is not None and is_owner else None

    @staticmethod
    def _is_astray(one: Detection, sight: Sight, expected: Floats | None) -> bool:
        """Whether somebody is so far from where the owner is expected that one image is not enough."""
        if expected is None:
            return False
        return sight.off_m(expected) > _widened(_GATE_M, one)

    @staticmethod
    def _nearest(
        found: list[Detection], sights: list[Sight], may_be: list[int], expected: Floats | None, gate_m: float
    ) -> int | None:
        """Who of some is nearest to where the owner is expected, if near enough; if nobody knows, to the vehicle."""
        far_m = {k: float(np.hypot(*found[k].chest_hfrd[:2])) for k in may_be}
        off_m = far_m if expected is None else {k: sights[k].off_m(expected) for k in may_be}
        best = min(may_be, key=off_m.__getitem__)
        return best if expected is None or off_m[best] <= _widened(gate_m, found[best]) else None

    def _expected(self, time_us: int, silence_s: float) -> tuple[Floats | None, float]:
        """Where the owner is expected in an image, and how far off they may be; who was never seen may be anywhere."""
        if self._first_us is None:
            self._first_us = time_us
        gate_m = min(_GATE_M + _GATE_M_S * silence_s, _GATE_MAX_M)
        if silence_s <= _GONE_S:
            return self.seen.now(time_us)[0], gate_m
        if not self.is_heard and self.seen.sights:  # nobody says where they have gone since: as far as they could
            return self.seen.now(time_us)[0], _GATE_M + _GATE_M_S * silence_s
        track = self.watch.track
        if self._phone_ned is not None and self.is_heard and self._others.met_us is not None:
            return self._phone_ned, max(gate_m if isfinite(silence_s) else 0.0, _PHONE_GATE_M)
        if track is None or not track.is_known:
            return None, gate_m
        if self.seen_us is None and time_us - self._first_us > _NEW_US:
            return track.pos_ned, inf
        doubt_m = 2.5 * float(np.sqrt(max(np.trace(track.pos_cov[:2, :2]), 0.0)))
        expected = track.pos_ned + (time_us - track.time_us) * 1e-6 * track.vel_ned
        return expected, max(gate_m, _PHONE_GATE_M, min(doubt_m, 3.0 * _PHONE_GATE_M))

    def _is_next(self, place: Floats, time_us: int) -> bool:
        """Whether who is in a place may be who was in the row's last image."""
        if not self._row:
            return False
        last_us, last = self._row[-1]
        return time_us - last_us <= _ROW_US and float(np.hypot(*(place - last)[:2])) <= _BESIDE_M

    def _next_in_row(self, sights: list[Sight], may_be: list[int], time_us: int) -> int | None:
        """Who of some stands nearest to where who may be the owner was in the image before, if near enough."""
        nexts = [k for k in may_be if self._is_next(sights[k].place_ned, time_us)]
        return min(nexts, key=lambda k: sights[k].off_m(self._row[-1][1]), default=None)

    def _is_there_to_stay(self, place: Floats, time_us: int, images: int) -> bool:
        """Whether somebody was there in so many images in a row, this one included."""
        if not self._is_next(place, time_us):
            self._row = []
        self._row = [*self._row[-(_IN_A_ROW - 1) :], (time_us, place)]
        return len(self._row) >= images


def _widened(gate_m: float, one: Detection) -> float:
    """How far off somebody may be, their range told from colours alone or measured."""
    return gate_m if one.has_depth else gate_m + _COLOUR_GATE * float(np.hypot(*one.chest_hfrd[:2]))


def _sight(detection: Detection, pose: Pose) -> Sight:
    return Sight(ned_of(detection.chest_hfrd, pose), detection.has_depth, detection.colours)


def ned_of(chest_hfrd: Vector, pose: Pose) -> Floats:
    """A place ahead, right and down of the vehicle at a pose."""
    level = quat_of(yaw_of(pose.q_ned_from_frd), 0.0)
    return np.asarray(np.array(pose.pos_ned) + np.array(rotated(level, chest_hfrd)))
