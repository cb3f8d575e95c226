"""One wheel of a rover: suspension, tyre, motor and brake, 1,000 steps a second.

A tyre is a spring between the wheel and the ground that the wheel's rolling unwinds (first-order relaxation, H. B.
Pacejka, "Tire and Vehicle Dynamics", 2012, chapter 7): at speed its deflection is the slip times the relaxation length,
at standstill it holds like a spring, so that a braked rover stands on a slope. The slip curve takes the length of the
deflection, so that what is used along the wheel is missing across it.
"""

import warp as wp

from common.kernels import SUBSTEPS, TICK_S
from sim.bodies.rover_model import RoverModel
from sim.bodies.tyre import force_per_slip

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_ROLLING_M_S = wp.constant(0.3)  # tread speed at which the damping of a standing tyre has halved


@wp.struct
class WheelStep:
    """One wheel, and what it does to the body."""

    speed: float  # [rad/s]
    deflection: wp.vec2  # [m] of the tyre, along the wheel and across it
    drive_n: float  # [N] of the motor at the tread
    force_frd: wp.vec3  # [N]
    torque_frd: wp.vec3  # [N m]
    is_touching: int


@wp.func
def steered_frd(model: RoverModel, steering_rad: float, offset_m: float) -> wp.vec3:
    """Where a front wheel points: both stand across the radius of the same circle (Ackermann).

    Args:
        model: of the vehicle.
        steering_rad: of a wheel in the middle.
        offset_m: of this one from the middle, to the right.
    """
    tangent = wp.tan(steering_rad)
    along = model.wheel_base_m - tangent * offset_m
    across = tangent * model.wheel_base_m
    return wp.normalize(wp.vec3(along, across, 0.0))


@wp.func
def tyre_step(
    model: RoverModel, deflection: wp.vec2, slide: wp.vec2, rolling: float, load: float
) -> tuple[wp.vec2, wp.vec2]:
    """The deflection of a tyre [m] after a substep, and its force on the wheel [N], both along it and across it.

    Args:
        model: the tyre.
        deflection: [m] before.
        slide: [m/s] of the tread over the ground, against it.
        rolling: [m/s] speed of the tread.
        load: [N].
    """
    unwind = 1.0 / (1.0 + _SUBSTEP_S * wp.abs(rolling) * model.relaxation_inv)
    now = (deflection + _SUBSTEP_S * slide) * unwind
    slip = wp.length(now) / model.peak_deflection_m
    if slip > model.tyre.knee:
        now = now * (model.tyre.knee / slip)
        slip = model.tyre.knee
    force = now * (load * force_per_slip(model.tyre, slip) / model.peak_deflection_m)
    if slip < 1.0:
        force += slide * (load * model.standstill_n_s_m / (1.0 + wp.abs(rolling) / _ROLLING_M_S))
    most = load * model.tyre.peak
    size = wp.length(force)
    if size > most:
        force = force * (most / size)
    return now, force


@wp.func
def wheel_step(
    model: RoverModel,
    wheel: int,
    now: WheelStep,
    heading_frd: wp.vec3,
    drop_m: float,
    brake_nm: float,
    target_n: float,
    normal_frd: wp.vec3,
    vel_frd: wp.vec3,
    omega_frd: wp.vec3,
) -> WheelStep:
    """One wheel a substep later, with its force and torque on the body.

    Args:
        model: of the vehicle.
        wheel: which.
        now: its state before.
        heading_frd: where it points.
        drop_m: from its hub to the ground, along the ground's normal.
        brake_nm: friction of its brake.
        target_n: [N] that its motor tends to.
        normal_frd: of the ground, pointing up.
        vel_frd: [m/s] of the centre of gravity.
        omega_frd: [rad/s]
    """
    out = WheelStep()
    out.drive_n = now.drive_n + model.motor_gain * (target_n - now.drive_n)
    squeeze_m = model.radius_m - drop_m
    radius = model.radius_m
    friction_nm = brake_nm
    along_n = float(0.0)
    if squeeze_m > 0.0:
        arm_frd = wp.vec3(model.hub_x[wheel], model.hub_y[wheel], model.hub_z) - normal_frd * drop_m
        vel_point_frd = vel_frd + wp.cross(omega_frd, arm_frd)
        load = wp.max(model.spring_n_m * squeeze_m - model.damper_n_s_m * wp.dot(vel_point_frd, normal_frd), 0.0)
        ahead = wp.normalize(heading_frd - wp.dot(heading_frd, normal_frd) * normal_frd)
        right = wp.cross(ahead, normal_frd)
        rolling = radius * now.speed
        slide = wp.vec2(rolling - wp.dot(vel_point_frd, ahead), -wp.dot(vel_point_frd, right))
        deflection, grip_n = tyre_step(model, now.deflection, slide, rolling, load)
        out.deflection = deflection
        along_n = grip_n[0]
        out.force_frd = load * normal_frd + grip_n[0] * ahead + grip_n[1] * right
        out.torque_frd = wp.cross(arm_frd, out.force_frd)
        out.is_touching = 1
        friction_nm += model.rolling_resistance * load * radius
    per_nm = _SUBSTEP_S * model.wheel_inertia_inv
    free = now.speed + per_nm * radius * (out.drive_n - along_n)
    out.speed = wp.sign(free) * wp.max(wp.abs(free) - per_nm * friction_nm, 0.0)
    return out
