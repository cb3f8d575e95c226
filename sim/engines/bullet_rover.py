"""A rover for Bullet: our motors, brakes, springs, tyres and battery; the box of its hull is Bullet's."""

from typing import Any

import warp as wp

from common.kernels import vec8
from sim.bodies.rover import DriveInputs, RoverState, drive_inputs, drive_wrench, end_tick, steered
from sim.bodies.rover_model import RoverModel
from sim.engines.bullet_body import BulletBody, Hull
from sim.engines.quiet_bullet import pybullet
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_FRICTION = 0.4  # as that of the native hull


@wp.func
def _begin(
    model: RoverModel, body: RoverState, command: vec8, wind_ned: wp.vec3, world: World
) -> tuple[RoverState, DriveInputs]:
    body.steering_rad = steered(model, body, command)
    return body, drive_inputs(model, body, command, wind_ned, world)


@wp.func
def _wrench(model: RoverModel, body: RoverState, inputs: DriveInputs) -> tuple[RoverState, wp.vec3, wp.vec3]:
    body, force_frd, torque_frd = drive_wrench(model, body, inputs, wp.quat_to_matrix(body.q_ned_from_frd))
    return body, force_frd, torque_frd


@wp.func
def _end(model: RoverModel, body: RoverState, inputs: DriveInputs) -> RoverState:
    return end_tick(model, body, inputs.normal_ned)


def _hull(model: Any, client: int) -> Hull:
    """One box, from its front to its rear and from its bottom to its top."""
    front, rear, half_width, top, bottom = (
        float(model[f"hull_{name}_m"]) for name in ("front", "rear", "half_width", "top", "bottom")
    )
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX,
        halfExtents=[0.5 * (front + rear), half_width, 0.5 * (top + bottom)],
        collisionFramePosition=[0.5 * (front - rear), 0.0, 0.5 * (top - bottom)],
        physicsClientId=client,
    )
    return Hull(shape, _FRICTION, float(model["crash_speed_m_s"]), feet_from_m=None)


BULLET_ROVER = BulletBody(DriveInputs, _begin, _wrench, _end, _hull)
