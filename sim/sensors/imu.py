"""Inertial measurement unit: one sample each tick (250 Hz), the mean over the tick, without delay.

Defaults are a Bosch Sensortec BMI088 (data sheet BST-BMI088-DS001, table "Specification"). Errors: turn-on bias (what
a factory calibration leaves), bias instability as a first-order Gauss-Markov process, white noise, vibration,
saturation. Left out: temperature, scale factor and misalignment, g-sensitivity, quantisation.

Vibration has two parts, both growing with the square of the motor speed like the force of an imbalance: a tone at the
mean motor speed, whose mean over the tick is taken exactly (so it aliases as in a sensor that integrates over its
sample), and broadband noise of frame and airflow, white at the sample rate. The motors' tones do not beat.
"""

from math import exp, radians, sqrt
from typing import Any

import warp as wp

from autopilot.ports import ImuSample
from common.geodesy import GRAVITY_M_S2
from common.kernels import MAX_MOTORS, TICK_S, tick_end_us, vec8
from common.rng import draw_tick, normal3, normal6
from common.vectors import clamp3
from sim.faults import FAULT_STUCK, SensorFault, fault_bias3, is_due, noise_gain, sampling_period
from sim.rng_streams import (
    ACCEL_DRIFT,
    ACCEL_DRIFT_START,
    ACCEL_TURN_ON,
    GYRO_DRIFT,
    GYRO_DRIFT_START,
    GYRO_TURN_ON,
    IMU_WHITE,
)
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

IMU_PERIOD_TICKS = wp.constant(1)
DRIFT_PERIOD_TICKS = wp.constant(25)  # the drift moves over minutes: 10 Hz is exact enough and saves six draws a tick

GYRO_NSD_DPS = 0.014  # [deg/s/√Hz] BMI088
ACCEL_NSD_UG = 190.0  # [ug/√Hz] BMI088, z; x and y have 160
GYRO_RANGE_DPS = 2000.0  # BMI088
ACCEL_RANGE_G = 24.0  # BMI088
GYRO_TURN_ON_DPS = 0.1  # guess: left of the BMI088's ±1 deg/s zero-rate offset after calibration
ACCEL_TURN_ON_MG = 2.0  # guess: left of the BMI088's ±20 mg zero-g offset after calibration
GYRO_INSTABILITY_DPH = 2.0  # [deg/h] BMI088 bias stability (Bosch product flyer)
ACCEL_INSTABILITY_UG = 50.0  # guess: not in the data sheet
DRIFT_TIME_S = 200.0  # guess
_ALLAN_PEAK = (
    0.617  # Allan deviation of a Gauss-Markov process at its maximum, over its std (IEEE Std 952-1997, C.1.1.4)
)

VIBRATION_SPEED_RAD_S = 600.0  # motor speed at which the four figures below hold: hover of a 10-inch quadcopter
ACCEL_TONE_RMS = 0.2  # [m/s²] guess, all with isolated flight controller
ACCEL_BROADBAND_RMS = 0.2  # [m/s²] guess
GYRO_TONE_RMS = 0.004  # [rad/s] guess
GYRO_BROADBAND_RMS = 0.004  # [rad/s] guess

_TURN = wp.constant(6.283185307179586)


@wp.struct
class ImuModel:
    """Standard deviations per sample, not densities."""

    gyro_std: float  # [rad/s] white
    accel_std: float  # [m/s²] white
    gyro_turn_on_std: float  # [rad/s]
    accel_turn_on_std: float  # [m/s²]
    gyro_drift_std: float  # [rad/s]
    accel_drift_std: float  # [m/s²]
    drift_keep: float  # fraction of the drift left after DRIFT_PERIOD_TICKS
    gyro_tone: float  # [rad/s per (rad/s)²] amplitude over squared motor speed
    accel_tone: float  # [m/s² per (rad/s)²]
    gyro_broadband: float  # [rad/s per (rad/s)²] standard deviation over squared motor speed
    accel_broadband: float  # [m/s² per (rad/s)²]
    gyro_limit: float  # [rad/s]
    accel_limit: float  # [m/s²]


