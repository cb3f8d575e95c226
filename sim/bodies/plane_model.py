"""The constants of a plane's body, from its airframe file."""

import math

import warp as wp

from common.airframes.plane import Gear, PlaneAirframe
from common.geodesy import DEFAULT_HOME, GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S, vec8
from sim.battery import BatteryModel, battery_model
from sim.bodies.contact import ContactModel
from sim.bodies.rigid_body import density_ratio_at, lag_gain

wp.set_module_options({"enable_backward": False})

WHEELS = 3  # nose, left, right
HULL_POINTS = 4  # that scrape on every plane: wing tips, nose, tail
_NORMAL_RATE_RAD_S = 32.0  # guess: it bounces at 5 Hz on its gear
_TANGENT_RATE_RAD_S = 90.0  # guess: as stiff as 1 ms steps allow with room
_SCRAPE_RATE_RAD_S = 60.0  # guess: of a wing tip that touches
_SLIDE_RATE_S = 18.0  # guess: friction of a point that hardly moves, over its speed and the mass
_DAMPING_RATIO = 0.7  # guess: a landing does not bounce


@wp.struct
class PlaneModel:
    """Constants of one airframe at one place. Coefficients as in the airframe file; angles [rad]."""

    mass_kg: float
    mass_inv: float  # [1/kg]
    inertia_frd: wp.mat33  # [kg m²]
    inertia_inv_frd: wp.mat33
    area_m2: float
    span_m: float
    chord_m: float
    stall_angle: float
    stall_sharpness: float
    induced: float  # drag over squared lift, of coefficients: 1 / (pi e AR)
    lift: vec8  # 0, alpha, q, elevator; drag: parasitic, elevator
    pitch: wp.vec4  # 0, alpha, q, elevator
    side: vec8  # beta, p, r, aileron, rudder
    roll: vec8
    yaw: vec8
    surface_max: wp.vec3  # aileron, elevator, rudder
    surface_gain: float  # fraction of the way to its target that a servo goes in a substep
    surface_step: float  # [rad] greatest way in a substep
    prop_diameter_m: float
    prop_x_m: float
    c_t: wp.vec3  # 0, 1, 2
    c_q: wp.vec3
    free_advance: float  # advance ratio at which the propeller turns without torque
    motor_v_s: float
    motor_ohm: float
    idle_current_a: float
    motor_gain: float  # fraction of the way to its target that the speed goes in a substep
    wheel_x: wp.vec3  # [m] lowest points of the wheels, frd, without load
    wheel_y: wp.vec3
    wheel_z: float
    steering_max: float
    rolling_resistance: float
    brake_friction: float
    side_friction: float
    wheel_count: int  # 0: it stands on its belly
    point_x: vec8  # [m] what scrapes: left and right wing tip, nose, tail, two points of a belly, frd
    point_y: vec8
    point_z: vec8
    point_count: int
    scrape_n_m: float
    scrape_n_s_m: float
    slide_n_s_m: float
    contact: ContactModel  # of each wheel, and the hull sphere
    standing_m: float  # centre of gravity over the ground at rest
    home_density_ratio: float  # air density at home over that at sea level
    battery: BatteryModel


def _contact(airframe: PlaneAirframe) -> ContactModel:
    """Springs of a wheel, and the sphere that meets obstacles."""
    body, height_m = airframe.body, airframe.standing_height_m
    model = ContactModel()
    model.reach_m = max(0.5 * airframe.wing.span_m, airframe.hull.tail_x_m, airframe.hull.nose_x_m, height_m)
    model.hull_radius_m = airframe.hull.radius_m
    model.crash_speed_m_s = airframe.hull.crash_speed_m_s
    model.normal_n_m = body.mass_kg * _NORMAL_RATE_RAD_S**2 / WHEELS
    model.normal_n_s_m = 2.0 * _DAMPING_RATIO * body.mass_kg * _NORMAL_RATE_RAD_S / WHEELS
    inertia_kg_m2 = min(body.inertia_xx_kg_m2, body.inertia_yy_kg_m2)
    wheel_mass_kg = 1.0 / (1.0 / body.mass_kg + height_m**2 / inertia_kg_m2)  # a push there also turns it
    model.tangent_n_m = wheel_mass_kg * _TANGENT_RATE_RAD_S**2 / WHEELS
    model.tangent_n_s_m = 2.0 * _DAMPING_RATIO * wheel_mass_kg * _TANGENT_RATE_RAD_S / WHEELS
    return model


