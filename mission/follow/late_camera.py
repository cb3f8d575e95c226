"""A camera whose pictures come late, irregularly, at times not at all: what is between a lens and a companion.

In: pictures as they are taken. Out: the same, each when it would have come; who takes it sees when it was taken.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from common.image_stream import ImageFrame
from policies.tasks.follow_me.image_way import delay_rows

Sink = Callable[[ImageFrame], None]


class LateCamera:
    """Between the onboard camera and one who gets its pictures.

    Args:
        params: the numbers of the following, array of one `FollowParams`.
        seed: of the delays.
    """

    def __init__(self, params: Any, seed: int) -> None:
        self._delay_s: Any = wp.zeros(1, dtype=float)
        self._inputs = [params, seed, 0, self._delay_s]
        self._under_way: deque[tuple[int, ImageFrame]] = deque()
        self.sinks: list[Sink] = []

    def add_sink(self, sink: Sink) -> None:
        """Somebody who gets every picture from now on."""
        self.sinks.append(sink)

    def publish(self, frame: ImageFrame, time_us: int) -> None:
        """Called by the camera now; what becomes of a picture goes by its number, the first is 1."""
        self._inputs[2] = frame.sequence - 1
        wp.launch(delay_rows, 1, self._inputs)
        delay_s = float(np.asarray(self._delay_s.numpy())[0])
        if delay_s >= 0.0:
            self._under_way.append((time_us + round(delay_s * 1e6), frame))

    def frame(self, time_us: int) -> None:
        """Hands on what has come by now, the newest last; what came after a newer one is left out."""
        come = [frame for due_us, frame in self._under_way if due_us <= time_us]
        if not come:
            return
        newest = max(come, key=lambda frame: frame.sequence)
        self._under_way = deque(item for item in self._under_way if item[1].sequence > newest.sequence)
        for sink in self.sinks:
            sink(newest)