@wp.struct
class ImuState:
    gyro_bias_frd: wp.vec3  # [rad/s] turn-on
    accel_bias_frd: wp.vec3  # [m/s²]
    gyro_drift_frd: wp.vec3  # [rad/s] Gauss-Markov
    accel_drift_frd: wp.vec3  # [m/s²]
    tone_phase: float  # [rad] at the end of the tick
    tone_cos: float
    tone_sin: float
    tone_mean_cos: float  # mean of the cosine over the tick
    tone_mean_sin: float
    speed_squared: float  # [rad²/s²] of the mean motor speed
    dt_s: float  # length of the sample


def imu_model(noise_scale: float = 1.0, rate_hz: float = 1.0 / TICK_S) -> Any:
    """The default inertial sensor with all its errors multiplied by `noise_scale`.

    A density N gives N √rate per sample (IEEE Std 952: random-walk coefficient).
    """
    per_speed = noise_scale / VIBRATION_SPEED_RAD_S**2
    micro_g = GRAVITY_M_S2 * 1.0e-6
    model = ImuModel()
    model.gyro_std = noise_scale * radians(GYRO_NSD_DPS) * sqrt(rate_hz)
    model.accel_std = noise_scale * ACCEL_NSD_UG * micro_g * sqrt(rate_hz)
    model.gyro_turn_on_std = noise_scale * radians(GYRO_TURN_ON_DPS)
    model.accel_turn_on_std = noise_scale * ACCEL_TURN_ON_MG * 1.0e3 * micro_g
    model.gyro_drift_std = noise_scale * radians(GYRO_INSTABILITY_DPH) / 3600.0 / _ALLAN_PEAK
    model.accel_drift_std = noise_scale * ACCEL_INSTABILITY_UG * micro_g / _ALLAN_PEAK
    model.drift_keep = exp(-int(DRIFT_PERIOD_TICKS) * TICK_S / DRIFT_TIME_S)
    model.gyro_tone = sqrt(2.0) * GYRO_TONE_RMS * per_speed
    model.accel_tone = sqrt(2.0) * ACCEL_TONE_RMS * per_speed
    model.gyro_broadband = GYRO_BROADBAND_RMS * per_speed
    model.accel_broadband = ACCEL_BROADBAND_RMS * per_speed
    model.gyro_limit = radians(GYRO_RANGE_DPS)
    model.accel_limit = ACCEL_RANGE_G * GRAVITY_M_S2
    return model


@wp.func
def imu_boot(model: ImuModel, seed: int, i: int, tick: int) -> ImuState:
    """The state at power-on: biases drawn for this vehicle and this power-on."""
    state = ImuState()
    state.gyro_bias_frd = model.gyro_turn_on_std * normal3(seed, i, tick, GYRO_TURN_ON)
    state.accel_bias_frd = model.accel_turn_on_std * normal3(seed, i, tick, ACCEL_TURN_ON)
    state.gyro_drift_frd = model.gyro_drift_std * normal3(seed, i, tick, GYRO_DRIFT_START)
    state.accel_drift_frd = model.accel_drift_std * normal3(seed, i, tick, ACCEL_DRIFT_START)
    state.tone_cos = 1.0
    return state


@wp.func
def imu_drift(model: ImuModel, state: ImuState, seed: int, i: int, tick: int) -> ImuState:
    """Bias instability after another DRIFT_PERIOD_TICKS (exact discretisation of a Gauss-Markov process)."""
    out = state
    keep = model.drift_keep
    kick = wp.sqrt(1.0 - keep * keep)
    gyro_kick = kick * model.gyro_drift_std
    accel_kick = kick * model.accel_drift_std
    out.gyro_drift_frd = keep * state.gyro_drift_frd + gyro_kick * normal3(seed, i, tick, GYRO_DRIFT)
    out.accel_drift_frd = keep * state.accel_drift_frd + accel_kick * normal3(seed, i, tick, ACCEL_DRIFT)
    return out


@wp.func
def imu_vibration(state: ImuState, motor_speed: vec8, dt_s: float) -> ImuState:
    """The tone of the motors over a sample of `dt_s`, integrated exactly at their mean speed (weighted by speed)."""
    speed_sum = float(0.0)
    square_sum = float(0.0)
    for k in range(MAX_MOTORS):
        speed_sum += wp.abs(motor_speed[k])
        square_sum += motor_speed[k] * motor_speed[k]
    out = state
    out.dt_s = dt_s
    out.tone_mean_cos = 0.0
    out.tone_mean_sin = 0.0
    out.speed_squared = 0.0
    if speed_sum > 1.0:  # slower than 1 rad/s shakes nothing
        speed = square_sum / speed_sum
        turned = speed * dt_s
        phase = state.tone_phase + turned
        phase = phase - _TURN * wp.floor(phase / _TURN)
        cos_phase = wp.cos(phase)
        sin_phase = wp.sin(phase)
        out.tone_mean_cos = (sin_phase - state.tone_sin) / turned
        out.tone_mean_sin = (state.tone_cos - cos_phase) / turned
        out.tone_phase = phase
        out.tone_cos = cos_phase
        out.tone_sin = sin_phase
        out.speed_squared = speed * speed
    return out


