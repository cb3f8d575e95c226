"""Faults of sensors and motors: what a test or a scenario may break, per vehicle and per sensor, at any tick.

One `Faults` row per vehicle (sim/sensors/sensors.py), written by the host (`set_fault`), read by the sensors. The
magnitude means:

| mode   | effect                                                        | magnitude                                  |
|--------|---------------------------------------------------------------|--------------------------------------------|
| off    | no more samples (GNSS also reports fix type 0)                | not used                                   |
| stuck  | samples keep coming with new times and the last value         | not used                                   |
| biased | the magnitude is added to each axis of the value              | in the unit of the value: see `BIAS_UNITS` |
| noisy  | the white noise is multiplied by the magnitude (GNSS: jammed) | factor                                     |
| slow   | the period of the samples is multiplied by the magnitude      | factor, rounded down, at least 1           |
| turned | the magnetometer is mounted turned about the vehicle's down   | deg                                        |

A motor that fails loses a fraction of its command: 1 stops it, 0.4 leaves it weak (`set_motor_loss`).

Gyro and accelerometer share a chip and a data-ready line: off or slow of one silences or slows both.
"""

from typing import Any

import numpy as np
import warp as wp

from autopilot.estimator.sensors import FUSED_SENSORS
from common.kernels import vec8

wp.set_module_options({"enable_backward": False})

FAULT_NONE = wp.constant(0)
FAULT_OFF = wp.constant(1)
FAULT_STUCK = wp.constant(2)
FAULT_BIASED = wp.constant(3)
FAULT_NOISY = wp.constant(4)
FAULT_SLOW = wp.constant(5)
FAULT_TURNED = wp.constant(6)

FAULT_MODES: dict[str, int] = {"none": 0, "off": 1, "stuck": 2, "biased": 3, "noisy": 4, "slow": 5, "turned": 6}

BIAS_UNITS: dict[str, str] = {
    "gyro": "rad/s",
    "accel": "m/s²",
    **{sensor.name: sensor.bias_unit for sensor in FUSED_SENSORS},
    "airspeed": "Pa",
    "battery": "V",
}
"""Sensors that can fail, with the unit in which a bias is given."""


@wp.struct
class SensorFault:
    mode: int  # FAULT_*
    magnitude: float  # see the module's table


@wp.func
def weakened(command: vec8, motor_loss: vec8) -> vec8:
    """What arrives of the motor commands [0..1]."""
    return wp.cw_mul(command, vec8(1.0) - motor_loss)


@wp.func
def sampling_period(period_ticks: int, fault: SensorFault) -> int:
    """Ticks between samples with the fault applied; 0 for a sensor that is off."""
    if fault.mode == FAULT_OFF:
        return 0
    if fault.mode == FAULT_SLOW:
        return period_ticks * wp.max(1, int(fault.magnitude))
    return period_ticks


@wp.func
def is_due(period_ticks: int, tick: int) -> bool:
    """True at the ticks whose end is a multiple of the period; never for period 0."""
    if period_ticks <= 0:
        return False
    return tick % period_ticks == period_ticks - 1


@wp.func
def noise_gain(fault: SensorFault) -> float:
    """Factor on the white noise."""
    if fault.mode == FAULT_NOISY:
        return fault.magnitude
    return 1.0


@wp.func
def fault_turn(fault: SensorFault) -> wp.quat:
    """The turn from the vehicle's axes to those of a sensor that is mounted wrongly."""
    angle = float(0.0)
    if fault.mode == FAULT_TURNED:
        angle = wp.radians(fault.magnitude)
    return wp.quat_from_axis_angle(wp.vec3(0.0, 0.0, 1.0), angle)


@wp.func
def fault_bias(fault: SensorFault) -> float:
    """What is added to each axis of the value, in its unit."""
    if fault.mode == FAULT_BIASED:
        return fault.magnitude
    return 0.0


@wp.func
def fault_bias3(fault: SensorFault) -> wp.vec3:
    """What is added to a vector value."""
    bias = fault_bias(fault)
    return wp.vec3(bias, bias, bias)


def set_fault(row: Any, sensor: str, mode: str, magnitude: float = 0.0) -> None:
    """Sets the fault of one sensor of one vehicle.

    Args:
        row: one row of the faults, `faults.numpy()[i_vehicle]` (a live view on the CPU), or a `Faults` instance.
        sensor: a key of `BIAS_UNITS`.
        mode: a key of `FAULT_MODES`; `none` repairs.
        magnitude: see the module's table.

    Raises:
        ValueError: unknown sensor or mode, or a magnitude that is no factor where one is needed.
    """
    if sensor not in BIAS_UNITS:
        raise ValueError(f"unknown sensor '{sensor}'; known: {', '.join(BIAS_UNITS)}")
    if mode not in FAULT_MODES:
        raise ValueError(f"unknown fault mode '{mode}'; known: {', '.join(FAULT_MODES)}")
    if not np.isfinite(magnitude):
        raise ValueError(f"fault {sensor} {mode}: magnitude must be finite, not {magnitude}")
    if mode == "turned" and sensor != "mag":
        raise ValueError(f"fault {sensor} {mode}: only the magnetometer can be turned")
    if mode in {"noisy", "slow"} and magnitude < 1.0:
        raise ValueError(f"fault {sensor} {mode}: magnitude is a factor of at least 1, not {magnitude}")
    if isinstance(row, np.void | np.ndarray):
        row[sensor] = (FAULT_MODES[mode], magnitude)
        return
    fault = SensorFault()
    fault.mode = FAULT_MODES[mode]
    fault.magnitude = magnitude
    setattr(row, sensor, fault)


def set_motor_loss(row: Any, motor: int, fraction: float) -> None:
    """Sets what one motor loses of its command.

    Args:
        row: as for `set_fault`.
        motor: from 0.
        fraction: [0..1], 0 repairs.

    Raises:
        ValueError: the fraction is out of range.
    """
    if not 0.0 <= fraction <= 1.0:
        raise ValueError(f"motor loss is a share between 0 and 1, not {fraction}")
    if isinstance(row, np.void | np.ndarray):
        row["motor_loss"][motor] = fraction
    else:
        row.motor_loss[motor] = fraction
