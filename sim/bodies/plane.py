"""A plane's body: wing, tail, propeller, servos, gear, rigid body and contact, 1,000 steps a second.

In: commands (aileron, elevator, throttle, rudder, nose wheel, brake), the wind, the world. Out: true motion, what an
ideal IMU and a pitot tube would measure, battery. Positive commands roll right, pitch up and yaw right. `plane_tick` is
one 4 ms tick of four substeps. What the air does is in `plane_air.py`, what the ground does in `plane_gear.py`.
"""

import warp as wp

from common.geodesy import GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S, vec8
from sim.battery import discharged
from sim.bodies.body import Body
from sim.bodies.contact import ContactForce, Surroundings, look_around, obstacle_force, over_solids
from sim.bodies.plane_air import SEA_LEVEL_DENSITY_KG_M3, air_force, propeller_step
from sim.bodies.plane_gear import touch_ground
from sim.bodies.plane_model import PlaneModel, plane_model
from sim.bodies.rigid_body import held, moved, rested, truth_of
from sim.truth import Truth
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_GRAVITY_NED = wp.constant(wp.vec3(0.0, 0.0, GRAVITY_M_S2))
_DENSITY_LAPSE_PER_M = wp.constant(9.6e-5)  # ISO 2533: relative change of density per metre near sea level
_TICK_S = wp.constant(TICK_S)
_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_SUBSTEP_COUNT = wp.constant(SUBSTEPS)


@wp.struct
class PlaneState:
    """All that a plane's body needs to go on; what others may read of it is its `Truth`."""

    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    q_ned_from_frd: wp.quat
    omega_frd: wp.vec3  # [rad/s]
    pos_rounding_ned: wp.vec3  # [m] what rounding has added to pos_ned, to be taken off (Kahan's sum)
    vel_rounding_ned: wp.vec3  # [m/s] the same of vel_ned
    q_rounding: wp.quat  # the same of q_ned_from_frd
    surface: wp.vec3  # [rad] aileron, elevator, rudder; trailing edges down and to the left
    steering_rad: float  # of the nose wheel, to the right
    propeller_rad_s: float
    power_w: float  # of the motor
    pitot_pa: float  # dynamic pressure along the nose
    along_m: wp.vec3  # bristles of the wheels
    across_m: wp.vec3
    tread_m_s: wp.vec2
    accel_frd: wp.vec3  # [m/s²] specific force, mean over the last tick
    gyro_frd: wp.vec3  # [rad/s] mean over the last tick
    height_agl_m: float  # of the centre of gravity over the ground below
    battery_charge_c: float  # [C] left
    battery_rounding_c: float  # [C] what rounding has added to it, to be taken off (Kahan's sum)
    battery_voltage_v: float
    battery_current_a: float
    is_on_ground: int  # a wheel touches, or the belly
    is_crashed: int  # for good: struck something too fast
    impact_speed: float  # [m/s] largest speed along a contact normal so far
    is_held: int  # in somebody's hands: turns with omega_frd alone, and moves as they do
    hand_accel_ned: wp.vec3  # [m/s²] of those hands; zero: they rest


@wp.struct
class PlaneInputs:
    """What acts on a plane over the substeps of a tick."""

    surface: wp.vec3  # [rad] asked of the servos
    steering: float  # [rad] asked of the nose wheel
    voltage_v: float  # at the motor
    brake: float
    density: float  # [kg/m³]
    wind_ned: wp.vec3  # [m/s]
    around: Surroundings