@wp.func
def imu_sample(
    model: ImuModel,
    state: ImuState,
    held: ImuSample,
    gyro_frd: wp.vec3,
    accel_frd: wp.vec3,
    gyro_fault: SensorFault,
    accel_fault: SensorFault,
    seed: int,
    i: int,
    tick: wp.int64,
) -> ImuSample:
    """What the driver reads at the end of the tick.

    Args:
        model: the sensor.
        state: its biases and the vibration of this tick.
        held: the previous sample; a stuck sensor repeats its value.
        gyro_frd: [rad/s] true mean rate over the tick; a slowed sensor still averages over its last tick only.
        accel_frd: [m/s²] true mean specific force over the tick.
        gyro_fault: fault of the gyro.
        accel_fault: fault of the accelerometer.
        seed: of the run.
        i: vehicle.
        tick: index.
    """
    gyro_noise, accel_noise = normal6(seed, i, draw_tick(tick), IMU_WHITE)
    gyro_shake = model.gyro_broadband * state.speed_squared
    accel_shake = model.accel_broadband * state.speed_squared
    gyro_std = noise_gain(gyro_fault) * wp.sqrt(model.gyro_std * model.gyro_std + gyro_shake * gyro_shake)
    accel_std = noise_gain(accel_fault) * wp.sqrt(model.accel_std * model.accel_std + accel_shake * accel_shake)
    # an imbalance turns with the motor in the motor plane; the frame passes part of it on to the third axis
    tone = state.speed_squared * wp.vec3(
        state.tone_mean_cos, state.tone_mean_sin, 0.5 * (state.tone_mean_cos + state.tone_mean_sin)
    )
    gyro = gyro_frd + state.gyro_bias_frd + state.gyro_drift_frd + gyro_std * gyro_noise + model.gyro_tone * tone
    accel = accel_frd + state.accel_bias_frd + state.accel_drift_frd + accel_std * accel_noise + model.accel_tone * tone
    sample = ImuSample()
    sample.time_us = tick_end_us(tick)
    sample.dt_s = state.dt_s
    sample.gyro_frd = clamp3(gyro + fault_bias3(gyro_fault), wp.vec3(model.gyro_limit))
    sample.accel_frd = clamp3(accel + fault_bias3(accel_fault), wp.vec3(model.accel_limit))
    if held.time_us > wp.int64(0):
        if gyro_fault.mode == FAULT_STUCK:
            sample.gyro_frd = held.gyro_frd
        if accel_fault.mode == FAULT_STUCK:
            sample.accel_frd = held.accel_frd
    return sample


@wp.func
def imu_period(gyro: SensorFault, accel: SensorFault) -> int:
    """Ticks between samples of the chip that holds both; 0 if either is off."""
    gyro_period = sampling_period(IMU_PERIOD_TICKS, gyro)
    accel_period = sampling_period(IMU_PERIOD_TICKS, accel)
    if gyro_period == 0 or accel_period == 0:
        return 0
    return wp.max(gyro_period, accel_period)


@wp.func
def sense_imu(
    model: ImuModel,
    state: ImuState,
    held: ImuSample,
    gyro_fault: SensorFault,
    accel_fault: SensorFault,
    truth: Truth,
    seed: int,
    i: int,
    tick: wp.int64,
) -> tuple[ImuState, ImuSample]:
    """Errors and sample after a tick: new ones if they are due."""
    count = draw_tick(tick)
    out = state
    sample = held
    if is_due(DRIFT_PERIOD_TICKS, count):
        out = imu_drift(model, out, seed, i, count)
    period = imu_period(gyro_fault, accel_fault)
    if is_due(period, count):
        out = imu_vibration(out, truth.motor_speed, float(period) * TICK_S)
        sample = imu_sample(model, out, sample, truth.gyro_frd, truth.accel_frd, gyro_fault, accel_fault, seed, i, tick)
    return out, sample
