"""A rover's body: motors, servo, brakes, four sprung wheels with tyres, hull, 1,000 steps a second.

In: commands (steering or left side, throttle or right side, brake), the wind, the world. Out: true motion, what an
ideal IMU would measure, wheel speeds, battery. `rover_tick` is one 4 ms tick of four substeps.
The ground is as high below each hub as it is, and as steep as those four points say together, so that a crest pushes
both axles half each. Left out: unsprung masses, momentum of the wheels, camber, roll steer, roughness of the ground
below its grid, wheels on top of kerbs and other boxes (the hull stops at them).
"""

from typing import Any

import warp as wp

from common.geodesy import GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S, vec8
from sim.battery import discharged
from sim.bodies.body import Body
from sim.bodies.rigid_body import held, hull_drag, moved, rested, truth_of
from sim.bodies.rover_hull import HullContact, hull_contact, is_near_obstacle, look_at_hull
from sim.bodies.rover_model import RoverModel, rover_model
from sim.bodies.rover_wheels import WheelStep, steered_frd, wheel_step
from sim.truth import Truth
from sim.world.neighbours import Outline
from sim.world.world import World, ground_height, ground_normal_ned, surface_height

wp.set_module_options({"enable_backward": False})

_GRAVITY_NED = wp.constant(wp.vec3(0.0, 0.0, GRAVITY_M_S2))
_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_SUBSTEP_COUNT = wp.constant(SUBSTEPS)
_TICK_S = wp.constant(TICK_S)
_WHEELS = wp.constant(4)
_ON_WHEELS = wp.constant(0.5)  # cosine of the tilt above which the ground under the wheels makes a plane
_NO_MOTOR_N_S_M = wp.constant(1.0e-3)
_UPRIGHT = wp.constant(0.17)  # cosine of the tilt below which it lies on its side, or its roof: 80 deg


@wp.struct
class RoverState:
    """All that a rover's body needs to go on; what others may read of it is its `Truth`."""

    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    q_ned_from_frd: wp.quat
    omega_frd: wp.vec3  # [rad/s]
    pos_rounding_ned: wp.vec3  # [m] what rounding has added to pos_ned, to be taken off (Kahan's sum)
    vel_rounding_ned: wp.vec3  # [m/s] the same of vel_ned
    q_rounding: wp.quat  # the same of q_ned_from_frd
    wheel_speed: wp.vec4  # [rad/s] positive forward
    deflection_x: wp.vec4  # [m] of each tyre along its wheel, forward
    deflection_y: wp.vec4  # [m] across it, to the right
    drive_n: wp.vec4  # [N] of the motor at each tread
    tread_m_s: wp.vec2  # of the rear wheels, left and right
    steering_rad: float  # of a wheel in the middle, to the right
    accel_frd: wp.vec3  # [m/s²] specific force, mean over the last tick
    gyro_frd: wp.vec3  # [rad/s] mean over the last tick
    height_agl_m: float  # of the centre of gravity over the ground below
    battery_charge_c: float  # [C] left
    battery_rounding_c: float  # [C] what rounding has added to it, to be taken off (Kahan's sum)
    battery_voltage_v: float
    battery_current_a: float
    is_on_ground: int  # a wheel touches
    is_crashed: int  # for good: struck something too fast, or tipped over
    impact_speed: float  # [m/s] largest speed along a contact normal of the hull so far
    is_held: int  # in somebody's hands: stays in its place and turns with omega_frd alone


@wp.struct
class DriveInputs:
    """What acts on a rover over the substeps of a tick."""

    side_speed_m_s: wp.vec2  # [m/s] treads of either side, that the motors would reach without load
    left_frd: wp.vec3  # where the front wheels point
    right_frd: wp.vec3
    brake_nm: wp.vec2  # of each front and each rear wheel
    ground_m: wp.vec4  # [m] height of the ground below each hub
    normal_ned: wp.vec3  # of the ground, pointing up
    ground_offset_m: float  # of the ground's plane along it
    wind_ned: wp.vec3  # [m/s]
    density_ratio: float
    is_near_obstacle: int


