"""What the air does to a plane: wing, tail and propeller, each 1 ms.

R. W. Beard, T. W. McLain, "Small Unmanned Aircraft: Theory and Practice", Princeton 2012, chapter 4: coefficients in
angle of attack, sideslip, rates and surfaces, lift blended into that of a flat plate where the flow separates; the
propeller by its advance ratio, on a brushless motor. Left out: ground effect, the propeller's wash over the tail,
gyroscopic torque of the propeller, a tail that stalls by itself.
"""

import warp as wp

from common.kernels import vec8
from sim.bodies.plane_model import PlaneModel

wp.set_module_options({"enable_backward": False})

SEA_LEVEL_DENSITY_KG_M3 = wp.constant(1.225)  # ISO 2533
_STILL_M_S = wp.constant(0.1)  # slower air has no direction
_STEEPEST = wp.constant(60.0)  # bounds an exponent


@wp.struct
class AirForce:
    """Of wing and tail."""

    force_frd: wp.vec3  # [N]
    torque_frd: wp.vec3  # [N m] about the centre of gravity


@wp.struct
class PropellerForce:
    """Along the nose, and about it."""

    thrust_n: float
    torque_n_m: float  # that the air takes
    speed_rad_s: float  # at the end of the step
    power_w: float  # that the motor takes


@wp.func
def separated(model: PlaneModel, alpha: float) -> float:
    """Part [0..1] of the flow that has separated at an angle of attack [rad]: Beard and McLain (4.10)."""
    above = wp.clamp(model.stall_sharpness * (alpha - model.stall_angle), -_STEEPEST, _STEEPEST)
    below = wp.clamp(-model.stall_sharpness * (alpha + model.stall_angle), -_STEEPEST, _STEEPEST)
    return 1.0 - 1.0 / ((1.0 + wp.exp(above)) * (1.0 + wp.exp(below)))


@wp.func
def lift_and_drag(model: PlaneModel, alpha: float) -> wp.vec2:
    """Coefficients without rates and surfaces: attached flow, blended into a flat plate's."""
    part = separated(model, alpha)
    sine, cosine = wp.sin(alpha), wp.cos(alpha)
    attached = model.lift[0] + model.lift[1] * alpha
    plate = 2.0 * wp.sign(alpha) * sine * sine * cosine
    plate_drag = 2.0 * wp.abs(sine * sine * sine)
    lift = (1.0 - part) * attached + part * plate
    drag = model.lift[4] + (1.0 - part) * model.induced * attached * attached + part * plate_drag
    return wp.vec2(lift, drag)


@wp.func
def sideways(row: vec8, beta: float, p: float, r: float, aileron: float, rudder: float) -> float:
    """A coefficient of side force, roll or yaw; rates made dimensionless."""
    return row[0] * beta + row[1] * p + row[2] * r + row[3] * aileron + row[4] * rudder


@wp.func
def air_force(
    model: PlaneModel, air_vel_frd: wp.vec3, omega_frd: wp.vec3, surface: wp.vec3, density: float
) -> AirForce:
    """Force and torque of wing and tail.

    Args:
        model: of the vehicle.
        air_vel_frd: [m/s] of the vehicle through the air.
        omega_frd: [rad/s]
        surface: [rad] aileron, elevator, rudder.
        density: [kg/m³]
    """
    out = AirForce()
    speed = wp.length(air_vel_frd)
    if speed < _STILL_M_S:
        return out
    alpha = wp.atan2(air_vel_frd[2], air_vel_frd[0])
    beta = wp.asin(wp.clamp(air_vel_frd[1] / speed, -1.0, 1.0))
    per_span, per_chord = 0.5 * model.span_m / speed, 0.5 * model.chord_m / speed
    p, q, r = per_span * omega_frd[0], per_chord * omega_frd[1], per_span * omega_frd[2]
    both = lift_and_drag(model, alpha)
    lift = both[0] + model.lift[2] * q + model.lift[3] * surface[1]
    drag = both[1] + model.lift[5] * wp.abs(surface[1])
    part = separated(model, alpha)
    turn = (1.0 - part) * alpha + part * wp.sin(alpha)  # of a tail that no more is carried along
    pitch = model.pitch[0] + model.pitch[1] * turn + model.pitch[2] * q + model.pitch[3] * surface[1]
    side = sideways(model.side, beta, p, r, surface[0], surface[2])
    roll = sideways(model.roll, beta, p, r, surface[0], surface[2])
    yaw = sideways(model.yaw, beta, p, r, surface[0], surface[2])
    push = 0.5 * density * speed * speed * model.area_m2
    sine, cosine = wp.sin(alpha), wp.cos(alpha)
    out.force_frd = push * wp.vec3(lift * sine - drag * cosine, side, -drag * sine - lift * cosine)
    out.torque_frd = push * wp.vec3(model.span_m * roll, model.chord_m * pitch, model.span_m * yaw)
    return out


@wp.func
def propeller_target(model: PlaneModel, voltage_v: float, inflow_m_s: float, density: float) -> float:
    """Speed [rad/s] at which the motor's torque is the air's; without enough voltage the propeller windmills.

    The air's torque is a quadratic of the speed: Beard and McLain's supplement, section 4.3.
    """
    d = model.prop_diameter_m
    k = model.motor_v_s
    square = model.c_q[0] * density * wp.pow(d, 5.0) / (4.0 * wp.pi * wp.pi)
    linear = model.c_q[1] * density * wp.pow(d, 4.0) * inflow_m_s / (2.0 * wp.pi) + k * k / model.motor_ohm
    constant = model.c_q[2] * density * d * d * d * inflow_m_s * inflow_m_s
    constant += k * (model.idle_current_a - voltage_v / model.motor_ohm)
    root = wp.sqrt(wp.max(linear * linear - 4.0 * square * constant, 0.0))
    driven = (root - linear) / (2.0 * square)
    return wp.max(driven, 2.0 * wp.pi * inflow_m_s / (d * model.free_advance))


@wp.func
def propeller_step(
    model: PlaneModel, speed_rad_s: float, voltage_v: float, inflow_m_s: float, density: float
) -> PropellerForce:
    """The propeller after a substep.

    Args:
        model: of the vehicle.
        speed_rad_s: before.
        voltage_v: at the motor.
        inflow_m_s: speed of the air through it.
        density: [kg/m³]
    """
    out = PropellerForce()
    inflow = wp.max(inflow_m_s, 0.0)
    target = propeller_target(model, voltage_v, inflow, density)
    out.speed_rad_s = speed_rad_s + model.motor_gain * (target - speed_rad_s)
    d = model.prop_diameter_m
    n, through = out.speed_rad_s / (2.0 * wp.pi), inflow / d
    scale = density * wp.pow(d, 4.0)
    out.thrust_n = scale * (model.c_t[2] * through * through + model.c_t[1] * n * through + model.c_t[0] * n * n)
    torque = model.c_q[2] * through * through + model.c_q[1] * n * through + model.c_q[0] * n * n
    out.torque_n_m = scale * d * torque
    if voltage_v > 0.0:
        current_a = wp.max(out.torque_n_m, 0.0) / model.motor_v_s + model.idle_current_a
        out.power_w = (model.motor_v_s * out.speed_rad_s + model.motor_ohm * current_a) * current_a
    return out
