"""The images of a batch of follow-me drones: rendered with their cameras' noise, packed as the observation's image.

In: the lenses that `look` has placed, the worlds, the owners. Out: `buffers.images`. As a policy's companion gets them,
but for their way over the network.
"""

from typing import Any

import warp as wp

from common.rng import draw_tick
from policies.tasks.flight.rig_task import worker_count
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.observe import HFOV_DEG, pack_images
from sim.advance import RigArrays
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.fast_camera.optics import Optics, sensor_noise
from sim.world.batch import WorldBatch

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def set_optics(
    rig: RigArrays,
    params: wp.array(dtype=FollowParams),
    rows: wp.array(dtype=wp.bool),
    optics: wp.array(dtype=Optics),
) -> None:
    """Gives the cameras of the chosen rows the noise of their episodes."""
    i = wp.tid()
    if rows[i]:
        optics[i] = sensor_noise(optics[i], params[i].camera_noise, rig.seed[i], draw_tick(rig.tick[i]))


class Eyes:
    """The cameras of all rows.

    Args:
        buffers: whose images are taken.
        rig: the vehicles.
        params: of the running episodes.
        worlds: what is seen; camera i looks at world i.
        people: the owners; camera i sees person i.
    """

    def __init__(self, buffers: Any, rig: Any, params: Any, worlds: WorldBatch, people: Any) -> None:
        count, height, width, _ = buffers.images.shape
        device = worlds.device
        self._camera = QuickCamera(
            worlds,
            count,
            width=width,
            height=height,
            hfov_deg=HFOV_DEG,
            people=people,
            has_optics=True,
            threads=worker_count(device),
            device=device,
        )
        camera = self._camera
        everyone = wp.full(count, value=True, dtype=wp.bool, device=device)
        self._everyone = everyone
        set_inputs = [rig, params, everyone, camera.optics]
        self._set_optics = wp.launch(set_optics, count, set_inputs, device=device, record_cmd=True)
        inputs = [camera.rgb, camera.depth_m, everyone, buffers.images]
        self._pack = wp.launch(pack_images, (count, height), inputs, device=device, record_cmd=True)

    @property
    def lenses(self) -> Any:
        """To be placed before images are taken."""
        return self._camera.lenses

    def take(self, rows: Any = None) -> None:
        """Takes the images of the chosen rows, or of all."""
        chosen = self._everyone if rows is None else rows
        self._set_optics.set_param_at_index(2, chosen)
        self._set_optics.launch()
        self._camera.render(chosen)
        self._pack.set_param_at_index(2, chosen)
        self._pack.launch()

    def refresh(self, worlds: Any = None) -> None:
        """Tells that the chosen worlds have changed, or all."""
        self._camera.refresh(worlds)
