"""Whether the owner is whom is taken for them: the phone's reports, and looks, against everybody who is seen.

In: each report, and where everybody is and goes. Out: who else it would rather be, or that it is none of them. Who
has the phone goes as it says, and is off from where it says by an error that changes slowly. How much likelier each
report is of a person than of somebody unseen is summed up for each (a logarithm of likelihood ratios), up to a bound,
so that old reports are outweighed in seconds, and compared; how they look beside the owner counts too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import log

import numpy as np
from numpy.typing import NDArray

from policies.companion.senses.looks import UNLIKE, Looks, likeness
from policies.companion.senses.seen_owner import PersonNow

Floats = NDArray[np.float64]
OFF_STD_M = 1.7  # of the phone's slow error in the vehicle's frame, as the tracker takes it
_DRIFT_M2_S = 2.0 * OFF_STD_M**2 / 60.0  # what its variance grows by
_PLACE_VAR = 0.3**2 + 0.2**2  # [m²] white, of the phone, and of bodies beside their middles
_VEL_VAR = 0.2**2 + 0.2**2  # [m²/s²] of the phone, and of what somebody changes while a report is under way
_PRIOR_VAR = 1.0  # [m²] how much another's error may differ from what has been learned
_CHANGED_VAR, _CHANGED_MAX = 1.5, 4.0  # [m²] of a change of that error, and the most that speaks against one
_WHOLE_S = 0.5  # a report that comes sooner after the last counts as much less: their errors are alike
_LOSS_MAX = 4.5  # of one report: somebody who turns round does not go as it says
_ANY_VEL_VAR = 1.0  # [m²/s²] each axis: how somebody who is not seen may go beside who is
_PLACE, _PLACE_ALONE = 1.5, 3.5  # likelihood that a place which fits gains, with a velocity and without
_SURE = 3.0  # log likelihood ratio that counts,
_SURE_ALONE = 9.0  # and where nobody else was seen
_FITS = 3.0  # from which an unknown one is the owner,
_PATIENT_S, _FITS_LATER = 2.0, 0.5  # less by so much a second later: they are looked for where the phone says;
_FITS_LEAST = 2.0
_MOST = 10.0  # either way: somebody may be taken for another at any time;
_LEAST = 4.0  # and against somebody else: they may turn out to be the owner soon
_HEARD = 2  # after so many reports
_KNOWN = 8  # after so many the phone's noise is
_NEXT_S = 1.6  # a report that comes later than this is not the next
_STEADY = 0.1  # of each report: how soon a worse phone is noticed
_ALIKE = 0.5  # likeness of who looks the same
_CERTAIN = 6.0  # of reports, from which what somebody wears is what the owner wears
_WEARS = 20  # reports, over which it is learned what the owner wears


class Word(Enum):
    """What the phone says."""

    AGREES = 0
    ANOTHER = 1  # it is somebody else of those seen
    NOBODY = 2  # it is none of them


@dataclass(slots=True)
class PhoneNoise:
    """By how much more than usual a phone's squares are, learned from what changes between one report and the next.

    Whoever goes another way is farther off with each report, but by little: a wrong person is not taken for noise.
    """

    place: float = 1.0
    vel: float = 1.0
    steps: int = 0

    def learn(self, place_step: Floats, vel_step: Floats | None) -> None:
        """Takes in what the differences between phone and owner have changed by."""
        self.steps += 1
        gain = max(_STEADY, 1.0 / (1.0 + self.steps))
        self.place = _learnt(self.place, gain, place_step, _PLACE_VAR)
        if vel_step is not None:
            self.vel = _learnt(self.vel, gain, vel_step, _VEL_VAR)


def _learnt(scale: float, gain: float, step: Floats, var: float) -> float:
    return max(scale + gain * (float(step @ step) / (4.0 * var) - scale), 1.0)


@dataclass(slots=True)
class PhoneFit:
    """How well one person fits the phone."""

    off: Floats | None = None
    """[m] The phone's slow error, if it is theirs; None before the first report."""
    var: float = 0.0
    """[m²] of it, each axis."""
    odds: float = 0.0
    """Logarithm of how much likelier it is theirs than of nobody who is seen, by all reports."""
    reports: int = 0
    apart: Floats | None = None
    """[m] Of the last report, from them."""
    apart_vel: Floats | None = None

    def hear(self, phone: Floats, phone_vel: Floats | None, who: PersonNow, since_s: float, usual: "Usual") -> None:
        """Takes in a report.

        Args:
            phone: [m] where it puts its owner now, north and east.
            phone_vel: [m/s] likewise; None: it does not say.
            who: the person as of now.
            since_s: the last report.
            usual: of the phone.
        """
        noise = usual.noise
        self.apart = phone - who.pos_ned[:2]
        self.apart_vel = None if phone_vel is None else phone_vel - who.vel
        if self.off is None:
            self.off, self.var = usual.prior(self.apart)
        self.var += _DRIFT_M2_S * noise.place * since_s
        usual_var = noise.place * _PLACE_VAR + 0.5 * float(np.trace(who.pos_var))
        place_var = self.var + usual_var
        astray = self.apart - self.off
        gained = -0.5 * float(astray @ astray) / place_var - log(place_var / usual_var)
        if self.apart_vel is None:
            gained += _PLACE_ALONE
        else:
            vel_var = noise.vel * _VEL_VAR + 0.5 * float(np.trace(who.vel_var))
            any_var = vel_var + _ANY_VEL_VAR
            apart2 = float(self.apart_vel @ self.apart_vel)
            gained += _PLACE + log(any_var / vel_var) - 0.5 * apart2 * (1.0 / vel_var - 1.0 / any_var)
        self.odds += min(since_s / _WHOLE_S, 1.0) * max(gained, -_LOSS_MAX)
        self.reports += 1
        gain = self.var / place_var
        self.off = self.off + gain * astray
        self.var *= 1.0 - gain

    def forget(self) -> None:
        """What was heard was of somebody else too."""
        self.off, self.var, self.odds, self.reports, self.apart, self.apart_vel = None, 0.0, 0.0, 0, None, None


