"""One tick of the flight controller's kernel part: samples in, motor commands out, at 250 Hz.

This is the same code on every rig: fused into the simulator's launch (sim/advance.py), or alone, as a kernel on samples
from a recorded flight, another engine or an outside simulator.
"""

from functools import cache
from typing import Any, NamedTuple

import warp as wp

from autopilot.control.law import ControlLaw
from autopilot.estimator.ekf import estimator_reset, estimator_step
from autopilot.estimator.state import Ekf, EstimatorState
from autopilot.ports import CONTACT_UNKNOWN, Samples, Setpoint, contact
from common.kernels import vec8
from common.rng import draw_tick

wp.set_module_options({"enable_backward": False})


class AutopilotKernels(NamedTuple):
    """The flight controller with one control law, as kernels."""

    Arrays: type
    """Kernel struct of everything that it keeps: `ekf`, `control`, `control_params`, `airframe`, `setpoint`."""
    tick: Any
    """`@wp.func (Arrays, i, Samples, tick: int64)`, one tick of vehicle i, on its rows in place."""
    power_on: Any
    """`@wp.func (Arrays, i)`: the state after power-on."""


@cache
def autopilot_kernels(law: ControlLaw) -> AutopilotKernels:
    """The kernels of a law, the same objects each time."""
    params_type, airframe_type, state_type, control_tick = law.Params, law.Airframe, law.State, law.tick

    @wp.struct
    class Autopilot:
        """Everything the kernel part keeps; each array has one row per vehicle."""

        ekf: Ekf
        control: wp.array(dtype=state_type)
        control_params: wp.array(dtype=params_type)
        airframe: wp.array(dtype=airframe_type)
        setpoint: wp.array(dtype=Setpoint)  # written by the Python part

    @wp.func
    def autopilot_tick(autopilot: Autopilot, i: int, samples: Samples, tick: wp.int64) -> None:
        setpoint = autopilot.setpoint[i]
        estimator_step(autopilot.ekf, i, samples, contact(setpoint))
        estimate = autopilot.ekf.rows[i].estimate
        params, airframe, state = autopilot.control_params[i], autopilot.airframe[i], autopilot.control[i]
        count = draw_tick(tick)
        autopilot.control[i] = control_tick(params, airframe, state, estimate, setpoint, samples.battery, count)

    @wp.func
    def power_on(autopilot: Autopilot, i: int) -> None:
        autopilot.control[i] = state_type()
        autopilot.setpoint[i] = Setpoint()
        estimator_reset(autopilot.ekf, i)

    return AutopilotKernels(Autopilot, autopilot_tick, power_on)


@cache
def autopilot_kernel(law: ControlLaw) -> Any:
    """`@wp.kernel (Arrays, samples, ticks, commands)`: one tick alone, on samples from anywhere."""
    kernels = autopilot_kernels(law)
    autopilot_tick = kernels.tick
    arrays: Any = kernels.Arrays

    @wp.kernel(enable_backward=False, module="unique")
    def run_autopilot(
        autopilot: arrays,
        samples: wp.array(dtype=Samples),
        ticks: wp.array(dtype=wp.int64),
        commands: wp.array(dtype=vec8),
    ) -> None:
        i = wp.tid()
        autopilot_tick(autopilot, i, samples[i], ticks[i])
        commands[i] = autopilot.control[i].actuators.command

    return run_autopilot


@wp.kernel(enable_backward=False)
def estimate_samples(
    ekf: Ekf, samples: wp.array2d(dtype=Samples), states: wp.array2d(dtype=EstimatorState), tick_count: int
) -> None:
    """Runs the estimator alone over recorded samples, one column per tick, and keeps its state after each tick."""
    i = wp.tid()
    for tick in range(tick_count):
        estimator_step(ekf, i, samples[i, tick], CONTACT_UNKNOWN)
        states[i, tick] = ekf.rows[i]
