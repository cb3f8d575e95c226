"""The smallest second class of vehicles: a sled on the ground, with one signed actuator that pushes and pulls it.

A body and a control law, each as data and kernel functions, and nothing else: the loop, the sensors, the estimator and
the rigs are those of every vehicle. Like this a class is added.
"""

import warp as wp

from autopilot.control.law import ControlLaw
from autopilot.ports import Actuators, BatterySample, Estimate, Setpoint
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S, vec8
from common.params import Parameter
from common.rotation import quat_from_yaw
from sim.bodies.body import Body
from sim.truth import Truth
from sim.world.world import World, ground_height

wp.set_module_options({"enable_backward": False})

STANDING_M = wp.constant(0.1)
_TICK_S = wp.constant(TICK_S)
_GRAVITY = wp.constant(GRAVITY_M_S2)

SLED_PARAMETERS = (Parameter("SLED_SPEED_P", 0.5, 0.0, 10.0, "s/m", "command per error of speed", "guess", "speed_p"),)


@wp.struct
class SledModel:
    mass_kg: float
    push_n: float
    friction_n_s_m: float


@wp.struct
class SledState:
    pos_ned: wp.vec3
    vel_ned: wp.vec3
    q_ned_from_frd: wp.quat
    accel_frd: wp.vec3
    impact_speed: float


@wp.func
def sled_tick(model: SledModel, state: SledState, command: vec8, wind_ned: wp.vec3, world: World) -> SledState:
    """Along its nose only, on the ground."""
    nose_ned = wp.quat_rotate(state.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
    speed = wp.dot(state.vel_ned, nose_ned)
    push_n = model.push_n * wp.clamp(command[0], -1.0, 1.0)
    accel = (push_n - model.friction_n_s_m * speed) / model.mass_kg
    state.vel_ned = (speed + accel * _TICK_S) * nose_ned
    state.pos_ned = state.pos_ned + state.vel_ned * _TICK_S
    state.pos_ned[2] = -ground_height(world, state.pos_ned[0], state.pos_ned[1]) - STANDING_M
    state.accel_frd = wp.vec3(accel, 0.0, -_GRAVITY)
    return state


@wp.func
def sled_truth(state: SledState) -> Truth:
    truth = Truth()
    truth.pos_ned = state.pos_ned
    truth.vel_ned = state.vel_ned
    truth.q_ned_from_frd = state.q_ned_from_frd
    truth.accel_frd = state.accel_frd
    truth.height_agl_m = STANDING_M
    truth.battery_voltage_v = 12.0
    truth.is_on_ground = 1
    truth.impact_speed = state.impact_speed
    return truth


@wp.func
def sled_at_rest(model: SledModel, pos_ned: wp.vec3, yaw: float) -> SledState:
    state = SledState()
    state.pos_ned = pos_ned
    state.q_ned_from_frd = quat_from_yaw(yaw)
    state.accel_frd = wp.vec3(0.0, 0.0, -_GRAVITY)
    return state


@wp.func
def sled_standing_height(model: SledModel) -> float:
    return STANDING_M


def sled_model(_airframe, _home_alt_m):
    model = SledModel()
    model.mass_kg, model.push_n, model.friction_n_s_m = 10.0, 20.0, 2.0
    return model


SLED_BODY = Body(SledModel, SledState, sled_tick, sled_truth, sled_at_rest, sled_standing_height, sled_model)


@wp.struct
class SledParams:
    speed_p: float


@wp.struct
class SledAirframe:
    mass_kg: float


@wp.struct
class SledControl:
    actuators: Actuators


@wp.func
def sled_control(
    params: SledParams,
    airframe: SledAirframe,
    state: SledControl,
    est: Estimate,
    sp: Setpoint,
    battery: BatterySample,
    tick: int,
) -> SledControl:
    """Speed along the nose, forwards and backwards."""
    now = SledControl()
    if sp.is_armed == 1:
        nose_ned = wp.quat_rotate(est.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
        now.actuators.command[0] = params.speed_p * wp.dot(sp.vel_ned - est.vel_ned, nose_ned)
    return now


def _params():
    params = SledParams()
    params.speed_p = 0.5
    return params


def _airframe(_):
    return SledAirframe()


SLED_LAW = ControlLaw(SledParams, SledAirframe, SledControl, sled_control, _params, _airframe, SLED_PARAMETERS)
