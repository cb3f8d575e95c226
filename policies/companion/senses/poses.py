"""Where the vehicle was when a picture was taken: its telemetry of the last seconds."""

from collections import deque
from dataclasses import dataclass
from itertools import islice
from math import hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from common.attitude import Quat, Vector, rotated
from policies.companion.telemetry import Own

KEPT = 100  # of telemetry at 50 Hz: two seconds


@dataclass(frozen=True, slots=True)
class Pose:
    """At one moment."""

    time_us: int  # the vehicle's clock
    pos_ned: Vector
    q_ned_from_frd: Quat


class PoseHistory:
    """The newest poses."""

    def __init__(self) -> None:
        self._poses: deque[Pose] = deque(maxlen=KEPT)

    def note(self, own: Own) -> None:
        """Takes in what telemetry says now."""
        is_known = isfinite(own.pos_ned[0]) and own.boot_us >= 0
        if not is_known or (self._poses and own.boot_us == self._poses[-1].time_us):
            return
        self._poses.append(Pose(own.boot_us, own.pos_ned, own.q_ned_from_frd))

    def at(self, time_us: int) -> Pose | None:
        """The pose nearest in time; None before the first."""
        return min(self._poses, key=lambda pose: abs(pose.time_us - time_us)) if self._poses else None

    def between(self, time_us: int) -> Pose | None:
        """The pose at a time, between those before and after it; None: one of them has not come, or is too old."""
        for later, earlier in zip(reversed(self._poses), islice(reversed(self._poses), 1, None), strict=False):
            if earlier.time_us <= time_us <= later.time_us:
                return _between(earlier, later, (time_us - earlier.time_us) / (later.time_us - earlier.time_us))
        return None


def matrix_of(q_dst_from_src: Quat) -> NDArray[np.float64]:
    """The rotation as (3, 3)."""
    return np.array([rotated(q_dst_from_src, axis) for axis in np.eye(3).tolist()]).T


def _between(first: Pose, second: Pose, part: float) -> Pose:
    """Some part of the way from one pose to the next, which turn by little: a straight line will do."""
    rest = 1.0 - part
    pos = [rest * a + part * b for a, b in zip(first.pos_ned, second.pos_ned, strict=True)]
    sign = 1.0 if sum(a * b for a, b in zip(first.q_ned_from_frd, second.q_ned_from_frd, strict=True)) >= 0.0 else -1.0
    q = [rest * a + sign * part * b for a, b in zip(first.q_ned_from_frd, second.q_ned_from_frd, strict=True)]
    x, y, z, w = (each / hypot(*q) for each in q)
    return Pose(round(rest * first.time_us + part * second.time_us), (pos[0], pos[1], pos[2]), (x, y, z, w))
