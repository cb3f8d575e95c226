"""The depth images of a batch of navigating drones: rendered, made noisy, packed as the observation's image.

In: where the vehicles are, and the worlds. Out: `border.images`, one channel. The camera, its mount and the coding of
depth are those of FollowMe's.
"""

from typing import Any

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import Border
from policies.tasks.follow_me.observe import HFOV_DEG, depth_byte
from policies.tasks.follow_me.sight import lens_of
from policies.tasks.navigate.numbers import NavigateNumbers
from sim.advance import RigArrays
from sim.sensors.camera import Lens
from sim.sensors.quick_camera import QuickCamera
from sim.world.batch import WorldBatch

wp.set_module_options({"enable_backward": False})

DEPTH_CHANNELS = ("nearness",)
_STREAM = wp.constant(203)  # of the rig's seeds
_STD_SHARE = wp.constant(0.02)  # of the depth, a noise of 1; Intel D435: below 2 % up to 2 m
_UNIFORM_WIDTH = wp.constant(3.4641016)  # of a uniform draw of unit variance


@wp.kernel(enable_backward=False)
def aim(rig: RigArrays, rows: wp.array(dtype=wp.bool), lenses: wp.array(dtype=Lens)) -> None:
    """Puts the lenses of the chosen rows where their vehicles carry them."""
    i = wp.tid()
    if rows[i]:
        lenses[i] = lens_of(rig.body[i], 1.0)


@wp.kernel(enable_backward=False)
def take_depths(
    border: Border,
    rig: RigArrays,
    numbers: wp.array(dtype=NavigateNumbers),
    depth_m: wp.array3d(dtype=float),
    rows: wp.array(dtype=wp.bool),
) -> None:
    """The images of the chosen rows; one thread per row of pixels."""
    i, y = wp.tid()
    if not rows[i]:
        return
    noise = numbers[i].range_noise
    state = draw_key(rig.seed[i], y, rig.tick[i], _STREAM)
    for x in range(depth_m.shape[2]):
        share = noise * _STD_SHARE * _UNIFORM_WIDTH * (wp.randf(state) - 0.5)
        border.images[i, y, x, 0] = depth_byte(depth_m[i, y, x] * (1.0 + share))


class DepthEyes:
    """The depth cameras of all rows.

    Args:
        border: whose images are taken.
        rig: the vehicles.
        numbers: of the running episodes.
        worlds: what is seen; camera i looks at world i.
    """

    def __init__(self, border: Any, rig: Any, numbers: Any, worlds: WorldBatch) -> None:
        count, height, width, _ = border.images.shape
        device = worlds.device
        self._camera = QuickCamera(worlds, count, width=width, height=height, hfov_deg=HFOV_DEG, device=device)
        rows = wp.full(count, value=True, dtype=wp.bool, device=device)
        inputs = [border, rig, numbers, self._camera.depth_m, rows]
        self._aim = wp.launch(aim, count, [rig, rows, self._camera.lenses], device=device, record_cmd=True)
        self._take = wp.launch(take_depths, (count, height), inputs, device=device, record_cmd=True)

    def take(self, rows: Any) -> None:
        """Takes the images of the chosen rows."""
        self._aim.set_param_at_index(1, rows)
        self._aim.launch()
        self._camera.render(rows)
        self._take.set_param_at_index(4, rows)
        self._take.launch()

    def refresh(self, worlds: Any = None) -> None:
        """Tells that the chosen worlds have changed, or all."""
        self._camera.refresh(worlds)
