"""A car on four wheels as Unity's WheelCollider describes them: a rigid box, four suspensions, four tyres, wheel spin.

Pure functions, one sub-step of one car. Frames are Unity's: x right, y up, z forward, left-handed; the usual formulas
of cross products and quaternions hold as they stand. "car" is the frame of the chassis, its origin the centre of the
box; the ground is the plane y = 0. Tyres follow the documented slip curves, forward and sideways each by itself, as
Unity's manual has it (WheelFrictionCurve): a spinning wheel still steers. Left out: the sway of unsprung wheels, tyre
relaxation, camber, air drag (Unity's default is none).
"""

import warp as wp

from policies.tasks.reach_target.reach_target_params import ReachParams
from sim.bodies.tyre import Tyre, force_per_slip, tyre_of

wp.set_module_options({"enable_backward": False})

SUBSTEPS = 2
"""Per physics step of 20 ms. At 20 ms roll and side force excite each other (rate of roll damping x step = 1.1 of the
2 that explicit integration bears, bump stops and tyres come on top); at 10 ms all rates are below 1. Wheel spin is
solved implicitly and would bear any step."""
STEP_S = 0.02
_SUBSTEP_S = wp.constant(STEP_S / SUBSTEPS)
_RAD = wp.constant(0.017453292519943295)
_UPRIGHT = wp.constant(0.2)  # up·y below which no wheel reaches the ground beside the chassis (guess: 78 deg of tilt)
_TINY = wp.constant(1e-6)


@wp.struct
class Car:
    """The numbers of one car in the form the sub-step needs them."""

    forward: Tyre
    side: Tyre
    half_size: wp.vec3  # [m] of the chassis
    inv_mass: float  # [1/kg]
    weight_n: float
    inertia: wp.vec3  # [kg m²] about the car's axes
    inv_inertia: wp.vec3
    hub: wp.vec3  # [m] where a front right wheel is fixed, car frame
    span_m: float  # within which of the centre all wheels touch the ground
    radius_m: float
    length_m: float  # of a fully extended suspension and the wheel below it
    travel_m: float
    spring_n_m: float
    damper_ns_m: float
    bump_stop_n_m: float
    wheel_inertia: float  # [kg m²]
    wheel_damping: float  # [N m s]
    slip_speed_m_s: float
    turn_damping: float  # [1/s]
    half_platform_m: float
    contact_n_m: float
    contact_ns_m: float
    contact_friction: float


@wp.struct
class Controls:
    """What the driver does, held for a decision."""

    sin_steer: float
    cos_steer: float
    motor_nm: float  # per wheel
    brake_nm: float  # per wheel


@wp.struct
class Motion:
    """State of one car."""

    pos: wp.vec3  # [m] of the centre
    q: wp.quat  # world from car
    vel: wp.vec3  # [m/s] world
    omega_car: wp.vec3  # [rad/s] car
    spin: wp.vec4  # [rad/s] front left, front right, rear left, rear right


@wp.struct
class Wheel:
    """One wheel at the start of a sub-step."""

    hub: wp.vec3  # [m] where its suspension is fixed, car frame
    drop_m: float  # from the hub to the ground along the suspension
    heading: wp.vec3  # where it points in the ground plane, unit, car frame
    spin: float  # [rad/s]


@wp.struct
class WheelPull:
    """What a wheel does to the car, and how fast it turns afterwards."""

    force_car: wp.vec3  # [N]
    moment_car: wp.vec3  # [N m]
    spin: float  # [rad/s]


