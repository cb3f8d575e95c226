"""What the vehicle says (STATUSTEXT), as whoever watches the flight reads it: the terminal, the live page."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

from autopilot.interface.vehicle_state import Severity

KEPT = 200


@dataclass(frozen=True, slots=True)
class Text:
    """One text."""

    time_us: int
    severity: Severity
    text: str

    def __str__(self) -> str:
        return f"{self.time_us * 1e-6:7.1f} s  {self.text}"


class Texts:
    """The vehicle's newest texts (autopilot.interface.vehicle_interface.Announcer).

    Args:
        now_us: the simulated time.
    """

    def __init__(self, now_us: Callable[[], int]) -> None:
        self._now_us = now_us
        self._kept: deque[Text] = deque(maxlen=KEPT)
        self.count = 0  # of all texts since the beginning

    def since(self, count: int) -> list[Text]:
        """What was said after the first `count` texts, as far as it is kept."""
        return list(islice(self._kept, max(len(self._kept) - (self.count - count), 0), None))

    def statustext(self, severity: Severity, text: str) -> None:
        self.count += 1
        self._kept.append(Text(self._now_us(), severity, text))

    def mission_item_reached(self, seq: int) -> None:
        pass

    def mission_current_changed(self, seq: int) -> None:
        pass

    def home_changed(self) -> None:
        pass

    def heartbeat_now(self) -> None:
        pass
