"""What flown tasks do with a vehicle's row: vary it at an episode's start, command it, read it, judge a touch.

Kernel functions over the arrays of a rig; truth and estimate are told apart by name.
"""

from typing import Any

import warp as wp

from autopilot.ports import SETPOINT_TRAJECTORY, Estimate, Setpoint
from policies.tasks.flight.episode_draws import WIND_STREAM, draw_angle
from policies.tasks.flight.flight_params import FlightParams
from policies.tasks.flight.own_state import Command, OwnState
from sim.advance import RigArrays, forget_impacts
from sim.sensors.sensors import SensorModel
from sim.truth import true_estimate
from sim.wind import WindModel, WindState

wp.set_module_options({"enable_backward": False})

NOISE_LEVELS_PER_UNIT = 4  # the sensors' noise scale is rounded to a quarter
_LEVELS = wp.constant(float(NOISE_LEVELS_PER_UNIT))


@wp.struct
class Makes:
    """What vehicles carry before they are varied."""

    sensors: wp.array(dtype=SensorModel)  # by noise scale: 0, 0.25, 0.5 ...


@wp.func
def sensors_of_episode(makes: Makes, params: FlightParams) -> SensorModel:
    """The sensors with the noise of an episode."""
    level = int(wp.round(params.sensor_noise * _LEVELS))
    return makes.sensors[wp.min(level, makes.sensors.shape[0] - 1)]


@wp.func
def wind_of_episode(wind: WindModel, params: FlightParams, seed: int, i: int, episode: int) -> WindModel:
    """The air of an episode, from a direction that is drawn."""
    towards = draw_angle(seed, i, episode, WIND_STREAM)
    wind.along_ned = wp.vec3(wp.cos(towards), wp.sin(towards), 0.0)
    wind.mean_ned = wind.along_ned * params.wind_m_s
    wind.gust_m_s = params.wind_gust_m_s
    wind.turbulence_w_std = 0.1 * params.wind_m_s * params.wind_turbulence  # MIL-F-8785C: a tenth of W20
    return wind


@wp.func
def vary_vehicle(rig: RigArrays, makes: Makes, params: FlightParams, seed: int, i: int, episode: int) -> None:
    """Gives row i the air, the sensors, the mass and the motors of its episode."""
    model = rig.model[i]  # as its hover has it
    model.mass_kg = model.mass_kg * params.mass_scale
    model.mass_inv = model.mass_inv / params.mass_scale
    model.inertia_frd = model.inertia_frd * params.mass_scale
    model.inertia_inv_frd = model.inertia_inv_frd / params.mass_scale
    model.thrust_n_s2 = model.thrust_n_s2 * params.motor_scale
    rig.model[i] = model
    rig.sensor_model[i] = sensors_of_episode(makes, params)
    rig.wind_model[i] = wind_of_episode(rig.wind_model[i], params, seed, i, episode)
    rig.wind[i] = WindState()
    forget_impacts(rig, i)  # that of standing on the ground before the hover


@wp.func
def free_setpoint(kind: int) -> Setpoint:
    """Of an armed vehicle, nothing asked for."""
    free = wp.vec3(wp.nan, wp.nan, wp.nan)
    setpoint = Setpoint()
    setpoint.kind = kind
    setpoint.is_armed = 1
    setpoint.pos_ned = free
    setpoint.vel_ned = free
    setpoint.accel_ned = free
    setpoint.yaw = wp.nan
    setpoint.yaw_rate = wp.nan
    setpoint.path_start_ned = free
    setpoint.cruise_speed = wp.nan
    setpoint.climb_speed = wp.nan
    setpoint.descend_speed = wp.nan
    setpoint.omega_frd = free
    setpoint.thrust = wp.nan
    setpoint.speed = wp.nan
    setpoint.steering = wp.nan
    return setpoint


@wp.func
def velocity_setpoint(command: Command) -> Setpoint:
    """As an offboard client's SET_POSITION_TARGET_LOCAL_NED with velocity and yaw rate."""
    setpoint = free_setpoint(SETPOINT_TRAJECTORY)
    setpoint.vel_ned = command.vel_ned
    setpoint.yaw_rate = command.yaw_rate
    return setpoint


@wp.func
def vehicle_estimate(rig: Any, i: int, has_estimator: int) -> Estimate:
    """What the flight controller takes for its state: its estimate, or in quick training the truth in its place."""
    if has_estimator == 1:
        return rig.autopilot.ekf.rows[i].estimate
    return true_estimate(rig.truth[i], rig.tick[i])


@wp.func
def own_state(rig: Any, i: int, has_estimator: int) -> OwnState:
    """What a policy is told of its vehicle."""
    estimate = vehicle_estimate(rig, i, has_estimator)
    own = OwnState()
    own.pos_ned = estimate.pos_ned
    own.vel_ned = estimate.vel_ned
    own.q_ned_from_frd = estimate.q_ned_from_frd
    own.yaw_rate = wp.quat_rotate(estimate.q_ned_from_frd, estimate.omega_frd)[2]
    if has_estimator == 1:
        sample = rig.sensors[i].samples.range
        own.height_m = sample.distance_m * wp.quat_rotate(estimate.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))[2]
        own.is_height_valid = sample.is_valid
    else:
        own.height_m = rig.truth[i].height_agl_m
        own.is_height_valid = 1
    return own
