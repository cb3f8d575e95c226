"""One tick of the flight controller's kernel part: samples in, motor commands out, at 250 Hz.

This is the same code on every rig: inside the simulator's fused launch (sim/advance.py), or alone, on samples from a
recorded flight or an outside simulator.
"""

import warp as wp

from autopilot.control.airframe import ControlAirframe
from autopilot.control.control import ControlState
from autopilot.control.params import ControlParams
from autopilot.estimator.ekf import estimator_step
from autopilot.estimator.state import Ekf, EstimatorState
from autopilot.ports import CONTACT_UNKNOWN, Samples, Setpoint

wp.set_module_options({"enable_backward": False})


@wp.struct
class Autopilot:
    """Everything the kernel part keeps; each array has one row per vehicle."""

    ekf: Ekf
    control: wp.array(dtype=ControlState)
    control_params: wp.array(dtype=ControlParams)
    airframe: wp.array(dtype=ControlAirframe)
    setpoint: wp.array(dtype=Setpoint)  # written by the Python part


@wp.kernel(enable_backward=False)
def estimate_samples(
    ekf: Ekf, samples: wp.array2d(dtype=Samples), states: wp.array2d(dtype=EstimatorState), tick_count: int
) -> None:
    """Runs the estimator alone over recorded samples, one column per tick, and keeps its state after each tick."""
    i = wp.tid()
    for tick in range(tick_count):
        estimator_step(ekf, i, samples[i, tick], CONTACT_UNKNOWN)
        states[i, tick] = ekf.rows[i]
