"""The constants of a rover's body, from its airframe file."""

import warp as wp

from common.airframes.rover import RoverAirframe
from common.geodesy import DEFAULT_HOME, GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S
from sim.battery import BatteryModel, battery_model
from sim.bodies.rigid_body import density_ratio_at, lag_gain
from sim.bodies.tyre import Tyre, tyre_of

wp.set_module_options({"enable_backward": False})

_SCRAPE_RATE_RAD_S = 60.0  # guess: as stiff as 1 ms steps allow with room
_STANDSTILL_DAMPING = 0.35  # guess: of a tyre that is pushed and does not roll
_KNEE = 3.0  # guess: slip from which a tyre only slides, over that of the peak


@wp.struct
class RoverModel:
    """Constants of one airframe at one place. Wheels: front left, front right, rear left, rear right."""

    mass_kg: float
    mass_inv: float  # [1/kg]
    inertia_frd: wp.vec3  # [kg m²] diagonal
    inertia_inv_frd: wp.vec3
    drag_area_frd: wp.vec3  # [m²] c_d A along each axis
    hub_x: wp.vec4  # [m] of the wheels, frd
    hub_y: wp.vec4
    hub_z: float  # without load
    radius_m: float
    wheel_inertia_inv: float  # [1/(kg m²)]
    spring_n_m: float
    damper_n_s_m: float
    rolling_resistance: float
    tyre: Tyre
    peak_deflection_m: float  # of a tyre where its force is greatest
    relaxation_inv: float  # [1/m]
    standstill_n_s_m: float  # damping of a tyre that does not roll, over its load at rest
    is_skid: int
    wheel_base_m: float
    half_track_m: float
    steering_max_rad: float
    steering_rate_rad_s: float
    steering_gain: float  # fraction of the way to its target that the servo goes in a tick
    is_driven: wp.vec4  # share of the driving force that each wheel has
    motor_speed_m_s: float  # of the treads, at full command and full battery
    motor_n_s_m: float  # force over missing speed, all treads together
    motor_max_n: float
    motor_gain: float  # fraction of the way to its target that the force goes in a substep
    brake_max_n: wp.vec2  # of each front and each rear wheel
    hull_front_m: float
    hull_rear_m: float
    hull_half_width_m: float
    hull_top_m: float
    hull_bottom_m: float
    hull_reach_m: float  # of the farthest corner
    standing_m: float  # centre of gravity over the ground at rest
    scrape_n_m: float  # of a corner of the hull on the ground or at an obstacle
    scrape_n_s_m: float
    crash_speed_m_s: float
    home_density_ratio: float  # air density at home over that at sea level
    battery: BatteryModel


def rover_model(airframe: RoverAirframe, home_alt_amsl_m: float = DEFAULT_HOME.alt_m) -> RoverModel:
    """Constants of an airframe whose home lies home_alt_amsl_m above sea level."""
    body, wheels, tyres, drive, hull = airframe.body, airframe.wheels, airframe.tyres, airframe.drive, airframe.hull
    step_s = TICK_S / SUBSTEPS
    model = RoverModel()
    model.mass_kg = body.mass_kg
    model.mass_inv = 1.0 / body.mass_kg
    model.inertia_frd = wp.vec3(body.inertia_xx_kg_m2, body.inertia_yy_kg_m2, body.inertia_zz_kg_m2)
    model.inertia_inv_frd = wp.vec3(*(1.0 / moment for moment in model.inertia_frd))
    model.drag_area_frd = wp.vec3(body.drag_area_x_m2, body.drag_area_y_m2, body.drag_area_z_m2)
    half_m = 0.5 * wheels.track_m
    model.hub_x = wp.vec4(wheels.front_x_m, wheels.front_x_m, -wheels.rear_x_m, -wheels.rear_x_m)
    model.hub_y = wp.vec4(-half_m, half_m, -half_m, half_m)
    model.hub_z = wheels.hub_z_m
    model.radius_m = wheels.radius_m
    model.wheel_inertia_inv = 1.0 / wheels.inertia_kg_m2
    model.spring_n_m = wheels.spring_n_m
    model.damper_n_s_m = wheels.damper_n_s_m
    model.rolling_resistance = wheels.rolling_resistance
    model.tyre = tyre_of(1.0, tyres.friction, _KNEE, tyres.sliding_friction)
    model.peak_deflection_m = tyres.peak_slip * tyres.relaxation_m
    model.relaxation_inv = 1.0 / tyres.relaxation_m
    stiffness_per_n = 2.0 * tyres.friction / model.peak_deflection_m
    model.standstill_n_s_m = 2.0 * _STANDSTILL_DAMPING * (stiffness_per_n / GRAVITY_M_S2) ** 0.5
    model.is_skid = int(airframe.is_skid)
    model.wheel_base_m = airframe.wheel_base_m
    model.half_track_m = half_m
    model.steering_max_rad = airframe.steering.max_angle_rad
    model.steering_rate_rad_s = airframe.steering.rate_rad_s
    model.steering_gain = lag_gain(airframe.steering.lag_s, TICK_S)
    is_rear = drive.driven == "rear"
    model.is_driven = wp.vec4(0.0, 0.0, 0.5, 0.5) if is_rear else wp.vec4(0.25, 0.25, 0.25, 0.25)
    model.motor_speed_m_s = drive.max_speed_m_s
    model.motor_n_s_m = drive.stall_force_n / drive.max_speed_m_s
    model.motor_max_n = drive.max_force_n
    model.motor_gain = lag_gain(drive.lag_s, step_s)
    front = airframe.brake.front_fraction
    model.brake_max_n = 0.5 * airframe.brake.max_force_n * wp.vec2(front, 1.0 - front)
    model.hull_front_m, model.hull_rear_m = hull.front_m, hull.rear_m
    model.hull_half_width_m = hull.half_width_m
    model.hull_top_m, model.hull_bottom_m = hull.top_m, hull.bottom_m
    farthest = wp.vec3(max(hull.front_m, hull.rear_m), hull.half_width_m, max(hull.top_m, hull.bottom_m))
    model.hull_reach_m = float(wp.length(farthest))
    model.standing_m = wheels.hub_z_m + wheels.radius_m - body.mass_kg * GRAVITY_M_S2 / (4.0 * wheels.spring_n_m)
    model.scrape_n_m = body.mass_kg * _SCRAPE_RATE_RAD_S**2 / 2.0
    model.scrape_n_s_m = 2.0 * 0.5 * body.mass_kg * _SCRAPE_RATE_RAD_S / 2.0
    model.crash_speed_m_s = hull.crash_speed_m_s
    model.home_density_ratio = density_ratio_at(home_alt_amsl_m)
    model.battery = battery_model(airframe)
    return model