@wp.func
def car_of(n: ReachParams) -> Car:
    """The car that the numbers describe."""
    car = Car()
    car.forward = tyre_of(n.forward_extremum_slip, n.forward_extremum, n.forward_asymptote_slip, n.forward_asymptote)
    car.forward.peak = car.forward.peak * n.forward_stiffness
    car.forward.tail = car.forward.tail * n.forward_stiffness
    car.side = tyre_of(n.side_extremum_slip, n.side_extremum, n.side_asymptote_slip, n.side_asymptote)
    car.side.peak = car.side.peak * n.side_stiffness
    car.side.tail = car.side.tail * n.side_stiffness
    car.half_size = 0.5 * wp.vec3(n.chassis_width_m, n.chassis_height_m, n.chassis_length_m)
    car.inv_mass = 1.0 / n.mass_kg
    car.weight_n = n.mass_kg * n.gravity_m_s2
    squares = wp.cw_mul(car.half_size, car.half_size) / 3.0
    car.inertia = n.mass_kg * wp.vec3(squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1])
    car.inv_inertia = wp.vec3(1.0 / car.inertia[0], 1.0 / car.inertia[1], 1.0 / car.inertia[2])
    car.hub = wp.vec3(0.5 * n.track_m, n.axle_height_m, 0.5 * n.wheelbase_m)
    car.span_m = wp.length(car.hub) + n.wheel_radius_m + n.suspension_travel_m
    car.radius_m = n.wheel_radius_m
    car.travel_m = n.suspension_travel_m
    car.length_m = n.wheel_radius_m + n.suspension_travel_m
    car.spring_n_m = n.spring_n_m
    car.damper_ns_m = n.damper_ns_m
    car.bump_stop_n_m = n.bump_stop_n_m
    car.wheel_inertia = 0.5 * n.wheel_mass_kg * n.wheel_radius_m * n.wheel_radius_m
    car.wheel_damping = n.wheel_damping_nms
    car.slip_speed_m_s = n.slip_speed_m_s
    car.turn_damping = n.angular_drag_hz
    car.half_platform_m = n.half_platform_m
    car.contact_n_m = n.contact_n_m
    car.contact_ns_m = n.contact_ns_m
    car.contact_friction = n.contact_friction
    return car


@wp.func
def controls_of(n: ReachParams, steer: float, throttle: float, brake: float) -> Controls:
    """What the clipped actions do: steering in [-1, 1] (right is positive), throttle in [-1, 1], brake in [0, 1]."""
    controls = Controls()
    angle = wp.clamp(steer, -1.0, 1.0) * n.steer_max_deg * _RAD
    controls.sin_steer = wp.sin(angle)
    controls.cos_steer = wp.cos(angle)
    controls.motor_nm = wp.clamp(throttle, -1.0, 1.0) * n.motor_torque_nm
    controls.brake_nm = wp.clamp(brake, 0.0, 1.0) * n.brake_torque_nm
    return controls


@wp.func
def spun(car: Car, spin: float, motor_nm: float, brake_nm: float, grip: float, road: float) -> float:
    """Wheel speed one sub-step later, solved for a tyre force that is linear in it.

    The tyre pulls with `road` + grip x radius x spin; brakes are friction: they stop the wheel and never turn it.
    """
    inertia = car.wheel_inertia + _SUBSTEP_S * (car.wheel_damping + grip * car.radius_m * car.radius_m)
    per_inertia = 1.0 / inertia
    free = (car.wheel_inertia * spin + _SUBSTEP_S * (motor_nm - car.radius_m * road)) * per_inertia
    brake = _SUBSTEP_S * brake_nm * per_inertia
    return wp.sign(free) * wp.max(wp.abs(free) - brake, 0.0)


@wp.func
def suspension_load(car: Car, squeeze_m: float, rise_m_s: float) -> float:
    """Force of the ground on a wheel along the ground's normal [N]; never a pull.

    Never more than the car's weight either, four times a wheel's share: a wheel that comes back over an edge lies deep
    in the platform, and all its spring says would throw the car away.
    """
    load = car.spring_n_m * squeeze_m - car.damper_ns_m * rise_m_s
    load += car.bump_stop_n_m * wp.max(squeeze_m - car.travel_m, 0.0)
    return wp.clamp(load, 0.0, car.weight_n)


