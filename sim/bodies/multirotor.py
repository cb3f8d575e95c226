"""A multirotor's body: motors, rotors, rigid body and contact, 1,000 steps a second.

In: motor commands [0..1], the wind at the vehicle, the world. Out: true position, velocity, attitude, rates, what an
ideal IMU would measure, battery. `body_tick` is one 4 ms tick of four substeps.
Left out: blade flapping torque, rotor wakes on the body and on each other, vortex ring state, frame flexibility, ground
effect on tilt.
"""

import warp as wp

from common.geodesy import GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S, vec8
from sim.battery import discharged
from sim.bodies.contact import (
    ContactForce,
    ContactModel,
    FootSlip,
    Surroundings,
    ground_contact,
    look_along_legs,
    look_around,
    look_at_deck,
    obstacle_force,
)
from sim.bodies.multirotor_model import MultirotorModel
from sim.bodies.rigid_body import held, hull_drag, lag_gain, moved, rested, truth_of
from sim.truth import Truth
from sim.world.world import World, surface_height

wp.set_module_options({"enable_backward": False})

_GRAVITY_NED = wp.constant(wp.vec3(0.0, 0.0, GRAVITY_M_S2))
_DENSITY_LAPSE_PER_M = wp.constant(9.6e-5)  # ISO 2533: relative change of density per metre near sea level
_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_SUBSTEP_COUNT = wp.constant(SUBSTEPS)
_UNROLLED_ROTORS = 4


@wp.struct
class BodyState:
    """All that a multirotor's body needs to go on; what others may read of it is its `Truth`."""

    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    q_ned_from_frd: wp.quat
    omega_frd: wp.vec3  # [rad/s]
    pos_rounding_ned: wp.vec3  # [m] what rounding has added to pos_ned, to be taken off (Kahan's sum)
    vel_rounding_ned: wp.vec3  # [m/s] the same of vel_ned
    q_rounding: wp.quat  # the same of q_ned_from_frd
    rotor_speed: vec8  # [rad/s], not negative
    accel_frd: wp.vec3  # [m/s²] specific force, mean over the last tick
    gyro_frd: wp.vec3  # [rad/s] mean over the last tick
    height_agl_m: float  # of the centre of gravity over the ground below
    battery_charge_c: float  # [C] left
    battery_rounding_c: float  # [C] what rounding has added to it, to be taken off (Kahan's sum)
    battery_voltage_v: float
    battery_current_a: float
    is_on_ground: int  # a foot touches
    is_crashed: int  # for good: struck something too fast, or a turning rotor struck the ground
    impact_speed: float  # [m/s] largest speed along a contact normal so far
    foot_slip: FootSlip
    is_held: int  # in somebody's hands: stays in its place and turns with omega_frd alone


@wp.struct
class StepInputs:
    """What acts on a body over the substeps of a tick."""

    rotor_target: vec8  # [rad/s] speeds the commands ask for
    gain_up: float  # fraction of the way to its target a rotor goes in one substep
    gain_down: float
    density_ratio: float  # of the air, over that at sea level
    lift_ratio: float  # factor on thrust from ground effect; 0: broken rotors
    wind_ned: wp.vec3  # [m/s]
    around: Surroundings
    height_agl_m: float  # of the centre of gravity over the ground or roof below
    rotor_inertia_rate: float  # [kg m²/s] rotor inertia over dt
    dt: float  # [s] substep


@wp.struct
class RotorWrench:
    """What all rotors together do to the body."""

    force_frd: wp.vec3  # [N]
    torque_frd: wp.vec3  # [N m]
    momentum_z: float  # [N m s] angular momentum of the rotors along body z
    speed: vec8  # [rad/s] at the end of the step


@wp.func
def rotor_targets(model: MultirotorModel, command: vec8, voltage_v: float) -> vec8:
    """Speeds [rad/s] the commands ask for: omega = omega_max (a u + (1 - a) sqrt(u)) V / V_full."""
    target = vec8()
    top = model.max_speed_rad_s * voltage_v / model.battery.full_v
    for r in range(model.rotor_count):
        u = wp.clamp(command[r], 0.0, 1.0)
        target[r] = top * (model.command_curve * u + (1.0 - model.command_curve) * wp.sqrt(u))
    return target


