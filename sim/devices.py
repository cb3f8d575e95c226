"""What hangs under the vehicle in the simulation: a gripper and a winch with a line.

In: commands, as the flight controller's driver passes them on, and the time. Out: their states. They move by
themselves: a state is worked out when somebody asks for it, so that they cost nothing in a frame. Their weight is not
felt by the body.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, isfinite

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict, WinchStatus
from autopilot.payload.payloads import Params

GRIPPER, WINCH = 211, 42600  # MAV_CMD
_LINE_M = 30.0  # guess
_RATE_MAX_M_S = 2.0  # guess
_SLOW_M_S = 0.5  # of moves that name no rate; guess
_TENSION_PER_M = 0.02  # [kg] weight of the line; guess
_CURRENT_A, _VOLTAGE_V = 3.0, 16.0  # of the moving motor; guess

# Actions of DO_WINCH (WINCH_ACTIONS)
RELAXED, RELATIVE, RATE, LOCK, DELIVER, HOLD, RETRACT, LOAD_LINE, ABANDON_LINE, LOAD_PAYLOAD = range(10)
# Bits of WINCH_STATUS (MAV_WINCH_STATUS_FLAG)
HEALTHY, RETRACTED, MOVING, CLUTCHED, LOCKED = 1, 2, 4, 8, 16
ABANDONED = 2048


@dataclass(slots=True)
class _Move:
    """A line that runs at a rate until it reaches a length."""

    since_us: int
    start_m: float
    rate_m_s: float  # positive lets line out
    end_m: float

    def length_m(self, now_us: int) -> float:
        length = self.start_m + self.rate_m_s * (now_us - self.since_us) * 1e-6
        return min(length, self.end_m) if self.rate_m_s > 0.0 else max(length, self.end_m)


class Gripper:
    """Holds or does not."""

    def __init__(self) -> None:
        self.holds = False

    def takes(self, command: int) -> bool:
        return command == GRIPPER

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:  # noqa: ARG002
        if params[0] not in (0.0, 1.0) and isfinite(params[0]):
            return Reply(Verdict.DENIED, f"there is no gripper {params[0]:g}")
        if params[1] not in (0.0, 1.0):
            return Reply(Verdict.DENIED, "a gripper can release (0) or grab (1)")
        self.holds = params[1] == 1.0
        return ACCEPTED


class Winch:
    """A motor with a line.

    Args:
        now_us: simulated time.
    """

    def __init__(self, now_us: Callable[[], int]) -> None:
        self._now_us = now_us
        self._flags = LOCKED | CLUTCHED
        self._move = _Move(0, 0.0, -_SLOW_M_S, 0.0)

    def takes(self, command: int) -> bool:
        return command == WINCH

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:  # noqa: ARG002
        instance, action, length_m, rate_m_s = params
        if instance not in (0.0, 1.0) and isfinite(instance):
            return Reply(Verdict.DENIED, f"there is no winch {instance:g}")
        if self._flags & ABANDONED and action != LOAD_LINE:
            return Reply(Verdict.FAILED, "the line was abandoned; load a new one first")
        if action in (RELATIVE, RATE) and not (isfinite(rate_m_s) and abs(rate_m_s) <= _RATE_MAX_M_S):
            return Reply(Verdict.DENIED, f"a rate of {rate_m_s:g} m/s is out of range")
        now_m = self._length_m()
        if action == RELATIVE:
            if not (isfinite(length_m) and 0.0 <= now_m + length_m <= _LINE_M):
                return Reply(Verdict.DENIED, f"{now_m + length_m:.1f} m of line: there are 0 to {_LINE_M:g} m")
            self._go(copysign(abs(rate_m_s) or _SLOW_M_S, length_m), now_m + length_m)
        elif action == RATE:
            self._go(rate_m_s, _LINE_M if rate_m_s > 0.0 else 0.0)
        elif action == DELIVER:
            self._go(_SLOW_M_S, _LINE_M)
        elif action in (RETRACT, LOAD_PAYLOAD):
            self._go(-_SLOW_M_S, 0.0)
        elif action in (LOCK, HOLD, RELAXED):
            self._stop({LOCK: LOCKED | CLUTCHED, HOLD: CLUTCHED, RELAXED: 0}[int(action)])
        elif action == LOAD_LINE:
            self._move = _Move(self._now_us(), 0.0, -_SLOW_M_S, 0.0)
            self._flags = LOCKED | CLUTCHED
        elif action == ABANDON_LINE:
            self._stop(ABANDONED)
        else:
            return Reply(Verdict.DENIED, f"action {action:g} is not known")
        return ACCEPTED

    def status(self) -> WinchStatus:
        """What the winch tells now."""
        length_m = self._length_m()
        is_moving = length_m != self._move.end_m
        flags = HEALTHY | self._flags | (MOVING if is_moving else 0) | (RETRACTED if length_m <= 0.0 else 0)
        return WinchStatus(
            length_m,
            self._move.rate_m_s if is_moving else 0.0,
            _TENSION_PER_M * length_m,
            _VOLTAGE_V,
            _CURRENT_A if is_moving else 0.0,
            flags,
        )

    def _length_m(self) -> float:
        return self._move.length_m(self._now_us())

    def _go(self, rate_m_s: float, end_m: float) -> None:
        self._move = _Move(self._now_us(), self._length_m(), rate_m_s, end_m)
        self._flags = CLUTCHED

    def _stop(self, flags: int) -> None:
        length_m = self._length_m()
        self._move = _Move(self._now_us(), length_m, 0.0, length_m)
        self._flags = flags
