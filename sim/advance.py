"""The loop: from motor commands to the true state, to samples, to the estimate, to motor commands, at 250 Hz.

One launch advances every vehicle by any number of ticks of 4 ms. Read the kernel `advance` first: it is the whole
simulator, in time order. With `has_estimator` False the flight controller is given the true state instead of an
estimate: a shortcut for training, never used in a flight. sim/stepped.py has the same loop in single launches.
"""

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import warp as wp

from autopilot.advance import autopilot_kernels
from autopilot.control.law import ControlLaw
from autopilot.estimator.ekf import estimator_step
from autopilot.ports import contact
from common.kernels import TICK_S
from common.rng import draw_tick
from sim.bodies.body import DEFAULT_BODY, DEFAULT_LAW, Body
from sim.faults import weakened
from sim.sensors.sensors import Faults, SensorModel, SensorState, sense
from sim.truth import Truth, true_battery, true_estimate
from sim.wind import WindModel, WindState, wind_step
from sim.world.world import World, ground_height, top_surface

wp.set_module_options({"enable_backward": False})


class RigKernels(NamedTuple):
    """The loop for one class of vehicles."""

    Arrays: type
    """Kernel struct: the vehicles, their surroundings and their flight controllers."""
    place: Any
    """`@wp.kernel (Arrays, is_chosen, start_ne: vec2, heading_rad: float)`: puts vehicles on the ground, at rest, with
    a full battery."""
    power_on: Any
    """`@wp.kernel (Arrays, is_chosen)`: powers their sensors and flight controllers off and on, wherever they are."""
    forget_impacts: Any
    """`@wp.func (Arrays, i)`: only what vehicle i touches from now on counts."""
    forget_all_impacts: Any
    """`@wp.kernel (Arrays)`: the same of all."""


@cache
def rig_arrays(body: Body, law: ControlLaw) -> Any:
    """The kernel struct of a class of vehicles, the same each time."""
    model_type, body_type, autopilot_arrays = body.Model, body.State, autopilot_kernels(law).Arrays

    @wp.struct
    class RigArrays:
        """The vehicles, their surroundings and their flight controllers; arrays but `worlds` have a row per vehicle."""

        worlds: wp.array(dtype=World)
        i_world: wp.array(dtype=int)  # the world that each vehicle is in
        tick: wp.array(dtype=wp.int64)  # ticks since power-on
        seed: wp.array(dtype=int)
        model: wp.array(dtype=model_type)
        body: wp.array(dtype=body_type)
        truth: wp.array(dtype=Truth)
        wind_model: wp.array(dtype=WindModel)
        wind: wp.array(dtype=WindState)
        sensor_model: wp.array(dtype=SensorModel)
        sensors: wp.array(dtype=SensorState)
        faults: wp.array(dtype=Faults)
        autopilot: autopilot_arrays

    return RigArrays


@cache
def rig_kernels(body: Body, law: ControlLaw) -> RigKernels:
    """The kernels of a class of vehicles but the loop's own, the same objects each time."""
    arrays = rig_arrays(body, law)
    truth_of, at_rest, standing_height = body.truth, body.at_rest, body.standing_height
    power_autopilot = autopilot_kernels(law).power_on

    @wp.kernel(enable_backward=False, module="unique")
    def place(rig: arrays, is_chosen: wp.array(dtype=int), start_ne: wp.vec2, heading_rad: float) -> None:
        i = wp.tid()
        if is_chosen[i] == 0:
            return
        model = rig.model[i]
        down = -top_surface(rig.worlds[rig.i_world[i]], start_ne[0], start_ne[1]) - standing_height(model)
        state = at_rest(model, wp.vec3(start_ne[0], start_ne[1], down), heading_rad)
        rig.body[i] = state
        rig.truth[i] = truth_of(state)
        rig.wind[i] = WindState()

    @wp.kernel(enable_backward=False, module="unique")
    def power_on(rig: arrays, is_chosen: wp.array(dtype=int)) -> None:
        i = wp.tid()
        if is_chosen[i] == 0:
            return
        rig.sensors[i] = SensorState()
        power_autopilot(rig.autopilot, i)

    @wp.func
    def forget_impacts(rig: arrays, i: int) -> None:
        rig.body[i].impact_speed = 0.0
        rig.truth[i].impact_speed = 0.0

    @wp.kernel(enable_backward=False, module="unique")
    def forget_all_impacts(rig: arrays) -> None:
        forget_impacts(rig, wp.tid())

    return RigKernels(arrays, place, power_on, forget_impacts, forget_all_impacts)


@cache
def advance_kernel(body: Body, law: ControlLaw, *, has_estimator: bool) -> Any:
    """`@wp.kernel (Arrays, first_vehicle, tick_count)`: the whole loop, the same object each time.

    Without sensors and estimator it is what a training run need not pay more for. Each is made when it is first asked
    for: Warp hashes all that a kernel calls, a tenth of a second for this one.
    """
    arrays, body_tick, truth_of = rig_arrays(body, law), body.tick, body.truth
    control_tick = law.tick

    @wp.kernel(enable_backward=False, module="unique")
    def advance(rig: arrays, first_vehicle: int, tick_count: int) -> None:
        i = first_vehicle + wp.tid()
        world = rig.worlds[rig.i_world[i]]
        seed = rig.seed[i]
        tick = rig.tick[i]
        model = rig.model[i]
        wind_model = rig.wind_model[i]
        params = rig.autopilot.control_params[i]
        airframe = rig.autopilot.airframe[i]
        setpoint = rig.autopilot.setpoint[i]
        state = rig.body[i]
        wind = rig.wind[i]
        sensors = rig.sensors[i]
        control = rig.autopilot.control[i]
        motor_loss = rig.faults[i].motor_loss
        for _ in range(tick_count):
            count = draw_tick(tick)
            world.boxes.tick = count
            height = -state.pos_ned[2] - ground_height(world, state.pos_ned[0], state.pos_ned[1])
            wind = wind_step(wind_model, wind, state.vel_ned, height, seed, i, count, TICK_S)
            command = weakened(control.actuators.command, motor_loss)
            state = body_tick(model, state, command, wind.wind_ned, world)
            truth = truth_of(state)
            if wp.static(has_estimator):
                sensors = sense(rig.sensor_model[i], sensors, rig.faults[i], truth, world, seed, i, tick)
                # As autopilot.advance's tick, whose arguments would be copied once more: a twentieth of all time
                estimator_step(rig.autopilot.ekf, i, sensors.samples, contact(setpoint))
                estimate = rig.autopilot.ekf.rows[i].estimate
                control = control_tick(params, airframe, control, estimate, setpoint, sensors.samples.battery, count)
            else:
                battery = true_battery(truth, tick)
                sensors.samples.battery = battery
                control = control_tick(params, airframe, control, true_estimate(truth, tick), setpoint, battery, count)
            tick += wp.int64(1)
        rig.tick[i] = tick
        rig.body[i] = state
        rig.truth[i] = truth_of(state)
        rig.wind[i] = wind
        rig.sensors[i] = sensors
        rig.autopilot.control[i] = control

    return advance


RigArrays: TypeAlias = Any if TYPE_CHECKING else rig_arrays(DEFAULT_BODY, DEFAULT_LAW)
"""Of the default class, for the kernels of tasks: they read any row, and write `autopilot.setpoint` alone."""
forget_impacts = rig_kernels(DEFAULT_BODY, DEFAULT_LAW).forget_impacts