@dataclass(frozen=True, slots=True, eq=False)
class Suitor:
    """Somebody who may be the owner."""

    now: PersonNow
    fit: PhoneFit
    looks: Looks = field(default_factory=Looks)


@dataclass(slots=True)
class Usual:
    """What is known of the owner and their phone."""

    noise: PhoneNoise = field(default_factory=PhoneNoise)
    off: Floats | None = None
    """[m] Its slow error, level, of who was surely the owner; None: not known yet."""
    looks: Looks = field(default_factory=Looks)
    """Of who was surely the owner."""

    def prior(self, apart: Floats) -> tuple[Floats, float]:
        """What error is expected of somebody new, so far from the phone: as known, or if that is far off, any."""
        anything = np.zeros(2), self.noise.place * OFF_STD_M**2
        if self.off is None:
            return anything
        known = self.off.copy(), self.noise.place * _PRIOR_VAR
        return min((known, anything), key=lambda one: float((apart - one[0]) @ (apart - one[0])) / one[1])

    def odds(self, who: Suitor) -> float:
        """Of somebody, by reports and looks."""
        return self.heard(who.fit) + likeness(who.looks, self.looks)

    def heard(self, fit: PhoneFit) -> float:
        """By reports, less what speaks against so sudden a change of the phone's error."""
        if self.off is None or fit.off is None:
            return fit.odds
        changed = fit.off - self.off
        return fit.odds - min(0.5 * float(changed @ changed) / (self.noise.place * _CHANGED_VAR), _CHANGED_MAX)

    def doubt(self, owner: Suitor) -> None:
        """The owner is found by reports; who looks otherwise than they was somebody else."""
        if likeness(owner.looks, self.looks) < 0.0:
            self.looks = Looks()

    def learn(self, owner: Suitor) -> None:
        """Takes in who is the owner."""
        if owner.fit.off is not None:
            self.off = owner.fit.off.copy()
        if self.heard(owner.fit) > _CERTAIN:
            self.looks.see(owner.looks.mean, _WEARS)