@wp.func
def wheel_pull(
    car: Car, controls: Controls, wheel: Wheel, up_car: wp.vec3, vel_car: wp.vec3, omega_car: wp.vec3
) -> WheelPull:
    """One wheel for one sub-step; `up_car` is the ground's normal in the car's frame."""
    pull = WheelPull()
    squeeze = car.length_m - wheel.drop_m
    if squeeze <= 0.0:
        pull.spin = spun(car, wheel.spin, controls.motor_nm, controls.brake_nm, 0.0, 0.0)
        return pull
    arm = wp.vec3(wheel.hub[0], wheel.hub[1] - wheel.drop_m, wheel.hub[2])
    vel = vel_car + wp.cross(omega_car, arm)
    side = wp.cross(up_car, wheel.heading)
    along = wp.dot(vel, wheel.heading)
    across = wp.dot(vel, side)
    load = suspension_load(car, squeeze, wp.dot(vel, up_car))
    rim = car.radius_m * wheel.spin
    per_rim = car.forward.per_slip / wp.max(wp.max(wp.abs(along), wp.abs(rim)), car.slip_speed_m_s)
    per_side = car.side.per_slip / wp.max(wp.abs(along), car.slip_speed_m_s)
    grip = load * force_per_slip(car.forward, wp.abs(rim - along) * per_rim) * per_rim
    force_across = -load * force_per_slip(car.side, wp.abs(across) * per_side) * per_side * across
    pull.spin = spun(car, wheel.spin, controls.motor_nm, controls.brake_nm, grip, -grip * along)
    force_along = grip * (car.radius_m * pull.spin - along)
    limit = load * car.forward.peak
    if wp.abs(force_along) > limit:  # the straight line overshoots the curve: the tyre lets go within this sub-step
        force_along = wp.clamp(force_along, -limit, limit)
        pull.spin = spun(car, wheel.spin, controls.motor_nm, controls.brake_nm, 0.0, force_along)
    pull.force_car = load * up_car + force_along * wheel.heading + force_across * side
    pull.moment_car = wp.cross(arm, pull.force_car)
    return pull


@wp.func
def in_ground_plane(direction: wp.vec3, up_car: wp.vec3) -> wp.vec3:
    """The part of a direction that lies in the ground plane, as a unit vector."""
    flat = direction - wp.dot(direction, up_car) * up_car
    return flat * (1.0 / wp.max(wp.length(flat), _TINY))


@wp.func
def drop_to_ground(car: Car, pos: wp.vec3, turn: wp.mat33, up_car: wp.vec3, hub: wp.vec3) -> float:
    """From a hub down the suspension to the platform [m]; out of every wheel's reach where there is none."""
    out_of_reach = 2.0 * car.length_m
    if up_car[1] < _UPRIGHT:
        return out_of_reach
    drop = (pos[1] + wp.dot(up_car, hub)) / up_car[1]
    if wp.max(wp.abs(pos[0]), wp.abs(pos[2])) > car.half_platform_m - car.span_m:
        position = pos + turn @ (hub - wp.vec3(0.0, drop, 0.0))
        if drop < 0.0 or wp.max(wp.abs(position[0]), wp.abs(position[2])) > car.half_platform_m:
            return out_of_reach
    return drop


