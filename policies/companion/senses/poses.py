"""Where the vehicle was when a picture was taken: its telemetry of the last seconds."""

from collections import deque
from dataclasses import dataclass
from math import isfinite

from common.attitude import Quat, Vector
from policies.companion.vehicle_link import Own

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
