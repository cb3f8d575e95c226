"""The wall clock, read here and nowhere else, and the pace of simulated time against it.

Simulated time is the only time the simulation knows. Whoever steps it asks a `Pacer` to wait until the wall clock has
caught up; with no speed given it never waits (lockstep). Dates in logs come from the simulated epoch, so that the same
flight writes the same bytes.
"""

import time
from collections.abc import Callable
from datetime import UTC, datetime

SIMULATED_EPOCH_US = 1_767_225_600_000_000  # Unix time of simulated time 0: 2026-01-01 00:00 UTC
MAX_LAG_S = 0.25  # guess: lag that is made up by running faster; beyond it the flight goes on late instead


def wall_time_s() -> float:
    """Seconds on a wall clock that never steps back; its zero means nothing."""
    return time.perf_counter()


def process_time_s() -> float:
    """Processor time that this process has taken."""
    return time.process_time()


def wall_sleep_s(seconds: float) -> None:
    """Lets the wall clock run on, while simulated time stands still."""
    time.sleep(seconds)


def wall_unix_us() -> int:
    """Unix time in microseconds; it steps when the machine's clock is set."""
    return time.time_ns() // 1000


def wall_date_text() -> str:
    """Date and time of day in UTC, for the names of run folders: 20260131-235959."""
    return datetime.now(UTC).strftime("%Y%m%d-%H%M%S")


class Pacer:
    """Keeps simulated time at `speed` times the wall clock; None runs as fast as possible."""

    def __init__(
        self,
        speed: float | None,
        now_s: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if speed is not None and not 0.0 < speed < float("inf"):
            raise ValueError(f"speed must be a positive number or None, not {speed}")
        self.speed = speed
        self.lag_s = 0.0  # wall clock seconds the flight has come out late, in sum
        self._now_s = now_s
        self._sleep = sleep
        self._start_s: float | None = None  # wall time of simulated time 0

    def seconds_until(self, time_us: int) -> float:
        """Wall clock seconds until simulated `time_us` is due: 0 when it is due or late, and always in lockstep."""
        if self.speed is None:
            return 0.0
        now_s = self._now_s()
        due_after_s = time_us * 1.0e-6 / self.speed
        if self._start_s is None:
            self._start_s = now_s - due_after_s
        wait_s = self._start_s + due_after_s - now_s
        if wait_s < -MAX_LAG_S:  # a stall (suspend, first compile) is not chased with a burst of speed
            self._start_s -= wait_s
            self.lag_s -= wait_s
        return max(wait_s, 0.0)

    def wait_until(self, time_us: int) -> None:
        """Sleeps until simulated `time_us` is due."""
        wait_s = self.seconds_until(time_us)
        if wait_s > 0.0:
            self._sleep(wait_s)
