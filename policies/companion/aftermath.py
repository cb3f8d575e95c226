"""What the companion may still do by itself once control has gone, for as long as nobody else has taken the vehicle.

In: how vehicle and owner are, at every step of the state machine. Out: the mode that it may ask for. There are two
rights. Where it has put the vehicle in Hold because the owner was lost, it sends it home after a while. Where the
vehicle's own failsafe lands because the position was lost, it stops the descent once there is a position again, and
then follows again. Both end with the ground, and with any change of mode that is neither the companion's nor the
failsafe's: that is a pilot's.
"""

from dataclasses import dataclass
from enum import Enum
from math import dist, isfinite, nan

from autopilot.interface.vehicle_state import Mode
from common.attitude import Vector

PROVEN_US = 1_500_000  # a failsafe that is the lost position's is followed by its silence so soon; guess
CATCH_US = 300_000  # so long there must be a position before the descent is stopped: a tenth of the way down; guess
CATCH_HEARD_US = 1_200_000  # and so lately it must have said that it lands: heartbeats come at 1 Hz
CATCH_LEAST_M = 0.7  # above the ground: it sinks on for 0.3 m, and what touches the ground belongs there; guess
STEADY_US = 3_000_000  # and so long before it follows again
SETTLED_US = 5_000_000  # after which it stands in Hold,
MOVED_M = 5.0  # and who is so far from there was sent away by somebody
HOLDING = (Mode.HOLD, Mode.BRAKE)


class Right(Enum):
    """By what the companion may still do anything."""

    NONE = 0
    HELD = 1  # the vehicle is in Hold, where the companion has put it
    FALLEN = 2  # its failsafe lands it: its position was lost


class Due(Enum):
    """What is to be done now."""

    NONE = 0
    CATCH = 1  # stop the descent
    RESUME = 2  # follow again
    RETURN = 3  # go home


@dataclass(frozen=True, slots=True)
class Condition:
    """How vehicle and owner are."""

    mode: Mode | None = None
    heartbeat_age_us: int = 0  # since it said so; 0: just now
    is_failsafe: bool = False  # the vehicle says so: the mode is not a pilot's
    is_heard: bool = True  # by heartbeats, and no other companion is
    is_down: bool = False  # on the ground, or without motors
    is_unplaced: bool = False  # it tells its attitude, and no position
    is_well: bool = True  # whatever was healthy when the policy took over is, and the battery is not low
    is_lost: bool = False  # who is followed was not found again: the end
    is_alone: bool = False  # who is followed is not seen
    is_by_sight: bool = False  # GNSS is away: nobody is sent home by what was flown since
    is_covered: bool = False  # something was seen over the vehicle
    height_m: float = nan  # above the ground; NaN: not known
    pos_ned: Vector = (nan, nan, nan)  # [m]