@wp.func
def ground_below(model: RoverModel, world: World, pos_ned: wp.vec3, rot: wp.mat33, wheel: int) -> wp.vec3:
    """The ground below a hub, ned [m]."""
    hub_ned = pos_ned + rot * wp.vec3(model.hub_x[wheel], model.hub_y[wheel], model.hub_z)
    if world.solids.count > 0:
        return wp.vec3(hub_ned[0], hub_ned[1], -surface_height(world, hub_ned))
    return wp.vec3(hub_ned[0], hub_ned[1], -ground_height(world, hub_ned[0], hub_ned[1]))


@wp.func
def drive_inputs(model: RoverModel, body: RoverState, command: vec8, wind_ned: wp.vec3, world: World) -> DriveInputs:
    """All that stays the same over the substeps of a tick."""
    inputs = DriveInputs()
    rot = wp.quat_to_matrix(body.q_ned_from_frd)
    front_left = ground_below(model, world, body.pos_ned, rot, 0)
    front_right = ground_below(model, world, body.pos_ned, rot, 1)
    rear_left = ground_below(model, world, body.pos_ned, rot, 2)
    rear_right = ground_below(model, world, body.pos_ned, rot, 3)
    inputs.ground_m = -wp.vec4(front_left[2], front_right[2], rear_left[2], rear_right[2])
    middle = 0.25 * (front_left + front_right + rear_left + rear_right)
    if rot[2, 2] > _ON_WHEELS:
        inputs.normal_ned = wp.normalize(wp.cross(front_right - rear_left, front_left - rear_right))
    else:
        middle = wp.vec3(body.pos_ned[0], body.pos_ned[1], -ground_height(world, body.pos_ned[0], body.pos_ned[1]))
        inputs.normal_ned = ground_normal_ned(world, body.pos_ned[0], body.pos_ned[1])
    inputs.ground_offset_m = wp.dot(inputs.normal_ned, middle)
    inputs.left_frd = steered_frd(model, body.steering_rad, -model.half_track_m)
    inputs.right_frd = steered_frd(model, body.steering_rad, model.half_track_m)
    inputs.wind_ned = wind_ned
    inputs.density_ratio = model.home_density_ratio
    inputs.is_near_obstacle = is_near_obstacle(model, world, body.pos_ned)
    inputs.brake_nm = (model.radius_m * wp.clamp(command[2], 0.0, 1.0)) * model.brake_max_n
    if body.is_crashed == 0:
        top = model.motor_speed_m_s * body.battery_voltage_v / model.battery.full_v
        left = command[1]
        if model.is_skid == 1:
            left = command[0]
        inputs.side_speed_m_s = top * wp.vec2(wp.clamp(left, -1.0, 1.0), wp.clamp(command[1], -1.0, 1.0))
    return inputs


@wp.func
def servo_step(model: RoverModel, angle: float, asked: float) -> float:
    """The steering angle after a tick [rad]: a lag, and a greatest rate."""
    most = model.steering_rate_rad_s * _TICK_S
    return angle + wp.clamp(model.steering_gain * (asked - angle), -most, most)


@wp.func
def steered(model: RoverModel, body: RoverState, command: vec8) -> float:
    """The steering angle after a tick [rad]; a rover that steers by its sides has none."""
    if model.is_skid == 1 or body.is_crashed == 1:
        return body.steering_rad
    return servo_step(model, body.steering_rad, model.steering_max_rad * wp.clamp(command[0], -1.0, 1.0))


@wp.func
def motor_target_n(model: RoverModel, inputs: DriveInputs, wheel_speed: wp.vec4, wheel: int) -> float:
    """Force [N] that a motor gives at a tread: by the speed that is missing, within its current limit.

    One motor drives a rear axle by its mean speed; a wheel with a motor of its own by its own.
    """
    rolling = model.radius_m * wheel_speed[wheel]
    if model.is_driven[0] == 0.0:
        rolling = 0.5 * model.radius_m * (wheel_speed[2] + wheel_speed[3])
    free = inputs.side_speed_m_s[wheel % 2]
    force = model.motor_n_s_m * (free - rolling)
    return model.is_driven[wheel] * wp.clamp(force, -model.motor_max_n, model.motor_max_n)


@wp.func
def angular_accel(model: RoverModel, omega_frd: wp.vec3, torque_frd: wp.vec3) -> wp.vec3:
    """Euler's equation [rad/s²]."""
    momentum = wp.cw_mul(model.inertia_frd, omega_frd)
    return wp.cw_mul(torque_frd - wp.cross(omega_frd, momentum), model.inertia_inv_frd)


