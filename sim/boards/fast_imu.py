"""The rig's IMU read at 1,000 Hz: the same biases, faults and noise densities, for boards that exchange so often."""

from typing import Any

import warp as wp

from autopilot.ports import ImuSample
from common.kernels import SUBSTEPS, TICK_S
from sim.rig import Rig
from sim.sensors.imu import ImuState, imu_period, imu_sample, imu_vibration
from sim.sensors.sensors import Faults, SensorModel, SensorState
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_SUBSTEPS = wp.constant(SUBSTEPS)
_ROOT = wp.constant(SUBSTEPS**0.5)  # of a noise density, at so many times the rate


@wp.kernel(enable_backward=False)
def feel(
    models: wp.array(dtype=SensorModel),
    sensors: wp.array(dtype=SensorState),
    faults: wp.array(dtype=Faults),
    truths: wp.array(dtype=Truth),
    seeds: wp.array(dtype=int),
    counts: wp.array(dtype=wp.int64),
    tones: wp.array(dtype=ImuState),
    felt: wp.array(dtype=ImuSample),
) -> None:
    """What the IMU felt over the last millisecond."""
    i = wp.tid()
    count = counts[i]
    counts[i] = count + wp.int64(1)
    model = models[i].imu
    model.gyro_std *= _ROOT
    model.accel_std *= _ROOT
    model.gyro_broadband *= _ROOT
    model.accel_broadband *= _ROOT
    fault = faults[i]
    period = imu_period(fault.gyro, fault.accel)
    if period == 0 or (period > 1 and count % wp.int64(period * _SUBSTEPS) != wp.int64(0)):
        return  # off, or slowed: the last one is read again
    now = imu_vibration(tones[i], truths[i].motor_speed, _SUBSTEP_S)
    bias = sensors[i].imu
    now.gyro_bias_frd = bias.gyro_bias_frd
    now.accel_bias_frd = bias.accel_bias_frd
    now.gyro_drift_frd = bias.gyro_drift_frd
    now.accel_drift_frd = bias.accel_drift_frd
    tones[i] = now
    truth = truths[i]
    felt[i] = imu_sample(
        model, now, felt[i], truth.gyro_frd, truth.accel_frd, fault.gyro, fault.accel, seeds[i], i, count
    )


class FastImu:
    """The IMUs of a rig.

    Args:
        rig: whose vehicles carry them.
    """

    def __init__(self, rig: Rig) -> None:
        count = rig.vehicle_count
        start = ImuState()
        start.tone_cos = 1.0
        tones = wp.array([start] * count, dtype=ImuState)
        samples: Any = wp.zeros(count, dtype=ImuSample)
        counts = wp.zeros(count, dtype=wp.int64)
        self.samples = samples.numpy()
        """Live, (vehicles,): what was felt last."""
        a = rig.arrays
        inputs = [a.sensor_model, a.sensors, a.faults, a.truth, a.seed, counts, tones, samples]
        self._launch = wp.launch(feel, count, inputs, record_cmd=True)
        self._kept = inputs  # a recorded launch does not

    def read(self) -> None:
        """After a millisecond of motion."""
        self._launch.launch()
