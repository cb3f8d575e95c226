"""The onboard camera of a follow-me flight: what the policy sees, ten times a second, with the time it was taken.

In: the true pose of the vehicle, and the people. Out: pictures of 64 x 64 pixels, colour and depth with noise and
packed as in training, to whoever asked for them: a companion in the same process, or a server of streams.
"""

from functools import partial
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.image_stream import ImageFrame
from mission.follow.late_camera import LateCamera, Sink
from policies.tasks.follow_me.flown_cast import FlownCast
from policies.tasks.follow_me.observe import (
    DEPTH_HALF_M,
    HFOV_DEG,
    IMAGE_SHAPE,
    IMAGE_SIZE,
    TILT_DEG,
    camera_mount,
    pack_images,
)
from policies.tasks.follow_me.task_cameras import aim_lenses, set_optics
from sim.rig import Rig
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.world.world import WorldMap

PERIOD_US = 100_000


class OnboardCamera:
    """The forward camera of vehicle 0 of a rig; it renders from when somebody gets its pictures.

    Args:
        rig: where the truth is.
        world: what is seen.
        cast: who is seen, and the numbers of camera and light.
        noise: of the pictures; 1 is training's.
        seed: of what happens to pictures on their way.
    """

    q_frd_from_rdf, hfov_deg = camera_mount(), HFOV_DEG

    def __init__(self, rig: Rig, world: WorldMap, cast: FlownCast, noise: float = 1.0, seed: int = 0) -> None:
        self._make_renderer = partial(_Renderer, rig, world, cast, noise)
        self._renderer: _Renderer | None = None
        self.way = LateCamera(cast.rows.params, seed)
        self._sequence = 0
        self._due_us = 0

    def add_sink(self, sink: Sink) -> None:
        """Somebody who gets every picture from now on, when it comes."""
        self._renderer = self._renderer or self._make_renderer()
        self.way.add_sink(sink)

    def frame(self, time_us: int, boot_us: int = 0) -> None:
        """Takes a picture if one is due and somebody gets it, and hands on what has come.

        Args:
            time_us: of the flight.
            boot_us: when the vehicle's clock began, which pictures are stamped by.
        """
        is_due = time_us >= self._due_us
        if is_due:
            self._due_us = max(self._due_us + PERIOD_US, time_us)
            self._sequence += 1  # of those that nobody gets too: the later ones do not depend on who looks
        if self._renderer is None:
            return
        if is_due:
            pixels, half_m = self._renderer.take(), float(DEPTH_HALF_M)
            image = ImageFrame(time_us - boot_us, self._sequence, pixels, HFOV_DEG, TILT_DEG, half_m)
            self.way.publish(image, time_us)
        self.way.frame(time_us)


class _Renderer:
    """Takes the camera's pictures; arguments as of `OnboardCamera`."""

    def __init__(self, rig: Rig, world: WorldMap, cast: FlownCast, noise: float) -> None:
        rows = cast.rows
        size: dict[str, Any] = {"width": IMAGE_SIZE, "height": IMAGE_SIZE, "hfov_deg": HFOV_DEG}
        self._camera = QuickCamera(world, 1, **size, people=rows.drawn, clothes=rows.clothes, has_optics=True)
        images: Any = wp.zeros((1, *IMAGE_SHAPE), dtype=wp.uint8)
        params: Any = wp.clone(rows.params)
        params.numpy()["camera_noise"] *= noise
        everyone: Any = wp.full(1, value=True, dtype=wp.bool)
        aim = [rig.arrays.truth, params, self._camera.lenses]
        self._aim = wp.launch(aim_lenses, 1, aim, record_cmd=True)
        optics = [rig.arrays, params, everyone, self._camera.optics]
        self._set_optics = wp.launch(set_optics, 1, optics, record_cmd=True)
        inputs = [self._camera.rgb, self._camera.depth_m, everyone, images]
        self._pack = wp.launch(pack_images, (1, IMAGE_SIZE), inputs, record_cmd=True)
        self._kept = (params, everyone)  # recorded launches do not
        self._image: NDArray[np.uint8] = images.numpy()[0]  # live

    def take(self) -> NDArray[np.uint8]:
        """The pixels of this moment."""
        for launch in (self._aim, self._set_optics):
            launch.launch()
        self._camera.render()
        self._pack.launch()
        return self._image.copy()