@wp.func
def plane_inputs(model: PlaneModel, body: PlaneState, command: vec8, wind_ned: wp.vec3, world: World) -> PlaneInputs:
    """All that stays the same over the substeps of a tick; a plane that has crashed is left as it is."""
    inputs = PlaneInputs()
    inputs.wind_ned = wind_ned
    inputs.around = over_solids(world, model.contact, look_around(world, model.contact, body.pos_ned))
    ratio = model.home_density_ratio * (1.0 + _DENSITY_LAPSE_PER_M * body.pos_ned[2])
    inputs.density = SEA_LEVEL_DENSITY_KG_M3 * ratio
    inputs.surface = body.surface
    inputs.steering = body.steering_rad
    if body.is_crashed == 0:
        asked = wp.vec3(
            wp.clamp(command[0], -1.0, 1.0), -wp.clamp(command[1], -1.0, 1.0), -wp.clamp(command[3], -1.0, 1.0)
        )
        inputs.surface = wp.cw_mul(model.surface_max, asked)
        inputs.steering = model.steering_max * wp.clamp(command[4], -1.0, 1.0)
        inputs.voltage_v = body.battery_voltage_v * wp.clamp(command[2], 0.0, 1.0)
        inputs.brake = wp.clamp(command[5], 0.0, 1.0)
    return inputs


@wp.func
def servo(model: PlaneModel, angle: float, asked: float) -> float:
    """[rad] An angle after a substep: a lag, and a greatest rate."""
    return angle + wp.clamp(model.surface_gain * (asked - angle), -model.surface_step, model.surface_step)


@wp.func
def touched(model: PlaneModel, body: PlaneState, inputs: PlaneInputs, rot: wp.mat33) -> tuple[PlaneState, ContactForce]:
    """Ground and obstacles: their force, and what they do to wheels and hull."""
    contact = ContactForce()
    if inputs.around.is_near_ground == 1:
        gear = touch_ground(
            model, inputs.around, body.pos_ned, body.vel_ned, rot, body.omega_frd, body.along_m, body.across_m,
            body.steering_rad, inputs.brake, _SUBSTEP_S,
        )  # fmt: skip
        contact.force_ned = gear.force_ned
        contact.torque_frd = gear.torque_frd
        contact.impact_speed_m_s = gear.impact_speed_m_s
        body.along_m = gear.along_m
        body.across_m = gear.across_m
        body.tread_m_s = gear.speed_m_s
        body.is_on_ground = gear.is_on_ground
    if inputs.around.is_near_obstacle == 1:
        contact = obstacle_force(model.contact, inputs.around, contact, body.pos_ned, body.vel_ned)
    body.impact_speed = wp.max(body.impact_speed, contact.impact_speed_m_s)
    if contact.impact_speed_m_s > model.contact.crash_speed_m_s:
        body.is_crashed = 1
    return body, contact


@wp.func
def turning(model: PlaneModel, omega_frd: wp.vec3, torque_frd: wp.vec3) -> wp.vec3:
    """Euler's equation [rad/s²]."""
    momentum = model.inertia_frd * omega_frd
    return model.inertia_inv_frd * (torque_frd - wp.cross(omega_frd, momentum))


@wp.func
def _substep(model: PlaneModel, body: PlaneState, inputs: PlaneInputs) -> PlaneState:
    """One step of motion, integrated as the multirotor's."""
    dt = _SUBSTEP_S
    for k in range(3):
        body.surface[k] = servo(model, body.surface[k], inputs.surface[k])
    body.steering_rad = servo(model, body.steering_rad, inputs.steering)
    rot = wp.quat_to_matrix(body.q_ned_from_frd)
    to_frd = wp.transpose(rot)
    air_vel_frd = to_frd * (body.vel_ned - inputs.wind_ned)
    air = air_force(model, air_vel_frd, body.omega_frd, body.surface, inputs.density)
    propeller = propeller_step(model, body.propeller_rad_s, inputs.voltage_v, air_vel_frd[0], inputs.density)
    force_frd = air.force_frd + wp.vec3(propeller.thrust_n, 0.0, 0.0)
    torque_frd = air.torque_frd - wp.vec3(propeller.torque_n_m, 0.0, 0.0)
    body.propeller_rad_s = propeller.speed_rad_s
    body.power_w = propeller.power_w
    if inputs.around.is_near_ground + inputs.around.is_near_obstacle > 0:
        body, contact = touched(model, body, inputs, rot)
        force_frd += to_frd * contact.force_ned
        torque_frd += contact.torque_frd
    omega = body.omega_frd
    body.accel_frd = force_frd * model.mass_inv
    middle_accel_frd = body.accel_frd + wp.cross((0.5 * dt) * omega, body.accel_frd)  # the body turns meanwhile
    accel_ned = rot * middle_accel_frd + _GRAVITY_NED
    middle = omega + (0.5 * dt) * turning(model, omega, torque_frd)
    body.omega_frd = omega + dt * turning(model, middle, torque_frd)
    body.gyro_frd = 0.5 * (omega + body.omega_frd)
    return moved(body, accel_ned, dt)


