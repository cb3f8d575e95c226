"""Whether the phone is with whom is taken for the owner: its reports against sights.

In: each report, where the owner is seen, where others are. Out: who else it would rather be, or that it is none of
those who are seen. The phone's slow error is learned from the sights, and how far it goes astray from that; only others
who came near make it doubt, for a phone alone may be wrong by many metres.
"""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_LEARNS = 0.05  # of each report: over some ten seconds
_BETTER_M = 1.0  # by so much somebody else must fit better
_OFF_M = 1.2  # nearer than this to the phone nobody is doubted
_FAR_M = 3.5  # farther off it is not the owner, if others have been there
_REPORTS = 3  # in a row
_STEADY = 0.1  # of each report: by what it goes astray is learned sooner than where to
_STRAY_M = 0.5  # a phone is taken to go astray by so much at least,
_STRAYS = 3.0  # and what is within so many times of it is no reason to doubt


class Word(Enum):
    """What the phone says."""

    AGREES = 0
    ANOTHER = 1  # it is somebody else of those seen
    NOBODY = 2  # it is none of them


class PhoneCheck:
    """Of one owner."""

    def __init__(self) -> None:
        self._off: Floats | None = None  # [m] the phone's slow error, level
        self._stray2 = _STRAY_M**2  # [m²] mean square of what it goes astray from that
        self._doubts = 0

    def owner(self, phone: Floats) -> Floats | None:
        """Where a report puts the owner, level [m]; None: its error is not known yet."""
        return None if self._off is None else phone[:2] - self._off

    def hear(self, phone: Floats, seen: Floats, others: list[Floats], *, has_met_others: bool) -> tuple[Word, int]:
        """Takes in a report; what it says, and the index of whom it would rather be.

        Args:
            phone: [m] where it puts the owner now.
            seen: [m] where the owner is taken to be.
            others: [m] where others are.
            has_met_others: some may have been taken for the owner not long ago; without, nobody is doubted.
        """
        expected = self.owner(phone)
        if expected is None:
            self._off = phone[:2] - seen[:2]
            return Word.AGREES, -1
        off_m = float(np.hypot(*(seen[:2] - expected)))
        others_m = [float(np.hypot(*(other[:2] - expected))) for other in others]
        best = int(np.argmin(others_m)) if others_m else -1
        astray_m = _STRAYS * max(self._stray2**0.5, _STRAY_M)
        is_another = best >= 0 and off_m > max(_OFF_M, 0.5 * astray_m) and others_m[best] < off_m - _BETTER_M
        if not has_met_others or not (is_another or off_m > max(_FAR_M, astray_m)):
            self._doubts = 0
            if not has_met_others:  # it might learn that of another
                self._stray2 += _STEADY * (off_m * off_m - self._stray2)
                self._off = (1.0 - _LEARNS) * (phone[:2] - expected) + _LEARNS * (phone[:2] - seen[:2])
            return Word.AGREES, -1
        self._doubts += 1
        if self._doubts < _REPORTS:
            return Word.AGREES, -1
        self._doubts = 0
        return (Word.ANOTHER, best) if is_another else (Word.NOBODY, -1)