@wp.func
def ground_effect(radius_m: float, height_m: float) -> float:
    """Thrust over thrust far from the ground: 1 / (1 - (R / 4 z)²).

    I. C. Cheeseman, W. E. Bennett, "The effect of the ground on a helicopter rotor in forward flight", ARC R&M 3021,
    1955. Below half a radius, where it no longer holds, it stays as it is there.
    """
    fraction = radius_m / (4.0 * wp.max(height_m, 0.5 * radius_m))
    return 1.0 / (1.0 - fraction * fraction)


@wp.func
def density_ratio(model: MultirotorModel, down_m: float) -> float:
    """Air density over that at sea level: linear in height from home."""
    return model.home_density_ratio * (1.0 + _DENSITY_LAPSE_PER_M * down_m)


@wp.func
def add_rotor(
    model: MultirotorModel,
    inputs: StepInputs,
    wrench: RotorWrench,
    rotor: int,
    air_vel_frd: wp.vec3,
    omega_frd: wp.vec3,
) -> RotorWrench:
    """Advances one rotor and adds its force and torque to a wrench.

    Thrust k w² minus axial inflow; in-plane drag; reaction torque spin (k_q w² + J dw/dt). In each, the mean speed
    over the step counts. `air_vel_frd` [m/s] is the velocity of the centre of gravity through the air.
    """
    x = model.rotor_x[rotor]
    y = model.rotor_y[rotor]
    z = model.rotor_z[rotor]
    spin = model.rotor_spin[rotor]
    error = inputs.rotor_target[rotor] - wrench.speed[rotor]
    change = inputs.gain_down * error
    if error > 0.0:
        change = inputs.gain_up * error
    w = wrench.speed[rotor] + 0.5 * change
    hub_vx = air_vel_frd[0] + omega_frd[1] * z - omega_frd[2] * y
    hub_vy = air_vel_frd[1] + omega_frd[2] * x - omega_frd[0] * z
    hub_vz = air_vel_frd[2] + omega_frd[0] * y - omega_frd[1] * x
    dense = inputs.density_ratio * w
    thrust = wp.max(dense * inputs.lift_ratio * (model.thrust_n_s2 * w + model.inflow_n_s2_m * hub_vz), 0.0)
    fx = -model.rotor_drag_n_s2_m * dense * hub_vx
    fy = -model.rotor_drag_n_s2_m * dense * hub_vy
    reaction = spin * (model.torque_n_m_s2 * dense * w + inputs.rotor_inertia_rate * change)
    wrench.force_frd += wp.vec3(fx, fy, -thrust)
    wrench.torque_frd += wp.vec3(-y * thrust - z * fy, z * fx + x * thrust, x * fy - y * fx + reaction)
    wrench.momentum_z -= model.rotor_inertia_kg_m2 * spin * w
    wrench.speed[rotor] = wrench.speed[rotor] + change
    return wrench


@wp.func
def rotor_wrench(
    model: MultirotorModel, inputs: StepInputs, speed: vec8, air_vel_frd: wp.vec3, omega_frd: wp.vec3
) -> RotorWrench:
    """Advances all rotors and sums their forces and torques.

    A rotor the vehicle lacks stands still and adds nothing, so the first four are unrolled: constant indices save a
    sixth of the whole body's time.
    """
    wrench = RotorWrench()
    wrench.speed = speed
    for rotor in range(_UNROLLED_ROTORS):
        wrench = add_rotor(model, inputs, wrench, rotor, air_vel_frd, omega_frd)
    for rotor in range(_UNROLLED_ROTORS, model.rotor_count):
        wrench = add_rotor(model, inputs, wrench, rotor, air_vel_frd, omega_frd)
    return wrench


@wp.func
def angular_accel(model: MultirotorModel, omega_frd: wp.vec3, torque_frd: wp.vec3, momentum_z: float) -> wp.vec3:
    """Euler's equation with the rotors' momentum: I dw/dt = torque - w x (I w + h) [rad/s²]."""
    momentum = wp.cw_mul(model.inertia_frd, omega_frd) + wp.vec3(0.0, 0.0, momentum_z)
    return wp.cw_mul(torque_frd - wp.cross(omega_frd, momentum), model.inertia_inv_frd)