@wp.func
def held_tick(body: PlaneState) -> PlaneState:
    """A tick in somebody's hands, its motor stopped: turned at omega_frd, in its place, lifted or thrown."""
    out = held(body, _TICK_S)
    out.propeller_rad_s = 0.0
    out.pitot_pa = 0.0
    accel = body.hand_accel_ned
    if wp.length_sq(accel) > 0.0:
        out.vel_ned = body.vel_ned + _TICK_S * accel
        out.pos_ned = body.pos_ned + (0.5 * _TICK_S) * (body.vel_ned + out.vel_ned)
        out.accel_frd = wp.quat_rotate_inv(body.q_ned_from_frd, accel - _GRAVITY_NED)
    return out


@wp.func
def pitot_pressure(body: PlaneState, wind_ned: wp.vec3, density: float) -> float:
    """[Pa] Along the nose; negative from behind."""
    ahead_m_s = wp.quat_rotate_inv(body.q_ned_from_frd, body.vel_ned - wind_ned)[0]
    return 0.5 * density * wp.max(ahead_m_s, 0.0) * ahead_m_s


@wp.func
def plane_tick(model: PlaneModel, body: PlaneState, command: vec8, wind_ned: wp.vec3, world: World) -> PlaneState:
    """One tick: four substeps, accel_frd and gyro_frd as means over them, then pitot tube and battery."""
    inputs = plane_inputs(model, body, command, wind_ned, world)
    body.height_agl_m = inputs.around.height_agl_m
    body.is_on_ground = 0
    if body.is_held == 1:
        body = held_tick(body)
        body.pitot_pa = pitot_pressure(body, wind_ned, inputs.density)
        return body
    accel_sum = wp.vec3()
    gyro_sum = wp.vec3()
    substeps = int(_SUBSTEP_COUNT)  # a dynamic loop, as the multirotor's
    for _step in range(substeps):
        body = _substep(model, body, inputs)
        accel_sum += body.accel_frd
        gyro_sum += body.gyro_frd
    body.accel_frd = accel_sum / float(_SUBSTEP_COUNT)
    body.gyro_frd = gyro_sum / float(_SUBSTEP_COUNT)
    body.pitot_pa = pitot_pressure(body, wind_ned, inputs.density)
    power_w = model.battery.avionics_w + body.power_w / model.battery.motor_efficiency
    after = discharged(model.battery, body.battery_charge_c, body.battery_rounding_c, power_w, TICK_S)
    body.battery_charge_c = after.charge_c
    body.battery_rounding_c = after.rounding_c
    body.battery_voltage_v = after.voltage_v
    body.battery_current_a = after.current_a
    return body


@wp.func
def plane_truth(body: PlaneState) -> Truth:
    """What others may read of the body."""
    truth = truth_of(body)
    truth.motor_speed[2] = body.propeller_rad_s
    truth.has_pitot = 1
    truth.pitot_pa = body.pitot_pa
    truth.steering_rad = body.steering_rad
    return truth


@wp.func
def plane_at_rest(model: PlaneModel, pos_ned: wp.vec3, yaw_rad: float) -> PlaneState:
    """A plane level and still at pos_ned, battery full."""
    return rested(PlaneState(), model.battery, pos_ned, yaw_rad)


@wp.func
def plane_standing_height(model: PlaneModel) -> float:
    """Of the centre of gravity over the ground [m] that its wheels or belly stand on."""
    return model.standing_m


PLANE_BODY = Body(PlaneModel, PlaneState, plane_tick, plane_truth, plane_at_rest, plane_standing_height, plane_model)
