"""The images of a batch of follow-me drones: rendered with their cameras' noise, packed as the observation's image.

In: the lenses that `look` has placed, the worlds, the people. Out: `buffers.images`, as a policy's companion gets them:
each as late as its episode has it.
"""

from typing import Any

import warp as wp

from common.rng import draw_tick
from policies.tasks.flight.rig_task import worker_count
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.image_way import Way, carry, note
from policies.tasks.follow_me.observe import HFOV_DEG, pack_images
from policies.tasks.follow_me.owner_visibility import lens_in, light_gain
from sim.advance import RigArrays
from sim.sensors.camera import Lens
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.fast_camera.optics import Optics, sensor_noise
from sim.truth import Truth
from sim.world.batch import WorldBatch

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def aim_lenses(
    truths: wp.array(dtype=Truth), params: wp.array(dtype=FollowParams), lenses: wp.array(dtype=Lens)
) -> None:
    """Places the lens of every vehicle: for flights, which look when a picture is due."""
    i = wp.tid()
    lenses[i] = lens_in(truths[i], params[i])


@wp.kernel(enable_backward=False)
def set_optics(
    rig: RigArrays,
    params: wp.array(dtype=FollowParams),
    rows: wp.array(dtype=wp.bool),
    optics: wp.array(dtype=Optics),
) -> None:
    """Gives the cameras of the chosen rows the noise, the smear and the depth of their episodes."""
    i = wp.tid()
    if rows[i]:
        n = params[i]
        gain = light_gain(n)
        out = sensor_noise(optics[i], n.camera_noise, rig.seed[i], draw_tick(rig.tick[i]))
        out.read_std = out.read_std * gain
        out.shot_std = out.shot_std * wp.sqrt(gain)
        out.has_depth_limit = 1
        out.depth_max_m = n.depth_max_m
        out.depth_holes = n.depth_holes
        out.distortion = n.lens_distortion
        out.shutter_s = n.shutter_s
        if n.shutter_s > 0.0:
            truth = rig.truth[i]
            q_ned_from_rdf = lens_in(truth, n).q_ned_from_rdf
            out.vel_rdf = wp.quat_rotate_inv(q_ned_from_rdf, truth.vel_ned)
            rate_ned = wp.quat_rotate(truth.q_ned_from_frd, truth.omega_frd)
            out.rate_rdf = wp.quat_rotate_inv(q_ned_from_rdf, rate_ned)
        optics[i] = out


class Eyes:
    """The cameras of all rows.

    Args:
        buffers: whose images are taken.
        rig: the vehicles.
        params: of the running episodes.
        worlds: what is seen; camera i looks at world i.
        people: shape (envs, people); camera i sees those of row i.
        clothes: likewise.
        way: of the pictures.
        seeds: of the episodes.
    """

    def __init__(
        self, buffers: Any, rig: Any, params: Any, worlds: WorldBatch, people: Any, clothes: Any, way: Way, seeds: Any
    ) -> None:
        count, height, width, _ = buffers.images.shape
        device = worlds.device
        self._camera = QuickCamera(
            worlds,
            count,
            width=width,
            height=height,
            hfov_deg=HFOV_DEG,
            people=people,
            clothes=clothes,
            has_optics=True,
            threads=worker_count(device),
            device=device,
        )
        camera = self._camera
        everyone = wp.full(count, value=True, dtype=wp.bool, device=device)
        self._everyone = everyone
        set_inputs = [rig, params, everyone, camera.optics]
        self._set_optics = wp.launch(set_optics, count, set_inputs, device=device, record_cmd=True)
        fresh = wp.zeros_like(buffers.images)
        size = (count, height)
        pack_inputs = [camera.rgb, camera.depth_m, everyone, fresh]
        self._pack = wp.launch(pack_images, size, pack_inputs, device=device, record_cmd=True)
        note_inputs = [params, seeds, 0, everyone, way]
        self._note = wp.launch(note, count, note_inputs, device=device, record_cmd=True)
        carry_inputs = [everyone, way, fresh, buffers.images]
        self._carry = wp.launch(carry, size, carry_inputs, device=device, record_cmd=True)

    @property
    def lenses(self) -> Any:
        """To be placed before images are taken."""
        return self._camera.lenses

    def take(self, starting: Any = None) -> None:
        """Takes pictures of all, or the first ones of the rows whose episodes are starting, and shows what has come."""
        chosen = self._everyone if starting is None else starting
        self._note.set_param_at_index(2, int(starting is not None))
        self._set_optics.set_param_at_index(2, chosen)
        self._set_optics.launch()
        self._camera.render(chosen)
        for launch, index in ((self._pack, 2), (self._note, 3), (self._carry, 0)):
            launch.set_param_at_index(index, chosen)
            launch.launch()

    def refresh(self, worlds: Any = None) -> None:
        """Tells that the chosen worlds have changed, or all."""
        self._camera.refresh(worlds)