@wp.func
def contact_near(
    model: ContactModel, body: BodyState, around: Surroundings, r_ned_from_frd: wp.mat33, dt: float
) -> ContactForce:
    """Force of whatever is near over a step; nothing is near: none."""
    contact = ContactForce()
    if around.is_near_ground + around.is_near_solid > 0:
        contact = ground_contact(
            model, around, body.pos_ned, body.vel_ned, r_ned_from_frd, body.omega_frd, body.foot_slip, dt
        )
    if around.is_near_obstacle == 1:
        contact = obstacle_force(model, around, contact, body.pos_ned, body.vel_ned)
    return contact


@wp.func
def touched(model: ContactModel, body: BodyState, contact: ContactForce) -> BodyState:
    """A body that remembers what it touches: feet, impacts, a crash."""
    body.foot_slip = contact.foot_slip
    body.is_on_ground = contact.is_on_ground
    if contact.is_on_ground == 1:  # what stands is held still by what rounding takes
        body.pos_rounding_ned = wp.vec3()
        body.vel_rounding_ned = wp.vec3()
    body.impact_speed = wp.max(body.impact_speed, contact.impact_speed_m_s)
    if contact.impact_speed_m_s > model.crash_speed_m_s or contact.is_rotor_strike == 1:
        body.is_crashed = 1
    return body


@wp.func
def air_wrench(model: MultirotorModel, body: BodyState, inputs: StepInputs, r_frd_from_ned: wp.mat33) -> RotorWrench:
    """What rotors and air do to the body over a step; the speeds of the rotors at its end."""
    omega = body.omega_frd
    air_vel_frd = r_frd_from_ned * (body.vel_ned - inputs.wind_ned)
    wrench = rotor_wrench(model, inputs, body.rotor_speed, air_vel_frd, omega)
    wrench.force_frd += hull_drag(model.drag_area_frd, air_vel_frd, inputs.density_ratio)
    angular_drag = inputs.density_ratio * model.angular_drag_n_m_s2
    wrench.torque_frd -= angular_drag * wp.cw_mul(wp.abs(omega), omega)
    return wrench


@wp.func
def _substep(model: MultirotorModel, body: BodyState, inputs: StepInputs) -> BodyState:
    """One step of motion.

    Rates take a midpoint step, forces act along the attitude in mid-step, position and attitude move by the mean of
    old and new velocity and rate: free fall is exact and a tumbling body keeps its angular momentum.
    """
    dt = inputs.dt
    around = inputs.around
    r_ned_from_frd = wp.quat_to_matrix(body.q_ned_from_frd)
    r_frd_from_ned = wp.transpose(r_ned_from_frd)
    omega = body.omega_frd
    wrench = air_wrench(model, body, inputs, r_frd_from_ned)
    force_frd = wrench.force_frd
    torque_frd = wrench.torque_frd
    if around.is_near_ground + around.is_near_obstacle + around.is_near_solid > 0:
        contact = contact_near(model.contact, body, around, r_ned_from_frd, dt)
        force_frd += r_frd_from_ned * contact.force_ned
        torque_frd += contact.torque_frd
        body = touched(model.contact, body, contact)
    body.rotor_speed = wrench.speed
    body.accel_frd = force_frd * model.mass_inv
    middle_accel_frd = body.accel_frd + wp.cross((0.5 * dt) * omega, body.accel_frd)  # the body turns meanwhile
    accel_ned = r_ned_from_frd * middle_accel_frd + _GRAVITY_NED
    middle = omega + (0.5 * dt) * angular_accel(model, omega, torque_frd, wrench.momentum_z)
    body.omega_frd = omega + dt * angular_accel(model, middle, torque_frd, wrench.momentum_z)
    body.gyro_frd = 0.5 * (omega + body.omega_frd)
    return moved(body, accel_ned, dt)