class Aftermath:
    """The rights of one companion.

    Args:
        return_s: so long in Hold without the owner it sends the vehicle home; 0: never.
        resume_s: so long after the position was lost it may follow again by itself; 0: never.
    """

    def __init__(self, return_s: float, resume_s: float) -> None:
        self._return_us, self._resume_us = round(return_s * 1e6), round(resume_s * 1e6)
        self.right = Right.NONE
        self._mode: Mode | None = None  # of Hold
        self._resumes_until_us = 0
        self._since_us = 0  # when the right began
        self._is_proven = False  # the position was lost
        self.is_catching = False
        """Hold was asked for, out of this landing."""
        self._steady_us = 0  # since when there is a position, and all is well
        self._alone_us = 0  # since when the owner is not seen
        self._stood_ned: Vector | None = None  # where it came to stand

    def let_go(self, time_us: int, now: Condition, before: Condition | None = None) -> None:
        """Control has gone: finds out by what right.

        Args:
            time_us: on the companion's clock.
            now: how it is.
            before: how it was when the companion began to hand back; None: it did not.
        """
        self.right = Right.NONE
        is_unplaced = before is None or before.is_unplaced
        self.is_catching = False
        self._is_proven = now.is_unplaced or (before is not None and before.is_unplaced)
        self._resumes_until_us = time_us + self._resume_us if is_unplaced and self._resume_us else 0
        self._steady_us = time_us
        if is_falling(now) and self._resumes_until_us:
            self._begin(Right.FALLEN, time_us, now)
        elif before is not None and now.mode in HOLDING and (before.is_lost or self._resumes_until_us):
            self._begin(Right.HELD, time_us, now)

    def end(self) -> None:
        """Somebody has taken control, or it is over."""
        self.right = Right.NONE

    def catch(self) -> None:
        """Hold is asked for: it is the companion's, if it comes."""
        self.is_catching = True

    def give_up_catch(self) -> None:
        """It is asked for no more: who chooses Hold now is a pilot."""
        self.is_catching = False

    def asked(self) -> None:
        """Offboard is asked for: once."""
        self._resumes_until_us = 0

    def may_resume(self, time_us: int) -> bool:
        """Whether it may follow again, once all is there."""
        return self.right is not Right.NONE and time_us < self._resumes_until_us

    def look(self, time_us: int, now: Condition) -> str:
        """Keeps the right, or ends it; what the pilot is to be told."""
        if self.right is Right.NONE:
            return ""
        if now.is_unplaced or not now.is_well:
            self._steady_us = time_us
        if now.is_down and self.right is Right.FALLEN:
            self.end()
            return "Companion: landed by failsafe: stays down"
        if now.is_down or not now.is_heard:
            self.end()
        elif self.right is Right.FALLEN:
            self._look_falling(time_us, now)
        else:
            self._look_held(time_us, now)
        return ""

    def due(self, time_us: int, now: Condition) -> Due:
        """What it may do now."""
        steady_us = time_us - self._steady_us
        if self.right is Right.FALLEN:
            is_high = now.height_m >= CATCH_LEAST_M  # not where it is not known
            is_fresh = now.heartbeat_age_us <= CATCH_HEARD_US
            return Due.CATCH if self._is_proven and steady_us >= CATCH_US and is_high and is_fresh else Due.NONE
        if self.right is Right.NONE:
            return Due.NONE
        if self.may_resume(time_us) and self._is_proven and steady_us >= STEADY_US and not now.is_alone:
            return Due.RESUME
        is_left = self._return_us > 0 and time_us - self._alone_us >= self._return_us
        return Due.RETURN if is_left else Due.NONE

    def _look_falling(self, time_us: int, now: Condition) -> None:
        self._is_proven |= now.is_unplaced
        if now.mode in HOLDING and (self.is_catching or now.is_failsafe):
            self._begin(Right.HELD, time_us, now)
        elif not is_falling(now) or not self.may_resume(time_us):
            self.end()
        elif not self._is_proven and time_us - self._since_us > PROVEN_US:
            self.end()  # it lands for another reason

    def _look_held(self, time_us: int, now: Condition) -> None:
        if is_falling(now) and self.may_resume(time_us):
            self._is_proven = self.is_catching = False
            self._begin(Right.FALLEN, time_us, now)
        elif now.mode is not self._mode or self._is_moved(time_us, now):
            self.end()
        elif not now.is_alone or now.is_by_sight:
            self._alone_us = time_us

    def _is_moved(self, time_us: int, now: Condition) -> bool:
        """Whether somebody has sent it elsewhere, which needs no other mode."""
        if time_us - self._since_us < SETTLED_US or not isfinite(now.pos_ned[0]):
            return False
        if self._stood_ned is None:
            self._stood_ned = now.pos_ned
        return dist(now.pos_ned, self._stood_ned) > MOVED_M

    def _begin(self, right: Right, time_us: int, now: Condition) -> None:
        self.right, self._since_us, self._mode = right, time_us, now.mode
        self._alone_us, self._stood_ned = time_us, None


def is_falling(now: Condition) -> bool:
    """Whether it lands, and no pilot has said so."""
    return now.mode is Mode.LAND and now.is_failsafe
