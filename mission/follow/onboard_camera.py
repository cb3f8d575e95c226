"""The onboard camera of a follow-me flight: what the policy sees, ten times a second, with the time it was taken.

In: the true pose of the vehicle, and the owner. Out: pictures of 64 x 64 pixels, colour and depth with noise and
packed as in training, to whoever asked for them: a companion in the same process, or a server of streams.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from autopilot.payload.camera.ports import View
from common.image_stream import ImageFrame
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.observe import (
    DEPTH_HALF_M,
    HFOV_DEG,
    IMAGE_CHANNELS,
    IMAGE_SIZE,
    TILT_DEG,
    camera_mount,
    pack_images,
)
from policies.tasks.follow_me.task_cameras import set_optics
from sim.camera_rig import CameraRig
from sim.rig import Rig
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.world.world import WorldMap

PERIOD_US = 100_000

Sink = Callable[[ImageFrame], None]


class OnboardCamera:
    """The forward camera of vehicle 0 of a rig.

    Args:
        rig: where the truth is.
        world: what is seen.
        people: who is seen: an array of one `Person`.
        noise: of the pictures; 1 is training's.
    """

    def __init__(self, rig: Rig, world: WorldMap, people: Any, noise: float = 1.0) -> None:
        self._eye = CameraRig(rig, world)
        self.view = View(IMAGE_SIZE, IMAGE_SIZE, HFOV_DEG, camera_mount())
        self._camera = QuickCamera(
            world, 1, width=IMAGE_SIZE, height=IMAGE_SIZE, hfov_deg=HFOV_DEG, people=people, has_optics=True
        )
        self._lens: NDArray[Any] = self._camera.lenses.numpy()  # live
        images: Any = wp.zeros((1, IMAGE_SIZE, IMAGE_SIZE, len(IMAGE_CHANNELS)), dtype=wp.uint8)
        params: Any = wp.zeros(1, dtype=FollowParams)
        params.numpy()["camera_noise"] = noise
        everyone: Any = wp.full(1, value=True, dtype=wp.bool)
        optics = [rig.arrays, params, everyone, self._camera.optics]
        self._set_optics = wp.launch(set_optics, 1, optics, record_cmd=True)
        inputs = [self._camera.rgb, self._camera.depth_m, everyone, images]
        self._pack = wp.launch(pack_images, (1, IMAGE_SIZE), inputs, record_cmd=True)
        self._images: NDArray[np.uint8] = images.numpy()
        self._sinks: list[Sink] = []
        self._sequence = 0
        self._due_us = 0

    def add_sink(self, sink: Sink) -> None:
        """Somebody who gets every picture from now on."""
        self._sinks.append(sink)

    def frame(self, time_us: int) -> None:
        """Takes a picture if one is due."""
        if time_us < self._due_us:
            return
        self._due_us = max(self._due_us + PERIOD_US, time_us)
        taken = self.take(time_us)
        for sink in self._sinks:
            sink(taken)

    def take(self, time_us: int) -> ImageFrame:
        """A picture of this moment."""
        pose = self._eye.pose(self.view)
        self._lens["pos_ned"] = pose.pos_ned
        self._lens["q_ned_from_rdf"] = pose.q_ned_from_rdf
        self._set_optics.launch()
        self._camera.render()
        self._pack.launch()
        self._sequence += 1
        return ImageFrame(time_us, self._sequence, self._images[0].copy(), HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))