@wp.func
def scraped(car: Car, motion: Motion, turn: wp.mat33, vel_car: wp.vec3) -> wp.spatial_vector:
    """Force and moment of the platform on the corners of the chassis, car frame: spring, damper and friction."""
    force = wp.vec3(0.0, 0.0, 0.0)
    moment = wp.vec3(0.0, 0.0, 0.0)
    up_car = wp.vec3(turn[1, 0], turn[1, 1], turn[1, 2])
    for k in range(8):
        corner = wp.vec3(
            wp.where(k % 2 == 0, -car.half_size[0], car.half_size[0]),
            wp.where((k // 2) % 2 == 0, -car.half_size[1], car.half_size[1]),
            wp.where(k // 4 == 0, -car.half_size[2], car.half_size[2]),
        )
        position = motion.pos + turn @ corner
        if position[1] < 0.0 and wp.max(wp.abs(position[0]), wp.abs(position[2])) <= car.half_platform_m:
            vel = vel_car + wp.cross(motion.omega_car, corner)
            rise = wp.dot(vel, up_car)
            load = wp.clamp(-car.contact_n_m * position[1] - car.contact_ns_m * rise, 0.0, car.weight_n)
            slide = vel - rise * up_car
            pull = load * (up_car - car.contact_friction * slide / wp.max(wp.length(slide), car.slip_speed_m_s))
            force += pull
            moment += wp.cross(corner, pull)
    return wp.spatial_vector(force, moment)


@wp.func
def lowest_m(car: Car, pos: wp.vec3, turn: wp.mat33) -> float:
    """Height of the lowest corner of the chassis [m]."""
    half = car.half_size
    return pos[1] - half[0] * wp.abs(turn[1, 0]) - half[1] * wp.abs(turn[1, 1]) - half[2] * wp.abs(turn[1, 2])


@wp.func
def driven(car: Car, controls: Controls, motion: Motion) -> Motion:
    """The car one sub-step later (semi-implicit Euler, as PhysX integrates)."""
    turn = wp.quat_to_matrix(motion.q)
    up_car = wp.vec3(turn[1, 0], turn[1, 1], turn[1, 2])
    vel_car = wp.transpose(turn) @ motion.vel
    force = wp.vec3(0.0, 0.0, 0.0)
    moment = wp.vec3(0.0, 0.0, 0.0)
    ahead = in_ground_plane(wp.vec3(0.0, 0.0, 1.0), up_car)
    steered = in_ground_plane(wp.vec3(controls.sin_steer, 0.0, controls.cos_steer), up_car)
    spin = motion.spin
    for k in range(4):
        wheel = Wheel()
        x = wp.where(k % 2 == 0, -car.hub[0], car.hub[0])
        wheel.hub = wp.vec3(x, car.hub[1], wp.where(k < 2, car.hub[2], -car.hub[2]))
        wheel.heading = ahead
        if k < 2:
            wheel.heading = steered
        wheel.drop_m = drop_to_ground(car, motion.pos, turn, up_car, wheel.hub)
        wheel.spin = spin[k]
        pull = wheel_pull(car, controls, wheel, up_car, vel_car, motion.omega_car)
        force += pull.force_car
        moment += pull.moment_car
        spin[k] = pull.spin
    if lowest_m(car, motion.pos, turn) < 0.0:
        scrape = scraped(car, motion, turn, vel_car)
        force += wp.spatial_top(scrape)
        moment += wp.spatial_bottom(scrape)
    result = Motion()
    result.spin = spin
    accel = car.inv_mass * (turn @ force - wp.vec3(0.0, car.weight_n, 0.0))
    result.vel = motion.vel + _SUBSTEP_S * accel
    result.pos = motion.pos + _SUBSTEP_S * result.vel
    omega = motion.omega_car
    gyro = wp.cross(omega, wp.cw_mul(car.inertia, omega))
    omega += _SUBSTEP_S * wp.cw_mul(car.inv_inertia, moment - gyro)
    result.omega_car = omega * (1.0 - _SUBSTEP_S * car.turn_damping)
    half = 0.5 * _SUBSTEP_S * result.omega_car
    result.q = wp.normalize(motion.q + motion.q * wp.quat(half[0], half[1], half[2], 0.0))
    return result


@wp.func
def is_edge_struck(car: Car, motion: Motion) -> bool:
    """Whether an edge of the platform runs through the chassis."""
    is_struck = bool(False)
    half = car.half_platform_m
    if wp.max(wp.abs(motion.pos[0]), wp.abs(motion.pos[2])) > half - wp.length(car.half_size):
        turn = wp.transpose(wp.quat_to_matrix(motion.q))
        for k in range(4):
            far = wp.where(k % 2 == 0, -half, half)
            middle = wp.where(k < 2, wp.vec3(far, 0.0, 0.0), wp.vec3(0.0, 0.0, far))
            along = wp.where(k < 2, wp.vec3(0.0, 0.0, half), wp.vec3(half, 0.0, 0.0))
            if is_box_crossed(car.half_size, turn @ (middle - motion.pos), turn @ along):
                is_struck = True
    return is_struck


@wp.func
def is_box_crossed(half_size: wp.vec3, middle: wp.vec3, along: wp.vec3) -> bool:
    """Whether the segment middle ± along meets a box about the origin (slab method, Kay and Kajiya 1986)."""
    first = float(-1.0)
    last = float(1.0)
    for axis in range(3):
        step = wp.where(wp.abs(along[axis]) < _TINY, _TINY, along[axis])
        one = (-half_size[axis] - middle[axis]) / step
        other = (half_size[axis] - middle[axis]) / step
        first = wp.max(first, wp.min(one, other))
        last = wp.min(last, wp.max(one, other))
    return first <= last


@wp.func
def is_chassis_hit(car: Car, motion: Motion) -> bool:
    """Whether the chassis touches the platform: it has rolled over, or strikes an edge."""
    turn = wp.quat_to_matrix(motion.q)
    is_hit = is_edge_struck(car, motion)
    if lowest_m(car, motion.pos, turn) < 0.0 and not is_hit:
        half = car.half_platform_m
        for k in range(8):
            corner = wp.vec3(
                wp.where(k % 2 == 0, -car.half_size[0], car.half_size[0]),
                wp.where((k // 2) % 2 == 0, -car.half_size[1], car.half_size[1]),
                wp.where(k // 4 == 0, -car.half_size[2], car.half_size[2]),
            )
            position = motion.pos + turn @ corner
            if position[1] < 0.0 and wp.max(wp.abs(position[0]), wp.abs(position[2])) <= half:
                is_hit = True
    return is_hit
