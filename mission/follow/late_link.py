"""A link on which what a companion says comes late: from its setpoints to the flight controller.

In: the bytes that a companion sends, each piece when it does. Out: the same, in the same order, in the first of the
companion's frames in which they are due. What it hears is not late.
"""

from collections import deque
from collections.abc import Callable, Sequence

from autopilot.mavlink.client_end import ByteLink


class LateLink:
    """The companion's end of a link; `receive` is called once per frame.

    Args:
        link: between the two.
        lag_s: of each piece, besides the frame that a link without lag takes.
        time_us: what time it is now.
    """

    def __init__(self, link: ByteLink, lag_s: float, time_us: Callable[[], int]) -> None:
        self._link = link
        self._lag_us = round(lag_s * 1e6)
        self._time_us = time_us
        self._under_way: deque[tuple[int, bytes]] = deque()

    def receive(self) -> Sequence[bytes]:
        """What has come in; hands on what is due on the other way."""
        now_us = self._time_us()
        while self._under_way and self._under_way[0][0] <= now_us:
            self._link.send(self._under_way.popleft()[1])
        return self._link.receive()

    def send(self, data: bytes) -> None:
        self._under_way.append((self._time_us() + self._lag_us, data))

    def close(self) -> None:
        """What is under way does not arrive."""
        self._link.close()