class PhoneCheck:
    """Of one owner."""

    def __init__(self) -> None:
        self._usual = Usual()
        self._alone_s = 0.0  # without an owner

    def owner(self, phone: Floats) -> Floats | None:
        """Where a report puts the owner, level [m]; None: its error is not known yet."""
        return None if self._usual.off is None else phone[:2] - self._usual.off

    def hear(
        self, phone: Floats, phone_vel: Floats | None, since_s: float, owner: Suitor | None,
        others: Sequence[Suitor], *, has_met_others: bool,
    ) -> tuple[Word, int]:  # fmt: skip
        """Takes in a report; what it says, and the index of whom it would rather be.

        Args:
            phone: [m] where it puts the owner now, north and east.
            phone_vel: [m/s] north and east; None: it does not say.
            since_s: the last report.
            owner: who is taken for them; None: nobody.
            others: who else is seen.
            has_met_others: some may have been taken for the owner not long ago; without, nobody is doubted lightly.
        """
        swapped = None if owner is None else self._swapped(owner, others)
        if swapped is not None:
            return Word.ANOTHER, swapped
        self._alone_s = 0.0 if owner is not None else self._alone_s + since_s
        last = (None, None) if owner is None else (owner.fit.apart, owner.fit.apart_vel)
        for who in [*others, *([owner] if owner is not None else [])]:
            who.fit.hear(phone, phone_vel, who.now, since_s, self._usual)
        for who in others:
            who.fit.odds = min(max(who.fit.odds, -_LEAST), _MOST)
        if owner is not None:
            least = -_MOST if self._usual.noise.steps >= _KNOWN else 0.0  # not doubted before
            most = 0.0 if likeness(owner.looks, self._usual.looks) < UNLIKE else _MOST
            owner.fit.odds = min(max(owner.fit.odds, least), most)
        odds = [self._usual.odds(who) for who in others]
        best = max(range(len(others)), key=odds.__getitem__, default=-1)
        is_heard = best >= 0 and others[best].fit.reports >= _HEARD
        if owner is None:
            enough = max(_FITS - _FITS_LATER * max(self._alone_s - _PATIENT_S, 0.0), _FITS_LEAST)
            if not (has_met_others and is_heard and odds[best] > enough):
                return Word.AGREES, -1
            self._usual.doubt(others[best])
            return Word.ANOTHER, best
        mine = self._usual.odds(owner)
        self._learn(owner, *last, is_next=since_s < _NEXT_S)
        if mine > _FITS + max([0.0, *odds]):
            self._usual.learn(owner)
        if is_heard and odds[best] - max(mine, 0.0) > _SURE:
            self._usual.doubt(others[best])
            return Word.ANOTHER, best
        if mine >= -(_SURE if has_met_others else _SURE_ALONE):
            return Word.AGREES, -1
        self._usual.off = None  # it was of somebody else
        if likeness(owner.looks, self._usual.looks) > 0.0:
            self._usual.looks = Looks()  # and they too
        return Word.NOBODY, -1

    def likeness(self, colours: Floats | None) -> float:
        """Logarithm of how much likelier the owner is who looks like that in an image; 0: nobody knows."""
        return likeness(Looks(colours, 1), self._usual.looks)

    def _swapped(self, owner: Suitor, others: Sequence[Suitor]) -> int | None:
        """Who looks like the owner, where who is taken for them does not: one was taken for the other in passing.

        What was heard was of either of them then.
        """
        if likeness(owner.looks, self._usual.looks) > UNLIKE:
            return None
        alike = [likeness(who.looks, self._usual.looks) for who in others]
        best = max(range(len(others)), key=alike.__getitem__, default=-1)
        if best < 0 or alike[best] < _ALIKE:
            return None
        owner.fit.forget()
        others[best].fit.forget()
        return best

    def _learn(self, owner: Suitor, last: Floats | None, last_vel: Floats | None, *, is_next: bool) -> None:
        """The phone's noise, of one report and the next."""
        fit = owner.fit
        if is_next and last is not None and fit.apart is not None:
            has_vel = last_vel is not None and fit.apart_vel is not None
            step_vel = fit.apart_vel - last_vel if has_vel else None  # type: ignore[operator]
            self._usual.noise.learn(fit.apart - last, step_vel)
