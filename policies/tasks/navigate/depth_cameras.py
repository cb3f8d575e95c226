"""The depth images of a batch of navigating drones: rendered, made noisy, packed as the observation's image.

In: where the vehicles are, and the worlds. Out: `buffers.images`, one channel. The camera, its mount and the coding of
depth are those of FollowMe's.
"""

from typing import Any

import warp as wp

from common.rng import draw_tick
from policies.tasks.episode import StepBuffers
from policies.tasks.flight.rig_task import worker_count
from policies.tasks.follow_me.observe import HFOV_DEG, depth_byte
from policies.tasks.follow_me.owner_visibility import lens_of
from policies.tasks.navigate.navigate_params import NavigateParams
from sim.sensors.camera import Lens
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.fast_camera.optics import Optics, sensor_noise
from sim.world.batch import WorldBatch

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def aim(
    rig: Any,
    params: wp.array(dtype=NavigateParams),
    rows: wp.array(dtype=wp.bool),
    lenses: wp.array(dtype=Lens),
    optics: wp.array(dtype=Optics),
) -> None:
    """Puts the cameras of the chosen rows where their vehicles carry them, with the noise of their episodes."""
    i = wp.tid()
    if rows[i]:
        lenses[i] = lens_of(rig.truth[i], 1.0)
        optics[i] = sensor_noise(optics[i], params[i].range_noise, rig.seed[i], draw_tick(rig.tick[i]))


@wp.kernel(enable_backward=False)
def pack_depths(buffers: StepBuffers, depth_m: wp.array3d(dtype=float), rows: wp.array(dtype=wp.bool)) -> None:
    """The images of the chosen rows; one thread per row of pixels."""
    i, y = wp.tid()
    if not rows[i]:
        return
    for x in range(depth_m.shape[2]):
        buffers.images[i, y, x, 0] = depth_byte(depth_m[i, y, x])


class DepthEyes:
    """The depth cameras of all rows.

    Args:
        buffers: whose images are taken.
        rig: the vehicles.
        params: of the running episodes.
        worlds: what is seen; camera i looks at world i.
    """

    def __init__(self, buffers: Any, rig: Any, params: Any, worlds: WorldBatch) -> None:
        count, height, width, _ = buffers.images.shape
        device = worlds.device
        self._camera = camera = QuickCamera(
            worlds,
            count,
            width=width,
            height=height,
            hfov_deg=HFOV_DEG,
            has_optics=True,
            threads=worker_count(device),
            device=device,
        )
        rows = wp.full(count, value=True, dtype=wp.bool, device=device)
        aimed = [rig, params, rows, camera.lenses, camera.optics]
        self._aim = wp.launch(aim, count, aimed, device=device, record_cmd=True)
        packed = [buffers, camera.depth_m, rows]
        self._pack = wp.launch(pack_depths, (count, height), packed, device=device, record_cmd=True)

    def take(self, rows: Any) -> None:
        """Takes the images of the chosen rows."""
        self._aim.set_param_at_index(2, rows)
        self._aim.launch()
        self._camera.render(rows)
        self._pack.set_param_at_index(2, rows)
        self._pack.launch()

    def refresh(self, worlds: Any = None) -> None:
        """Tells that the chosen worlds have changed, or all."""
        self._camera.refresh(worlds)
