"""What a vehicle's state becomes on the channels of one sink.

In: states, one after the other, of a running flight or of a log. Out: transforms, poses, trails, fixes and numbers,
each at its rate in simulated time: the same states make the same bytes.
"""

from collections import deque

from foxglove import Context
from foxglove.messages import FrameTransform, FrameTransforms, Pose

from mission.foxglove import messages
from mission.foxglove.channel_set import ChannelSet
from mission.foxglove.channels import (
    FIX_EST,
    FIX_GNSS,
    FIX_TRUE,
    NUMBERS,
    POSE_EST,
    POSE_SP,
    POSE_TRUE,
    RING,
    TEXTS,
    TRAIL_EST,
    TRAIL_TRUE,
    TRANSFORMS,
    ChannelSpec,
)
from mission.foxglove.vehicle_state import Motion, VehicleState

TRAIL_POSES = 300


class Publisher:
    """Tells one sink of a vehicle.

    Args:
        context: of the sink.
    """

    def __init__(self, context: Context) -> None:
        self.channels = ChannelSet(context)
        self._trails: dict[str, deque[Pose]] = {
            spec.topic: deque(maxlen=TRAIL_POSES) for spec in (TRAIL_TRUE, TRAIL_EST)
        }
        self._gnss_time_us = 0
        self._ring_time_us = 0

    def publish(self, state: VehicleState, mounts: list[FrameTransform]) -> None:
        """One moment.

        Args:
            state: of the vehicle.
            mounts: transforms of what it carries.
        """
        now_us, channels = state.time_us, self.channels
        if channels.is_due(TRANSFORMS, now_us):
            found = [*messages.transforms(state), *mounts]
            channels.log(TRANSFORMS, FrameTransforms(transforms=found), now_us)
        for spec, trail, fix, motion in (
            (POSE_TRUE, TRAIL_TRUE, FIX_TRUE, state.true),
            (POSE_EST, TRAIL_EST, FIX_EST, state.est),
        ):
            if motion is not None and messages.is_known(motion):
                self._publish_pose(state, spec, motion)
                self._publish_trail(now_us, trail, motion)
                if channels.is_due(fix, now_us):
                    channels.log(fix, messages.location(now_us, motion, state.origin), now_us)
        if state.setpoint is not None and messages.is_known(state.setpoint):
            self._publish_pose(state, POSE_SP, state.setpoint)
        self._publish_sensors(state)
        for numbers in NUMBERS:
            if channels.is_due(numbers, now_us):
                channels.log_numbers(numbers, numbers.read(state), now_us)

    def text(self, time_us: int, severity: int, text: str, now_us: int) -> None:
        """What the vehicle has said."""
        self.channels.log(TEXTS, messages.log_message(time_us, severity, text), now_us)

    def _publish_pose(self, state: VehicleState, spec: ChannelSpec, motion: Motion) -> None:
        if self.channels.is_due(spec, state.time_us):
            self.channels.log(spec, messages.pose_in_map(state.time_us, motion), state.time_us)

    def _publish_trail(self, now_us: int, spec: ChannelSpec, motion: Motion) -> None:
        if self.channels.is_due(spec, now_us):
            trail = self._trails[spec.topic]
            trail.append(messages.pose(motion.pos_ned, motion.q_ned_from_frd))
            self.channels.log(spec, messages.poses_in_map(now_us, trail), now_us)

    def _publish_sensors(self, state: VehicleState) -> None:
        now_us, fix = state.time_us, state.gnss
        if fix is not None and fix.time_us > self._gnss_time_us and self.channels.is_due(FIX_GNSS, now_us):
            self._gnss_time_us = fix.time_us
            self.channels.log(FIX_GNSS, messages.gnss_location(fix), now_us)
        is_new = len(state.ring_m) > 0 and state.ring_time_us > self._ring_time_us
        if is_new and self.channels.is_due(RING, now_us):
            self._ring_time_us = state.ring_time_us
            self.channels.log(RING, messages.ring_scan(state.ring_time_us, state.ring_m), now_us)