def _set_air(model: PlaneModel, airframe: PlaneAirframe) -> None:
    wing, lift, side, surfaces = airframe.wing, airframe.lift, airframe.side, airframe.surfaces
    model.area_m2, model.span_m, model.chord_m = wing.area_m2, wing.span_m, wing.chord_m
    model.stall_angle, model.stall_sharpness = wing.stall_angle_rad, wing.stall_sharpness
    model.induced = 1.0 / (math.pi * wing.efficiency * airframe.aspect_ratio)
    model.lift = vec8(
        lift.c_l_0, lift.c_l_alpha, lift.c_l_q, lift.c_l_elevator, lift.c_d_p, lift.c_d_elevator, 0.0, 0.0
    )
    model.pitch = wp.vec4(lift.c_m_0, lift.c_m_alpha, lift.c_m_q, lift.c_m_elevator)
    for name, row in (("y", "side"), ("roll", "roll"), ("yaw", "yaw")):
        values = [getattr(side, f"c_{name}_{of}") for of in ("beta", "p", "r", "aileron", "rudder")]
        setattr(model, row, vec8(*values, 0.0, 0.0, 0.0))
    model.surface_max = wp.vec3(surfaces.aileron_max_rad, surfaces.elevator_max_rad, surfaces.rudder_max_rad)
    model.surface_gain = lag_gain(surfaces.lag_s, TICK_S / SUBSTEPS)
    model.surface_step = surfaces.rate_rad_s * TICK_S / SUBSTEPS


def _set_propeller(model: PlaneModel, airframe: PlaneAirframe) -> None:
    data = airframe.propeller
    model.prop_diameter_m, model.prop_x_m = data.diameter_m, data.x_m
    model.c_t = wp.vec3(data.c_t_0, data.c_t_1, data.c_t_2)
    model.c_q = wp.vec3(data.c_q_0, data.c_q_1, data.c_q_2)
    model.free_advance = data.free_advance
    model.motor_v_s, model.motor_ohm = data.motor_constant_v_s, data.motor_resistance_ohm
    model.idle_current_a = data.idle_current_a
    model.motor_gain = lag_gain(data.lag_s, TICK_S / SUBSTEPS)


def _set_gear(model: PlaneModel, gear: Gear, mass_kg: float) -> None:
    half_m = 0.5 * gear.track_m
    model.wheel_count = WHEELS
    model.wheel_x = wp.vec3(gear.nose_x_m, -gear.main_x_m, -gear.main_x_m)
    model.wheel_y = wp.vec3(0.0, -half_m, half_m)
    model.wheel_z = gear.height_m
    model.steering_max = gear.steering_max_rad
    model.rolling_resistance, model.brake_friction = gear.rolling_resistance, gear.brake_friction
    model.side_friction = gear.side_friction
    # At rest each wheel bears what the lever arms give it; the centre sinks as all three together.
    model.standing_m = gear.height_m - mass_kg * GRAVITY_M_S2 / (WHEELS * model.contact.normal_n_m)


def _set_ground(model: PlaneModel, airframe: PlaneAirframe) -> None:
    hull, mass_kg, tip_m = airframe.hull, airframe.body.mass_kg, 0.5 * airframe.wing.span_m
    points = [(0.0, -tip_m, hull.tip_z_m), (0.0, tip_m, hull.tip_z_m), (hull.nose_x_m, 0.0, 0.0)]
    points.append((-hull.tail_x_m, 0.0, hull.tail_z_m))
    model.scrape_n_m = 0.25 * mass_kg * _SCRAPE_RATE_RAD_S**2
    model.scrape_n_s_m = 0.25 * _DAMPING_RATIO * mass_kg * _SCRAPE_RATE_RAD_S
    model.slide_n_s_m = mass_kg * _SLIDE_RATE_S
    model.contact = _contact(airframe)
    if airframe.gear is not None:
        _set_gear(model, airframe.gear, mass_kg)
    belly = airframe.belly
    if belly is not None:
        points += [(belly.front_x_m, 0.0, belly.depth_m), (-belly.rear_x_m, 0.0, belly.depth_m)]
        model.standing_m = belly.depth_m - mass_kg * GRAVITY_M_S2 / (2.0 * model.scrape_n_m)
    model.point_count = len(points)
    points += [(0.0, 0.0, 0.0)] * (8 - len(points))
    model.point_x, model.point_y, model.point_z = (vec8(*axis) for axis in zip(*points, strict=True))


def plane_model(airframe: PlaneAirframe, home_alt_amsl_m: float = DEFAULT_HOME.alt_m) -> PlaneModel:
    """Constants of an airframe whose home lies home_alt_amsl_m above sea level."""
    body = airframe.body
    model = PlaneModel()
    model.mass_kg, model.mass_inv = body.mass_kg, 1.0 / body.mass_kg
    xz = airframe.wing.inertia_xz_kg_m2
    model.inertia_frd = wp.mat33(
        body.inertia_xx_kg_m2, 0.0, -xz, 0.0, body.inertia_yy_kg_m2, 0.0, -xz, 0.0, body.inertia_zz_kg_m2
    )
    model.inertia_inv_frd = wp.inverse(model.inertia_frd)
    _set_air(model, airframe)
    _set_propeller(model, airframe)
    _set_ground(model, airframe)
    model.home_density_ratio = density_ratio_at(home_alt_amsl_m)
    model.battery = battery_model(airframe)
    return model
