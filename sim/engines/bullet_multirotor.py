"""A multirotor for Bullet: our rotors, air, legs and battery; rotor discs and what is above the legs are Bullet's.

The ground pushes at feet and rotor tips as in the native engine, by springs with dampers. The balls that stand for feet
touch what is not ground, and ground only when the legs have yielded far. Other vehicles, of which Bullet does not know,
push at its hull by springs, too.
"""

from typing import Any

import warp as wp

from common.kernels import SUBSTEPS, TICK_S, vec8
from sim.bodies.multirotor import BodyState, StepInputs, air_wrench, contact_near, drain_battery, step_inputs, touched
from sim.bodies.multirotor_model import MultirotorModel
from sim.engines.bullet_body import BulletBody, Hull
from sim.engines.midstep import midstep_torque
from sim.engines.quiet_bullet import pybullet
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_FOOT_M = 0.01  # radius of the balls that stand for feet
_YIELD_M = 0.02  # of the legs, from where the balls take over; guess, they yield 12 mm as they land at 2 m/s
_DISC_M = 0.04  # thickness of the disc that holds the rotors; guess
_FRICTION = 0.7  # as that of the native feet


@wp.func
def _begin(
    model: MultirotorModel, body: BodyState, command: vec8, wind_ned: wp.vec3, world: World
) -> tuple[BodyState, StepInputs]:
    return body, step_inputs(model, body, command, wind_ned, world, _SUBSTEP_S)


@wp.func
def _wrench(
    model: MultirotorModel, body: BodyState, inputs: StepInputs
) -> tuple[BodyState, StepInputs, wp.vec3, wp.vec3]:
    """With the gyroscopic torque of the rotors, of which Bullet does not know, and all torque as in mid-step."""
    rot = wp.quat_to_matrix(body.q_ned_from_frd)
    wrench = air_wrench(model, body, inputs, wp.transpose(rot))
    force_frd = wrench.force_frd
    torque_frd = wrench.torque_frd
    body.rotor_speed = wrench.speed
    around = inputs.around
    if around.is_near_ground + around.is_near_obstacle + around.is_near_solid > 0:
        contact = contact_near(model.contact, body, inputs.around, rot, _SUBSTEP_S)
        force_frd += wp.transpose(rot) * contact.force_ned
        torque_frd += contact.torque_frd
        body = touched(model.contact, body, contact)
        inputs.around.obstacle_shift_ned += _SUBSTEP_S * inputs.around.obstacle_vel_ned
    torque_frd = midstep_torque(model, body.omega_frd, torque_frd, wrench.momentum_z, _SUBSTEP_S)
    return body, inputs, force_frd, torque_frd


@wp.func
def _end(model: MultirotorModel, body: BodyState, inputs: StepInputs) -> BodyState:
    return drain_battery(model, body, inputs.density_ratio, TICK_S)


def _hull(model: Any, client: int) -> Hull:
    """A disc for the rotors, balls for the feet."""
    contact, leg = model["contact"], model["contact"]["leg_frd"].astype(float)
    foot_up = _YIELD_M + _FOOT_M - leg[2]
    feet = [[x, y, foot_up] for x in (leg[0], -leg[0]) for y in (leg[1], -leg[1])]
    rotor_up = -float(model["rotor_z"][: int(model["rotor_count"])].mean())
    shape = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_SPHERE] * 4 + [pybullet.GEOM_CYLINDER],
        radii=[_FOOT_M] * 4 + [float(contact["hull_radius_m"])],
        lengths=[0.0] * 4 + [_DISC_M],
        collisionFramePositions=[*feet, [0.0, 0.0, rotor_up]],
        physicsClientId=client,
    )
    return Hull(shape, _FRICTION, float(contact["crash_speed_m_s"]), feet_from_m=-foot_up - 2.0 * _FOOT_M)


BULLET_MULTIROTOR = BulletBody(StepInputs, _begin, _wrench, _end, _hull)
