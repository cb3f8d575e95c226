"""A rover for Bullet: our motors, brakes, springs, tyres and battery; the box of its hull is Bullet's.

Other vehicles, of which Bullet does not know, push at its hull as in the native engine.
"""

from typing import Any

import warp as wp

from common.kernels import SUBSTEPS, TICK_S, vec8
from sim.bodies.rover import DriveInputs, RoverState, drive_inputs, drive_wrench, end_tick, hull_wrench, steered
from sim.bodies.rover_hull import HullContact, look_at_hull
from sim.bodies.rover_model import RoverModel
from sim.engines.bullet_body import BulletBody, Hull
from sim.engines.quiet_bullet import pybullet
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_FRICTION = 0.4  # as that of the native hull


@wp.struct
class PushInputs:
    """What acts on a rover over the substeps of a tick."""

    drive: DriveInputs
    hull: HullContact  # of other vehicles


@wp.func
def _begin(
    model: RoverModel, body: RoverState, command: vec8, wind_ned: wp.vec3, world: World
) -> tuple[RoverState, PushInputs]:
    inputs = PushInputs()
    body.steering_rad = steered(model, body, command)
    drive = drive_inputs(model, body, command, wind_ned, world)
    if drive.is_near_obstacle == 1:
        inputs.hull = look_at_hull(
            model, world, body.pos_ned, body.q_ned_from_frd, drive.normal_ned, drive.ground_offset_m, 1
        )
        inputs.hull.is_near_ground = 0
    inputs.drive = drive
    return body, inputs


@wp.func
def _wrench(model: RoverModel, body: RoverState, inputs: PushInputs) -> tuple[RoverState, PushInputs, wp.vec3, wp.vec3]:
    rot = wp.quat_to_matrix(body.q_ned_from_frd)
    body, force_frd, torque_frd = drive_wrench(model, body, inputs.drive, rot)
    if inputs.hull.is_near == 1:
        body, push_frd, turn_frd = hull_wrench(model, body, inputs.hull, rot)
        force_frd += push_frd
        torque_frd += turn_frd
        inputs.hull.other_shift_ned += _SUBSTEP_S * inputs.hull.other_vel_ned
    return body, inputs, force_frd, torque_frd


@wp.func
def _end(model: RoverModel, body: RoverState, inputs: PushInputs) -> RoverState:
    return end_tick(model, body, inputs.drive.normal_ned)


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


BULLET_ROVER = BulletBody(PushInputs, _begin, _wrench, _end, _hull)
