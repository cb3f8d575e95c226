"""The onboard camera of a follow-me flight: what the policy sees, ten times a second, with the time it was taken.

In: the true pose of the vehicle, and the owner. Out: pictures of 64 x 64 pixels, colour and depth packed as in
training, to whoever asked for them: a companion in the same process, or a server of streams.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from autopilot.camera.ports import View
from common.image_stream import ImageFrame
from policies.tasks.follow_me.observe import (
    HFOV_DEG,
    IMAGE_CHANNELS,
    IMAGE_SIZE,
    TILT_DEG,
    camera_mount,
    pack_images,
)
from sim.camera_rig import CameraRig
from sim.rig import Rig
from sim.world.world import WorldMap

PERIOD_US = 100_000
DEPTH_HALF_M = 4.0  # as policies/tasks/follow_me/observe.py encodes it

Sink = Callable[[ImageFrame], None]


class OnboardCamera:
    """The forward camera of vehicle 0 of a rig."""

    def __init__(self, rig: Rig, world: WorldMap) -> None:
        self._eye = CameraRig(rig, world)
        self._view = View(IMAGE_SIZE, IMAGE_SIZE, HFOV_DEG, camera_mount())
        self._images = wp.zeros((1, IMAGE_SIZE, IMAGE_SIZE, len(IMAGE_CHANNELS)), dtype=wp.uint8)
        self._sinks: list[Sink] = []
        self._sequence = 0
        self._due_us = 0

    def add_sink(self, sink: Sink) -> None:
        """Somebody who gets every picture from now on."""
        self._sinks.append(sink)

    def frame(self, time_us: int) -> None:
        """Takes a picture if one is due and somebody wants it."""
        if time_us < self._due_us:
            return
        self._due_us = max(self._due_us + PERIOD_US, time_us)
        if not self._sinks:
            return
        taken = self.take(time_us)
        for sink in self._sinks:
            sink(taken)

    def take(self, time_us: int) -> ImageFrame:
        """A picture of this moment."""
        raw = self._eye.capture(self._view).result()
        rgb: Any = wp.array(raw.rgb[None], dtype=wp.uint8)
        depth_m: Any = wp.array(raw.depth_m[None], dtype=float)
        wp.launch(pack_images, (1, IMAGE_SIZE, IMAGE_SIZE), [rgb, depth_m, self._images])
        pixels = np.array(self._images.numpy()[0])
        self._sequence += 1
        return ImageFrame(time_us, self._sequence, pixels, HFOV_DEG, TILT_DEG, DEPTH_HALF_M)
