"""People who are not the owner, followed from image to image so that they are not taken for them.

In: sights of people, and where the owner is expected. Out: those that are not known to be somebody else's. Who is
seen is first matched with whom is expected nearest, the owner among them; looks count in it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies.companion.senses.looks import Looks, likeness
from policies.companion.senses.phone_check import PhoneFit, Suitor
from policies.companion.senses.poses import Pose
from policies.companion.senses.seen_owner import PersonNow, SeenOwner, Sight

Floats = NDArray[np.float64]
_MAX = 6
_NEAR_M = 1.0  # from where they are expected
_FORGOTTEN_US = 1_500_000
_APART_M = 0.6  # nearer to somebody, a second one is a part of them
_FAVOUR_M = 0.25  # so much farther off the owner is still the likelier
_LIKE_M = 0.2  # and who looks alike, for each logarithm
_LATELY_US = 600_000
_TOGETHER_US = 300_000  # who was there so long before the owner went is not the owner
_WALKS_M = 1.0
_SIGHTS, _WALK_M_S = 4, 0.7  # from so many on, faster than this, somebody is surely on their way
_OWNER = -1


Tracked = tuple[SeenOwner, PhoneFit]  # somebody, and how well they fit the phone


@dataclass(slots=True, eq=False)
class _Known:
    """One of them."""

    person: SeenOwner
    met_us: int  # when they were first seen,
    first_ned: Floats  # and where [m]
    fit: PhoneFit
    is_unsure: bool = False  # they may be the owner: nobody knows

    def likeness(self, sight: Sight) -> float:
        return likeness(Looks(sight.colours, 1), self.person.looks)


class OtherPeople:
    """Those round one vehicle."""

    def __init__(self) -> None:
        self._known: list[_Known] = []
        self._taken: list[Sight] = []  # of the newest image: of those whom it knows
        self.met_us: int | None = None
        """When one of them was seen last who walked: a trunk that the detector takes for somebody does not."""

    def left(
        self,
        sights: list[Sight],
        owner: Floats | None,
        likeness_of: list[float],
        pose: Pose,
        gone_us: float | None = None,
    ) -> list[int]:
        """Indices of the sights that may be of the owner: of nobody whom it knows; the others are taken in.

        Args:
            sights: of one image.
            owner: [m] where the owner is expected; None: nobody knows.
            likeness_of: each to the owner.
            pose: when and from where they were seen.
            gone_us: when the owner was seen last, if they are gone: who was met since may be the owner; -inf: anybody.
        """
        self._known = [one for one in self._known if pose.time_us - one.person.time_us < _FORGOTTEN_US]
        expected = {k: one.person.now(pose.time_us)[0] for k, one in enumerate(self._known)}
        if owner is not None:
            expected[_OWNER] = owner
        pairs = []
        for k, sight in enumerate(sights):
            for who, where in expected.items():
                off_m = sight.off_m(where) - (_FAVOUR_M if who == _OWNER else 0.0)
                alike = likeness_of[k] if who == _OWNER else self._known[who].likeness(sight)
                if off_m < _NEAR_M:
                    pairs.append((off_m - _LIKE_M * alike, k, who))
        taken: dict[int, int] = {}  # sight: who
        for _, k, who in sorted(pairs):
            if k not in taken and who not in taken.values():
                taken[k] = who
        for one in self._known:
            one.is_unsure = gone_us is not None and one.met_us >= gone_us - _TOGETHER_US
        for k, who in taken.items():
            if who == _OWNER:
                continue
            one = self._known[who]
            one.person.see(sights[k], pose)
            if not one.is_unsure and sights[k].off_m(one.first_ned) > _WALKS_M:
                self.met_us = pose.time_us
        known = {k for k, who in taken.items() if who != _OWNER and not self._known[who].is_unsure}
        self._taken = [sights[k] for k, who in taken.items() if who != _OWNER]
        return [k for k in range(len(sights)) if k not in known]

    def heard(self, time_us: int) -> list[Suitor]:
        """Those who were seen lately, in order, and how well they fit the phone."""
        return [Suitor(one.person.person_now(time_us), one.fit, one.person.looks) for one in self._lately(time_us)]

    def now(self, time_us: int, *, may_stand: bool = False) -> list[PersonNow]:
        """What is known of those who were seen lately and walk: whom a trunk is taken for does not.

        Args:
            time_us: the vehicle's clock.
            may_stand: they need not walk.
        """
        known = [one.person.person_now(time_us) for one in self._lately(time_us) if one.person.sights >= _SIGHTS]
        return [person for person in known if may_stand or float(np.hypot(*person.vel)) > _WALK_M_S]

    def exchange(self, index: int, owner: Tracked | None, time_us: int) -> Tracked:
        """One of those who were heard is the owner, who was taken for the owner is another; the owner."""
        one = self._lately(time_us)[index]
        self._known.remove(one)
        if owner is not None:
            self.add(*owner, time_us)
        return one.person, one.fit

    def add(self, person: SeenOwner, fit: PhoneFit, time_us: int) -> None:
        """Who was taken for the owner is another."""
        self.met_us = time_us
        self._known.append(_Known(person, time_us, person.now(time_us)[0], fit))

    def _lately(self, time_us: int) -> list[_Known]:
        return [one for one in self._known if time_us - one.person.time_us < _LATELY_US]

    def meet(self, sights: list[Sight], owner: Floats | None, pose: Pose) -> None:
        """Each of these is somebody new, but for what may be a part of the owner or of who is known."""
        if owner is not None:  # who may have been the owner is
            self._known = [one for one in self._known if not (one.is_unsure and _is_beside(one, owner, pose))]
        known = [one.person.now(pose.time_us)[0] for one in self._known]
        for sight in sights:
            beside = [*known, *([owner] if owner is not None else [])]
            is_known = any(sight is taken for taken in self._taken) or len(self._known) >= _MAX
            if is_known or any(sight.off_m(other) < _APART_M for other in beside):
                continue
            one = _Known(SeenOwner(), pose.time_us, sight.place_ned, PhoneFit())
            one.person.see(sight, pose)
            self._known.append(one)


def _is_beside(one: _Known, place: Floats, pose: Pose) -> bool:
    return float(np.hypot(*(one.person.now(pose.time_us)[0] - place)[:2])) < _NEAR_M
