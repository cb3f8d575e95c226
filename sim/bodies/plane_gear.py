"""A plane on the ground: three wheels on springs or a belly, and what scrapes; each 1 ms.

A wheel grips by a spring across it and along it (a bristle), so that a plane that stands does not creep: across it up
to the tyre's friction, along it up to its rolling resistance or its brake. The spring across relaxes as it rolls.
Wing tips, nose, tail and belly have Coulomb friction. Left out: the momentum of the wheels, terrain curvature under
the plane.
"""

import warp as wp

from sim.bodies.contact import Surroundings, limit_length
from sim.bodies.plane_model import HULL_POINTS, PlaneModel

wp.set_module_options({"enable_backward": False})

_HULL_POINTS = wp.constant(HULL_POINTS)
_RELAXATION_M = wp.constant(0.1)  # guess: way on which the force across a wheel builds up
_SCRAPE_FRICTION = wp.constant(0.5)  # guess: foam and glass fibre on grass


@wp.struct
class GearForce:
    """Sum over all touching points."""

    force_ned: wp.vec3  # [N]
    torque_frd: wp.vec3  # [N m] about the centre of gravity
    along_m: wp.vec3  # bristles of the wheels after the step
    across_m: wp.vec3
    impact_speed_m_s: float
    is_on_ground: int  # a wheel touches, or the belly
    speed_m_s: wp.vec2  # of the treads, left and right


@wp.func
def rolled(
    model: PlaneModel,
    out: GearForce,
    wheel: int,
    depth: float,
    normal: wp.vec3,
    vel_ned: wp.vec3,
    rot: wp.mat33,
    omega_frd: wp.vec3,
    steering: float,
    brake: float,
    dt: float,
) -> GearForce:
    """Adds a wheel that touches; its bristles are those of `out`, before and after.

    Args:
        model: of the vehicle.
        out: so far.
        wheel: which.
        depth: [m] by which it is pressed into the ground.
        normal: of the ground, pointing up, ned.
        vel_ned: [m/s] of the centre of gravity.
        rot: ned from frd.
        omega_frd: [rad/s]
        steering: [rad] of the nose wheel, to the right.
        brake: [0..1]
        dt: [s]
    """
    arm_frd = wp.vec3(model.wheel_x[wheel], model.wheel_y[wheel], model.wheel_z)
    vel = vel_ned + rot * wp.cross(omega_frd, arm_frd)
    normal_speed = wp.dot(normal, vel)
    load = wp.max(model.contact.normal_n_m * depth - model.contact.normal_n_s_m * normal_speed, 0.0)
    heading = wp.vec3(1.0, 0.0, 0.0)
    grip = model.rolling_resistance + model.brake_friction * brake
    if wheel == 0:
        heading = wp.vec3(wp.cos(steering), wp.sin(steering), 0.0)
        grip = model.rolling_resistance
    ahead = rot * heading
    ahead = wp.normalize(ahead - normal * wp.dot(normal, ahead))
    right = wp.cross(ahead, normal)
    rolling, sliding = wp.dot(vel, ahead), wp.dot(vel, right)
    stiff = float(model.contact.tangent_n_m)
    damp = float(model.contact.tangent_n_s_m)
    most_across = load * model.side_friction
    most_along = load * wp.min(grip, model.side_friction)
    along = wp.clamp(out.along_m[wheel] + rolling * dt, -most_along / stiff, most_along / stiff)
    across = (out.across_m[wheel] + sliding * dt) / (1.0 + dt * wp.abs(rolling) / _RELAXATION_M)
    across = wp.clamp(across, -most_across / stiff, most_across / stiff)
    out.along_m[wheel] = along
    out.across_m[wheel] = across
    force = load * normal
    force -= ahead * wp.clamp(stiff * along + damp * rolling, -most_along, most_along)
    force -= right * wp.clamp(stiff * across + damp * sliding, -most_across, most_across)
    out.force_ned += force
    out.torque_frd += wp.cross(arm_frd, wp.transpose(rot) * force)
    out.impact_speed_m_s = wp.max(out.impact_speed_m_s, -normal_speed)
    out.is_on_ground = 1
    if wheel > 0:
        out.speed_m_s[wheel - 1] = rolling
    return out


@wp.func
def touch_ground(
    model: PlaneModel,
    around: Surroundings,
    pos_ned: wp.vec3,
    vel_ned: wp.vec3,
    rot: wp.mat33,
    omega_frd: wp.vec3,
    along_m: wp.vec3,
    across_m: wp.vec3,
    steering: float,
    brake: float,
    dt: float,
) -> GearForce:
    """Forces of the ground.

    Args:
        model: of the vehicle.
        around: the ground's plane.
        pos_ned: [m]
        vel_ned: [m/s]
        rot: ned from frd.
        omega_frd: [rad/s]
        along_m: bristles before.
        across_m: bristles before.
        steering: [rad] of the nose wheel, to the right.
        brake: [0..1]
        dt: [s]
    """
    out = GearForce()
    normal = around.normal_ned
    ground_ned = around.origin_ned + wp.vec3(0.0, 0.0, around.height_agl_m)
    height = wp.dot(normal, pos_ned - ground_ned)
    for wheel in range(model.wheel_count):
        arm_frd = wp.vec3(model.wheel_x[wheel], model.wheel_y[wheel], model.wheel_z)
        depth = -height - wp.dot(normal, rot * arm_frd)
        if depth > 0.0:
            out.along_m[wheel] = along_m[wheel]
            out.across_m[wheel] = across_m[wheel]
            out = rolled(model, out, wheel, depth, normal, vel_ned, rot, omega_frd, steering, brake, dt)
    return scraped(model, out, height, normal, vel_ned, rot, omega_frd)


@wp.func
def scraped(
    model: PlaneModel,
    out: GearForce,
    height: float,
    normal: wp.vec3,
    vel_ned: wp.vec3,
    rot: wp.mat33,
    omega_frd: wp.vec3,
) -> GearForce:
    """Adds wing tips, nose, tail and belly."""
    for point in range(model.point_count):
        arm_frd = wp.vec3(model.point_x[point], model.point_y[point], model.point_z[point])
        depth = -height - wp.dot(normal, rot * arm_frd)
        if depth > 0.0:
            vel = vel_ned + rot * wp.cross(omega_frd, arm_frd)
            normal_speed = wp.dot(normal, vel)
            load = wp.max(model.scrape_n_m * depth - model.scrape_n_s_m * normal_speed, 0.0)
            sliding = vel - normal * normal_speed
            force = load * normal - limit_length(sliding * model.slide_n_s_m, _SCRAPE_FRICTION * load)
            out.force_ned += force
            out.torque_frd += wp.cross(arm_frd, wp.transpose(rot) * force)
            out.impact_speed_m_s = wp.max(out.impact_speed_m_s, -normal_speed)
            if point >= _HULL_POINTS:
                out.is_on_ground = 1
    return out