@wp.func
def drive_wrench(
    model: RoverModel, body: RoverState, inputs: DriveInputs, rot: wp.mat33
) -> tuple[RoverState, wp.vec3, wp.vec3]:
    """Its wheels a substep later, and what they and the air do to the body: force [N] and torque [N m], frd.

    `rot`: its attitude, ned from frd.
    """
    to_frd = wp.transpose(rot)
    normal_frd = to_frd * inputs.normal_ned
    vel_frd = to_frd * body.vel_ned
    air_vel_frd = to_frd * (body.vel_ned - inputs.wind_ned)
    force_frd = hull_drag(model.drag_area_frd, air_vel_frd, inputs.density_ratio)
    torque_frd = wp.vec3()
    nose = wp.vec3(1.0, 0.0, 0.0)
    speeds = body.wheel_speed
    is_touching = int(0)
    for wheel in range(_WHEELS):
        heading = nose
        if wheel == 0:
            heading = inputs.left_frd
        elif wheel == 1:
            heading = inputs.right_frd
        hub_d = (
            body.pos_ned[2] + rot[2, 0] * model.hub_x[wheel] + rot[2, 1] * model.hub_y[wheel] + rot[2, 2] * model.hub_z
        )
        drop_m = (hub_d + inputs.ground_m[wheel]) * inputs.normal_ned[2]  # along the normal
        step = WheelStep()
        step.speed = speeds[wheel]
        step.deflection = wp.vec2(body.deflection_x[wheel], body.deflection_y[wheel])
        step.drive_n = body.drive_n[wheel]
        target_n = motor_target_n(model, inputs, speeds, wheel)
        brake_nm = inputs.brake_nm[wheel // 2]
        step = wheel_step(model, wheel, step, heading, drop_m, brake_nm, target_n, normal_frd, vel_frd, body.omega_frd)
        body.wheel_speed[wheel] = step.speed
        body.deflection_x[wheel] = step.deflection[0]
        body.deflection_y[wheel] = step.deflection[1]
        body.drive_n[wheel] = step.drive_n
        force_frd += step.force_frd
        torque_frd += step.torque_frd
        is_touching += step.is_touching
    if is_touching > 0:
        body.is_on_ground = 1
    return body, force_frd, torque_frd


@wp.func
def hull_wrench(
    model: RoverModel, body: RoverState, hull: HullContact, rot: wp.mat33
) -> tuple[RoverState, wp.vec3, wp.vec3]:
    """A body that remembers what its hull touches, and what that does to it: force [N] and torque [N m], frd."""
    touch = hull_contact(model, hull, body.pos_ned, wp.transpose(rot) * body.vel_ned, rot, body.omega_frd)
    body.impact_speed = wp.max(body.impact_speed, touch.impact_speed_m_s)
    if touch.impact_speed_m_s > model.crash_speed_m_s:
        body.is_crashed = 1
    return body, touch.force_frd, touch.torque_frd


@wp.func
def _substep(model: RoverModel, body: RoverState, inputs: DriveInputs, hull: HullContact) -> RoverState:
    dt = _SUBSTEP_S
    rot = wp.quat_to_matrix(body.q_ned_from_frd)
    body, force_frd, torque_frd = drive_wrench(model, body, inputs, rot)
    if hull.is_near == 1:
        body, push_frd, turn_frd = hull_wrench(model, body, hull, rot)
        force_frd += push_frd
        torque_frd += turn_frd
    omega = body.omega_frd
    body.accel_frd = force_frd * model.mass_inv
    middle_accel_frd = body.accel_frd + wp.cross((0.5 * dt) * omega, body.accel_frd)  # the body turns meanwhile
    accel_ned = rot * middle_accel_frd + _GRAVITY_NED
    body.omega_frd = omega + dt * angular_accel(model, omega, torque_frd)
    body.gyro_frd = 0.5 * (omega + body.omega_frd)
    return moved(body, accel_ned, dt)


@wp.func
def drain_battery(model: RoverModel, body: RoverState, dt: float) -> RoverState:
    """Voltage, current and charge after dt [s]: a motor takes what moves the tread, and the heat of its current."""
    power_w = model.battery.avionics_w
    for k in range(_WHEELS):
        heating_m_s = body.drive_n[k] / wp.max(model.is_driven[k] * model.motor_n_s_m, _NO_MOTOR_N_S_M)
        taken_w = body.drive_n[k] * (model.radius_m * body.wheel_speed[k] + heating_m_s)
        power_w += wp.max(taken_w, 0.0) / model.battery.motor_efficiency
    after = discharged(model.battery, body.battery_charge_c, body.battery_rounding_c, power_w, dt)
    body.battery_charge_c = after.charge_c
    body.battery_rounding_c = after.rounding_c
    body.battery_voltage_v = after.voltage_v
    body.battery_current_a = after.current_a
    return body


@wp.func
def held_tick(body: RoverState) -> RoverState:
    """A tick of a vehicle that is held in its place and turned at omega_frd, wheels stopped."""
    out = held(body, _TICK_S)
    out.wheel_speed = wp.vec4()
    out.tread_m_s = wp.vec2()
    return out


@wp.func
def end_tick(model: RoverModel, body: RoverState, normal_ned: wp.vec3) -> RoverState:
    """Treads, whether it has tipped over on ground of this normal, battery."""
    body.tread_m_s = model.radius_m * wp.vec2(body.wheel_speed[2], body.wheel_speed[3])
    up = wp.quat_rotate(body.q_ned_from_frd, wp.vec3(0.0, 0.0, -1.0))
    if wp.dot(up, normal_ned) < _UPRIGHT:
        body.is_crashed = 1
    return drain_battery(model, body, TICK_S)


@wp.func
def rover_tick(model: RoverModel, body: RoverState, command: vec8, wind_ned: wp.vec3, world: World) -> RoverState:
    """One tick: four substeps, accel_frd and gyro_frd as means over them, then the battery."""
    if body.is_held == 1:
        return held_tick(body)
    body.steering_rad = steered(model, body, command)
    inputs = drive_inputs(model, body, command, wind_ned, world)
    hull = look_at_hull(
        model, world, body.pos_ned, body.q_ned_from_frd, inputs.normal_ned, inputs.ground_offset_m,
        inputs.is_near_obstacle,
    )  # fmt: skip
    body.height_agl_m = hull.height_agl_m
    body.is_on_ground = 0
    accel_sum = wp.vec3()
    gyro_sum = wp.vec3()
    substeps = int(_SUBSTEP_COUNT)  # a dynamic loop, as the multirotor's
    for _step in range(substeps):
        body = _substep(model, body, inputs, hull)
        hull.other_shift_ned += _SUBSTEP_S * hull.other_vel_ned
        accel_sum += body.accel_frd
        gyro_sum += body.gyro_frd
    body.accel_frd = accel_sum / float(_SUBSTEP_COUNT)
    body.gyro_frd = gyro_sum / float(_SUBSTEP_COUNT)
    return end_tick(model, body, inputs.normal_ned)


@wp.func
def rover_truth(body: RoverState) -> Truth:
    """What others may read of the body."""
    truth = truth_of(body)
    for k in range(_WHEELS):
        truth.motor_speed[k] = body.wheel_speed[k]
    truth.has_wheels = 1
    truth.wheel_speed_m_s = body.tread_m_s
    truth.steering_rad = body.steering_rad
    return truth


@wp.func
def rover_at_rest(model: RoverModel, pos_ned: wp.vec3, yaw_rad: float) -> RoverState:
    """A rover level and still at pos_ned, battery full."""
    return rested(RoverState(), model.battery, pos_ned, yaw_rad)


@wp.func
def rover_standing_height(model: RoverModel) -> float:
    """Of the centre of gravity over the ground [m] that its wheels stand on."""
    return model.standing_m


def rover_outline(model: Any) -> Outline:
    """The box of its hull, upright, from a row of its `RoverModel`."""
    front_m, rear_m = float(model["hull_front_m"]), float(model["hull_rear_m"])
    top_m, bottom_m = float(model["hull_top_m"]), float(model["hull_bottom_m"])
    half_size_m = (0.5 * (front_m + rear_m), float(model["hull_half_width_m"]), 0.5 * (top_m + bottom_m))
    middle_m = 0.5 * (front_m - rear_m), 0.5 * (top_m - bottom_m)
    return Outline(half_size_m, False, float(model["scrape_n_m"]), *middle_m)


ROVER_BODY = Body(
    RoverModel,
    RoverState,
    rover_tick,
    rover_truth,
    rover_at_rest,
    rover_standing_height,
    rover_model,
    outline=rover_outline,
)
