"""The pictures of a batch of follow-me drones: rendered, made noisy, packed as the observation's image.

In: the lenses that `look` has placed, the worlds, the owners. Out: `border.images`. As a policy's companion gets them,
but for their way over the network.
"""

from typing import Any

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import Border
from policies.tasks.follow_me.numbers import FollowNumbers
from policies.tasks.follow_me.observe import HFOV_DEG, depth_byte
from sim.advance import RigArrays
from sim.sensors.quick_camera import QuickCamera
from sim.world.batch import WorldBatch

wp.set_module_options({"enable_backward": False})

_STREAM = wp.constant(201)  # of the rig's seeds
_RGB_STD = wp.constant(4.0)  # [levels] of a noise of 1; guess, a small sensor by day
_DEPTH_STD_SHARE = wp.constant(0.02)  # of the depth, a noise of 1; Intel D435: below 2 % up to 2 m


@wp.func
def even(bits: wp.uint32) -> float:
    """A draw of unit variance from ten bits: uniform, which a network cannot tell from normal."""
    return 3.4641016 * (float(bits & wp.uint32(1023)) / 1023.0 - 0.5)


@wp.func
def noisy(level: wp.uint8, noise: float) -> wp.uint8:
    return wp.uint8(wp.clamp(float(level) + noise + 0.5, 0.0, 255.0))


@wp.kernel(enable_backward=False)
def take_images(
    border: Border,
    rig: RigArrays,
    numbers: wp.array(dtype=FollowNumbers),
    rgb: wp.array4d(dtype=wp.uint8),
    depth_m: wp.array3d(dtype=float),
    rows: wp.array(dtype=wp.bool),
) -> None:
    """The images of the chosen rows; one thread per row of pixels."""
    i, y = wp.tid()
    if not rows[i]:
        return
    noise = numbers[i].camera_noise
    width = rgb.shape[2]
    for x in range(width):
        depth = depth_m[i, y, x]
        bits = wp.uint32(0)
        if noise > 0.0:
            bits = draw_key(rig.seed[i], y * width + x, rig.tick[i], _STREAM)
            depth = depth * (1.0 + noise * _DEPTH_STD_SHARE * even(bits))
        for c in range(3):
            border.images[i, y, x, c] = rgb[i, y, x, c]
            if noise > 0.0:
                bits = wp.rand_init(int(bits), c)
                border.images[i, y, x, c] = noisy(rgb[i, y, x, c], noise * _RGB_STD * even(bits))
        if border.images.shape[3] == 4:
            border.images[i, y, x, 3] = depth_byte(depth)


class Eyes:
    """The cameras of all rows.

    Args:
        border: whose images are taken.
        rig: the vehicles.
        numbers: of the running episodes.
        worlds: what is seen; camera i looks at world i.
        people: the owners; camera i sees person i.
    """

    def __init__(self, border: Any, rig: Any, numbers: Any, worlds: WorldBatch, people: Any) -> None:
        count, height, width, _ = border.images.shape
        device = worlds.device
        self._camera = QuickCamera(
            worlds, count, width=width, height=height, hfov_deg=HFOV_DEG, people=people, device=device
        )
        inputs = [border, rig, numbers, self._camera.rgb, self._camera.depth_m]
        everyone = wp.full(count, value=True, dtype=wp.bool, device=device)
        self._everyone = everyone
        self._take = wp.launch(take_images, (count, height), [*inputs, everyone], device=device, record_cmd=True)

    @property
    def lenses(self) -> Any:
        """To be placed before pictures are taken."""
        return self._camera.lenses

    def take(self, rows: Any = None) -> None:
        """Takes the images of the chosen rows, or of all."""
        chosen = self._everyone if rows is None else rows
        self._camera.render(chosen)
        self._take.set_param_at_index(5, chosen)
        self._take.launch()

    def refresh(self, worlds: Any = None) -> None:
        """Tells that the chosen worlds have changed, or all."""
        self._camera.refresh(worlds)
