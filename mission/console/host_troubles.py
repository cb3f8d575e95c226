"""What goes wrong outside of the vehicle, told as its texts: a disk that is full, a camera's video that cannot be sent.

Whoever has trouble notes it at any moment, also in the middle of sending a frame; it is told once the frame is over.
"""

from collections.abc import Callable

from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import Severity

SILENCE_US = 60_000_000  # what has not been noted for so long is told again
REPORTED_MAX = 100


class Troubles:
    """Tells each trouble once, as long as it lasts.

    Args:
        now_us: the simulated time.
    """

    def __init__(self, now_us: Callable[[], int]) -> None:
        self._now_us = now_us
        self._noted_us: dict[str, int] = {}
        self._untold: list[str] = []

    def note(self, text: str) -> None:
        """Is to be told, if it is new."""
        now_us = self._now_us()
        is_new = text not in self._noted_us or now_us - self._noted_us[text] > SILENCE_US
        if len(self._noted_us) >= REPORTED_MAX:
            self._noted_us.clear()
        self._noted_us[text] = now_us
        if is_new:
            self._untold.append(text)

    def tell(self, announcer: Announcer) -> None:
        """Tells what has been noted since the last call."""
        if self._untold:
            for text in self.take():
                announcer.statustext(Severity.WARNING, text)

    def take(self) -> list[str]:
        """What has not been told."""
        untold, self._untold = self._untold, []
        return untold
