"""The loop: from motor commands to the true state, to samples, to the estimate, to motor commands, at 250 Hz.

One launch advances every vehicle by any number of ticks of 4 ms. Read the kernel `advance` first: it is the whole
simulator, in time order. With `has_estimator` False the flight controller is given the true state instead of an
estimate: a shortcut for training, never used in a flight.
"""

from typing import Any

import warp as wp

from autopilot.advance import Autopilot
from autopilot.control.control import ControlState, control_tick
from autopilot.estimator.ekf import estimator_reset, estimator_step
from autopilot.ports import (
    HEIGHT_VALID,
    POSITION_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
    BatterySample,
    Estimate,
    Setpoint,
    contact,
)
from common.kernels import GRAVITY_M_S2, TICK_S, tick_end_us
from common.rng import draw_tick
from sim.bodies.multirotor import BodyState, MultirotorModel, body_at_rest, body_tick
from sim.faults import Faults, weakened
from sim.sensors.sensors import SensorModel, SensorState, sense
from sim.wind import WindModel, WindState, wind_step
from sim.world.world import World, ground_height

wp.set_module_options({"enable_backward": False})


@wp.struct
class RigArrays:
    """The vehicles, their surroundings and their flight controllers; arrays but `worlds` have one row per vehicle."""

    worlds: wp.array(dtype=World)
    i_world: wp.array(dtype=int)  # the world that each vehicle is in
    tick: wp.array(dtype=wp.int64)  # ticks since power-on
    seed: wp.array(dtype=int)
    model: wp.array(dtype=MultirotorModel)
    body: wp.array(dtype=BodyState)
    wind_model: wp.array(dtype=WindModel)
    wind: wp.array(dtype=WindState)
    sensor_model: wp.array(dtype=SensorModel)
    sensors: wp.array(dtype=SensorState)
    faults: wp.array(dtype=Faults)
    autopilot: Autopilot


@wp.func
def true_estimate(body: BodyState, tick: wp.int64) -> Estimate:
    """The true state in the place of an estimate."""
    estimate = Estimate()
    estimate.time_us = tick_end_us(tick)
    estimate.flags = TILT_ALIGNED | YAW_ALIGNED | VELOCITY_VALID | POSITION_VALID | HEIGHT_VALID
    estimate.q_ned_from_frd = body.q_ned_from_frd
    estimate.omega_frd = body.omega_frd
    estimate.accel_frd = body.accel_frd
    estimate.vel_ned = body.vel_ned
    estimate.pos_ned = body.pos_ned
    estimate.accel_ned = wp.quat_rotate(body.q_ned_from_frd, body.accel_frd) + wp.vec3(0.0, 0.0, GRAVITY_M_S2)
    return estimate


@wp.func
def true_battery(body: BodyState, tick: wp.int64) -> BatterySample:
    """The true battery in the place of a sample."""
    battery = BatterySample()
    battery.time_us = tick_end_us(tick)
    battery.voltage_v = body.battery_voltage_v
    battery.current_a = body.battery_current_a
    return battery


@wp.func
def power_on(rig: RigArrays, i: int) -> None:
    """Sensors and flight controller as at power-on; all zero is their state then."""
    rig.sensors[i] = SensorState()
    rig.autopilot.control[i] = ControlState()
    rig.autopilot.setpoint[i] = Setpoint()
    estimator_reset(rig.autopilot.ekf, i)


@wp.kernel(enable_backward=False)
def boot(rig: RigArrays, chosen: wp.array(dtype=int)) -> None:
    """Puts the chosen vehicles on the ground at home, at rest and with a full battery, and powers them on."""
    i = wp.tid()
    if chosen[i] == 0:
        return
    model = rig.model[i]
    down = -ground_height(rig.worlds[rig.i_world[i]], 0.0, 0.0) - model.contact.leg_frd[2]
    rig.body[i] = body_at_rest(model, wp.vec3(0.0, 0.0, down), 0.0)
    rig.wind[i] = WindState()
    power_on(rig, i)


@wp.kernel(enable_backward=False)
def reboot(rig: RigArrays, i_vehicle: int) -> None:
    """Powers the sensors and the flight controller of one vehicle off and on, wherever it is."""
    power_on(rig, i_vehicle)


def make_advance(has_estimator: bool) -> Any:
    """The advance kernel, with the estimator and the sensors or without (a training run must not pay for them)."""

    @wp.kernel(enable_backward=False, module="unique")
    def advance(rig: RigArrays, first_vehicle: int, tick_count: int) -> None:
        i = first_vehicle + wp.tid()
        world = rig.worlds[rig.i_world[i]]
        seed = rig.seed[i]
        tick = rig.tick[i]
        model = rig.model[i]
        wind_model = rig.wind_model[i]
        params = rig.autopilot.control_params[i]
        airframe = rig.autopilot.airframe[i]
        setpoint = rig.autopilot.setpoint[i]
        body = rig.body[i]
        wind = rig.wind[i]
        sensors = rig.sensors[i]
        control = rig.autopilot.control[i]
        motor_loss = rig.faults[i].motor_loss
        for _ in range(tick_count):
            count = draw_tick(tick)
            height = -body.pos_ned[2] - ground_height(world, body.pos_ned[0], body.pos_ned[1])
            wind = wind_step(wind_model, wind, body.vel_ned, height, seed, i, count, TICK_S)
            command = weakened(control.actuators.command, motor_loss)
            body = body_tick(model, body, command, wind.wind_ned, world)
            if wp.static(has_estimator):
                sensors = sense(rig.sensor_model[i], sensors, rig.faults[i], body, world, seed, i, tick)
                estimator_step(rig.autopilot.ekf, i, sensors.samples, contact(setpoint))
                estimate = rig.autopilot.ekf.rows[i].estimate
            else:
                sensors.samples.battery = true_battery(body, tick)
                estimate = true_estimate(body, tick)
            control = control_tick(
                params, airframe, control, estimate, setpoint, sensors.samples.battery, draw_tick(tick)
            )
            tick += wp.int64(1)
        rig.tick[i] = tick
        rig.body[i] = body
        rig.wind[i] = wind
        rig.sensors[i] = sensors
        rig.autopilot.control[i] = control

    return advance
