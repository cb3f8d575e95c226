"""When the next photo is due: one, a series, every so many seconds, every so many metres."""

from math import dist, inf

NEVER_US = 1 << 62
FRAME_CHECK_US = 20_000  # one frame


class Trigger:
    """The series under way; photos are taken by the camera."""

    def __init__(self) -> None:
        self.interval_us = 0  # of a series; 0: none
        self._left = 0.0  # photos of the series, inf for ever
        self._due_us = NEVER_US
        self.distance_m = 0.0  # 0: none
        self._last_ned: tuple[float, float, float] | None = None

    @property
    def is_active(self) -> bool:
        return self._left > 0 or self.distance_m > 0.0

    @property
    def is_series(self) -> bool:
        """Photos at an interval; a distance has none."""
        return self._left > 0

    def start_series(self, time_us: int, interval_us: int, count: int) -> None:
        """Photos at an interval from now on; 0: for ever."""
        self.interval_us = interval_us
        self._left = count if count > 0 else inf
        self._due_us = time_us + FRAME_CHECK_US  # the camera has had its frame

    def stop_series(self) -> None:
        self.interval_us, self._left, self._due_us = 0, 0.0, NEVER_US

    def start_distance(self, distance_m: float, pos_ned: tuple[float, float, float], *, is_now: bool) -> None:
        """A photo every so many metres of way from here on, the first one here if `is_now`."""
        self.distance_m = distance_m
        self._last_ned = None if is_now else pos_ned

    def stop_distance(self) -> None:
        self.distance_m = 0.0

    def due_us(self, time_us: int) -> int:
        """When to ask again."""
        if self.distance_m > 0.0:
            return min(time_us + FRAME_CHECK_US, self._due_us)
        return self._due_us

    def is_due(self, time_us: int, pos_ned: tuple[float, float, float]) -> bool:
        """Whether a photo is to be taken now, which counts as taken."""
        is_due = False
        if self._left > 0 and time_us >= self._due_us:
            self._left -= 1
            self._due_us = self._due_us + self.interval_us if self._left > 0 else NEVER_US
            if self._left <= 0:
                self.interval_us = 0
            is_due = True
        if self.distance_m > 0.0 and (
            self._last_ned is None or dist(self._last_ned[:2], pos_ned[:2]) >= self.distance_m
        ):
            self._last_ned = pos_ned
            is_due = True
        return is_due
