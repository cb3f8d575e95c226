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
from autopilot.ports import Setpoint, contact
from common.kernels import TICK_S
from common.rng import draw_tick
from sim.bodies.multirotor import BodyState, MultirotorModel, body_at_rest, body_tick, truth_of
from sim.faults import Faults, weakened
from sim.sensors.sensors import SensorModel, SensorState, sense
from sim.truth import Truth, true_battery, true_estimate
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
    truth: wp.array(dtype=Truth)
    wind_model: wp.array(dtype=WindModel)
    wind: wp.array(dtype=WindState)
    sensor_model: wp.array(dtype=SensorModel)
    sensors: wp.array(dtype=SensorState)
    faults: wp.array(dtype=Faults)
    autopilot: Autopilot


@wp.func
def forget_impacts(rig: RigArrays, i: int) -> None:
    """From now on only what vehicle i touches from now on counts."""
    rig.body[i].impact_speed = 0.0
    rig.truth[i].impact_speed = 0.0


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
    body = body_at_rest(model, wp.vec3(0.0, 0.0, down), 0.0)
    rig.body[i] = body
    rig.truth[i] = truth_of(body)
    rig.wind[i] = WindState()
    power_on(rig, i)


@wp.kernel(enable_backward=False)
def reboot(rig: RigArrays, i_vehicle: int) -> None:
    """Powers the sensors and the flight controller of one vehicle off and on, wherever it is."""
    power_on(rig, i_vehicle)


@wp.kernel(enable_backward=False)
def forget_all_impacts(rig: RigArrays) -> None:
    """What vehicles met before, the ground they took off from above all, counts no more."""
    forget_impacts(rig, wp.tid())


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
            truth = truth_of(body)
            if wp.static(has_estimator):
                sensors = sense(rig.sensor_model[i], sensors, rig.faults[i], truth, world, seed, i, tick)
                estimator_step(rig.autopilot.ekf, i, sensors.samples, contact(setpoint))
                estimate = rig.autopilot.ekf.rows[i].estimate
            else:
                sensors.samples.battery = true_battery(truth, tick)
                estimate = true_estimate(truth, tick)
            control = control_tick(
                params, airframe, control, estimate, setpoint, sensors.samples.battery, draw_tick(tick)
            )
            tick += wp.int64(1)
        rig.tick[i] = tick
        rig.body[i] = body
        rig.truth[i] = truth_of(body)
        rig.wind[i] = wind
        rig.sensors[i] = sensors
        rig.autopilot.control[i] = control

    return advance