@wp.func
def step_inputs(
    model: MultirotorModel, body: BodyState, command: vec8, wind_ned: wp.vec3, world: World, dt: float
) -> StepInputs:
    """All that stays the same over the substeps of a tick."""
    inputs = StepInputs()
    inputs.dt = dt
    inputs.wind_ned = wind_ned
    inputs.around = look_around(world, model.contact, body.pos_ned)
    inputs.height_agl_m = inputs.around.height_agl_m
    if world.solids.count > 0:
        inputs.height_agl_m = -body.pos_ned[2] - surface_height(world, body.pos_ned)
        rot = wp.quat_to_matrix(body.q_ned_from_frd)
        inputs.around = look_along_legs(world, model.contact, inputs.around, rot)
    if world.neighbours.count > 0:
        rot = wp.quat_to_matrix(body.q_ned_from_frd)
        inputs.around = look_at_deck(world, model.contact, inputs.around, rot)
    inputs.density_ratio = density_ratio(model, body.pos_ned[2])
    inputs.rotor_inertia_rate = model.rotor_inertia_kg_m2 / dt
    inputs.gain_up = lag_gain(model.spin_up_time_s, dt)
    inputs.gain_down = lag_gain(model.spin_down_time_s, dt)
    if body.is_crashed == 0:
        inputs.rotor_target = rotor_targets(model, command, body.battery_voltage_v)
        inputs.lift_ratio = ground_effect(model.rotor_radius_m, inputs.height_agl_m + model.rotor_height_m)
    return inputs


@wp.func
def drain_battery(model: MultirotorModel, body: BodyState, density: float, dt: float) -> BodyState:
    """Voltage, current and charge after dt [s] of the rotors' aerodynamic power and the avionics'."""
    cubes = float(0.0)
    for r in range(model.rotor_count):
        w = body.rotor_speed[r]
        cubes += w * w * w
    power_w = model.battery.avionics_w + density * model.torque_n_m_s2 * cubes / model.battery.motor_efficiency
    after = discharged(model.battery, body.battery_charge_c, body.battery_rounding_c, power_w, dt)
    body.battery_charge_c = after.charge_c
    body.battery_rounding_c = after.rounding_c
    body.battery_voltage_v = after.voltage_v
    body.battery_current_a = after.current_a
    return body


@wp.func
def held_tick(body: BodyState, dt: float) -> BodyState:
    """A step of dt [s] of a vehicle that is held in its place and turned at omega_frd, rotors stopped."""
    body = held(body, dt)
    body.rotor_speed = vec8()
    return body


@wp.func
def body_tick(model: MultirotorModel, body: BodyState, command: vec8, wind_ned: wp.vec3, world: World) -> BodyState:
    """One tick: four substeps, accel_frd and gyro_frd as means over them, then the battery."""
    if body.is_held == 1:
        return held_tick(body, TICK_S)
    inputs = step_inputs(model, body, command, wind_ned, world, _SUBSTEP_S)
    body.height_agl_m = inputs.height_agl_m
    body.is_on_ground = 0
    accel_sum = wp.vec3()
    gyro_sum = wp.vec3()
    substeps = int(_SUBSTEP_COUNT)  # a dynamic loop: unrolled it is a tenth slower
    for _step in range(substeps):
        body = _substep(model, body, inputs)
        inputs.around.obstacle_shift_ned += inputs.dt * inputs.around.obstacle_vel_ned
        accel_sum += body.accel_frd
        gyro_sum += body.gyro_frd
    body.accel_frd = accel_sum / float(_SUBSTEP_COUNT)
    body.gyro_frd = gyro_sum / float(_SUBSTEP_COUNT)
    return drain_battery(model, body, inputs.density_ratio, TICK_S)


@wp.func
def body_substep(model: MultirotorModel, body: BodyState, command: vec8, wind_ned: wp.vec3, world: World) -> BodyState:
    """One substep alone, for whoever flies it at 1,000 Hz: accel_frd and gyro_frd are its means."""
    if body.is_held == 1:
        return held_tick(body, _SUBSTEP_S)
    inputs = step_inputs(model, body, command, wind_ned, world, _SUBSTEP_S)
    body.height_agl_m = inputs.height_agl_m
    body.is_on_ground = 0
    body = _substep(model, body, inputs)
    return drain_battery(model, body, inputs.density_ratio, _SUBSTEP_S)


@wp.func
def body_truth(body: BodyState) -> Truth:
    """What others may read of the body."""
    truth = truth_of(body)
    truth.motor_speed = body.rotor_speed
    return truth


@wp.func
def body_at_rest(model: MultirotorModel, pos_ned: wp.vec3, yaw_rad: float) -> BodyState:
    """A vehicle level and still at pos_ned, rotors stopped, battery full."""
    return rested(BodyState(), model.battery, pos_ned, yaw_rad)


@wp.func
def standing_height(model: MultirotorModel) -> float:
    """Of the centre of gravity over the ground [m] that its feet stand on."""
    return model.contact.leg_frd[2]
