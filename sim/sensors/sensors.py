"""All sensors of a vehicle, once per tick: true state in, the samples delivered up to the end of the tick out.

The tick with index `tick` ends at (tick + 1) * TICK_US. A sensor samples at the ticks whose end is a multiple of its
period, and draws noise only there. Truth reaches the flight controller through here and nowhere else.
"""

from typing import Any

import warp as wp

from autopilot.ports import Samples
from common.geodesy import DEFAULT_HOME, GeoPoint
from common.geomagnetic import field_ned_gauss
from common.kernels import TICK_S
from common.rng import draw_tick
from sim.faults import FAULT_OFF, Faults, SensorFault, is_due, sampling_period
from sim.sensors.baro import BaroModel, BaroState, baro_boot, baro_drift, baro_model, baro_sample
from sim.sensors.gnss import (
    GnssModel,
    GnssState,
    gnss_boot,
    gnss_delivered,
    gnss_drop_oldest,
    gnss_is_delivered,
    gnss_is_taken,
    gnss_lost,
    gnss_model,
    gnss_take,
)
from sim.sensors.imu import (
    DRIFT_PERIOD_TICKS,
    IMU_PERIOD_TICKS,
    ImuModel,
    ImuState,
    imu_boot,
    imu_drift,
    imu_model,
    imu_sample,
    imu_vibration,
)
from sim.sensors.mag import MagModel, MagState, mag_boot, mag_model, mag_sample
from sim.sensors.power import BatteryMonitorModel, battery_monitor_model, battery_sample
from sim.sensors.range import RangeModel, range_model, range_sample
from sim.truth import Truth
from sim.world.world import World, ray_hit

wp.set_module_options({"enable_backward": False})


@wp.struct
class SensorModel:
    """What the sensors of one vehicle are like: figures, rates and delays. A row, constant over a flight."""

    home_alt_amsl_m: float
    imu: ImuModel
    gnss: GnssModel
    baro: BaroModel
    mag: MagModel
    range: RangeModel
    battery: BatteryMonitorModel


@wp.struct
class SensorState:
    """Errors, queues and the latest samples. A row; all zero means that the sensors boot at the next tick."""

    is_booted: int
    imu: ImuState
    gnss: GnssState
    baro: BaroState
    mag: MagState
    samples: Samples  # what the drivers have delivered so far


def sensor_model(noise_scale: float = 1.0, home: GeoPoint = DEFAULT_HOME) -> Any:
    """The default sensors of a vehicle that boots at `home`.

    Args:
        noise_scale: factor on every error: noise, bias, drift, vibration, iron. 0 gives perfect values with the same
            rates and delays.
        home: origin of ned; sets air pressure and magnetic field.

    Raises:
        ValueError: a negative noise scale.
    """
    if not noise_scale >= 0.0:
        raise ValueError(f"noise scale must be at least 0, not {noise_scale}")
    model = SensorModel()
    model.home_alt_amsl_m = home.alt_m
    model.imu = imu_model(noise_scale)
    model.gnss = gnss_model(noise_scale)
    model.baro = baro_model(noise_scale)
    model.mag = mag_model(field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m), noise_scale)
    model.range = range_model(noise_scale)
    model.battery = battery_monitor_model(noise_scale)
    return model


@wp.func
def sensors_boot(model: SensorModel, seed: int, i: int, tick: wp.int64) -> SensorState:
    """The state at power-on, drawn for this vehicle and this power-on."""
    state = SensorState()
    state.is_booted = 1
    state.imu = imu_boot(model.imu, seed, i, draw_tick(tick))
    state.gnss = gnss_boot(model.gnss, seed, i, tick)
    state.baro = baro_boot(model.baro, seed, i, draw_tick(tick))
    state.mag = mag_boot(model.mag, seed, i, draw_tick(tick))
    state.samples.gnss.fix_type = 1
    return state


@wp.func
def imu_period(gyro: SensorFault, accel: SensorFault) -> int:
    """Ticks between samples of the chip that holds both; 0 if either is off."""
    gyro_period = sampling_period(IMU_PERIOD_TICKS, gyro)
    accel_period = sampling_period(IMU_PERIOD_TICKS, accel)
    if gyro_period == 0 or accel_period == 0:
        return 0
    return wp.max(gyro_period, accel_period)


@wp.func
def sense(
    model: SensorModel,
    state: SensorState,
    faults: Faults,
    truth: Truth,
    world: World,
    seed: int,
    i: int,
    tick: wp.int64,
) -> SensorState:
    """The sensors after a tick; `samples` holds what the drivers have delivered by its end.

    Args:
        model: figures, rates and delays.
        state: after the tick before; all zero boots the sensors now.
        faults: what is broken.
        truth: true state at the end of the tick, with its means over the tick.
        world: what the range finder sees.
        seed: of the run.
        i: vehicle.
        tick: index of the tick.
    """
    out = state
    count = draw_tick(tick)
    if state.is_booted == 0:
        out = sensors_boot(model, seed, i, tick)

    if is_due(DRIFT_PERIOD_TICKS, count):
        out.imu = imu_drift(model.imu, out.imu, seed, i, count)
    period = imu_period(faults.gyro, faults.accel)
    if is_due(period, count):
        out.imu = imu_vibration(out.imu, truth.motor_speed, float(period) * TICK_S)
        out.samples.imu = imu_sample(
            model.imu,
            out.imu,
            out.samples.imu,
            truth.gyro_frd,
            truth.accel_frd,
            faults.gyro,
            faults.accel,
            seed,
            i,
            tick,
        )

    first_fix = out.gnss.boot_tick + wp.int64(model.gnss.first_fix_ticks)
    if gnss_is_taken(model.gnss.period_ticks, first_fix, faults.gnss, tick):
        out.gnss = gnss_take(model.gnss, out.gnss, truth.pos_ned, truth.vel_ned, faults.gnss, seed, i, tick)
    if gnss_is_delivered(model.gnss.delay_ticks, out.gnss.queue_count, out.gnss.queue_tick[out.gnss.queue_head], tick):
        out.samples.gnss = gnss_delivered(model.gnss, out.gnss, out.samples.gnss, faults.gnss)
        out.gnss = gnss_drop_oldest(out.gnss)
    if faults.gnss.mode == FAULT_OFF:
        out.samples.gnss = gnss_lost(out.samples.gnss)

    if is_due(model.baro.period_ticks, count):
        out.baro = baro_drift(model.baro, out.baro, seed, i, count)
    if is_due(sampling_period(model.baro.period_ticks, faults.baro), count):
        alt_amsl_m = model.home_alt_amsl_m - truth.pos_ned[2]
        out.samples.baro = baro_sample(model.baro, out.baro, out.samples.baro, alt_amsl_m, faults.baro, seed, i, tick)

    if is_due(sampling_period(model.mag.period_ticks, faults.mag), count):
        out.samples.mag = mag_sample(
            model.mag, out.mag, out.samples.mag, truth.q_ned_from_frd, faults.mag, seed, i, tick
        )

    if is_due(sampling_period(model.range.period_ticks, faults.range), count):
        down_ned = wp.quat_rotate(truth.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))
        distance_m = ray_hit(world, truth.pos_ned, down_ned, model.range.max_distance)
        out.samples.range = range_sample(model.range, out.samples.range, distance_m, faults.range, seed, i, tick)

    if is_due(sampling_period(model.battery.period_ticks, faults.battery), count):
        out.samples.battery = battery_sample(
            model.battery,
            out.samples.battery,
            truth.battery_voltage_v,
            truth.battery_current_a,
            faults.battery,
            seed,
            i,
            tick,
        )
    return out
