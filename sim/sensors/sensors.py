"""All sensors of a vehicle, once per tick: true state in, the samples delivered up to the end of the tick out.

The tick with index `tick` ends at (tick + 1) * TICK_US. A sensor samples at the ticks whose end is a multiple of its
period, and draws noise only there. Truth reaches the flight controller through here and nowhere else.
"""

from typing import Any

import warp as wp

from autopilot.ports import Samples
from common.geodesy import DEFAULT_HOME, GeoPoint
from common.geomagnetic import field_ned_gauss
from common.kernels import vec8
from common.rng import draw_tick
from sim.faults import SensorFault
from sim.sensors.airspeed import PitotModel, PitotState, pitot_boot, pitot_model, sense_pitot
from sim.sensors.baro import BaroModel, BaroState, baro_boot, baro_model, sense_baro
from sim.sensors.gnss import GnssModel, GnssState, gnss_boot, gnss_model, sense_gnss
from sim.sensors.imu import ImuModel, ImuState, imu_boot, imu_model, sense_imu
from sim.sensors.mag import MagModel, MagState, mag_boot, mag_model, sense_mag
from sim.sensors.power import BatteryMonitorModel, battery_monitor_model, sense_battery
from sim.sensors.range import RangeModel, range_model, sense_range
from sim.sensors.wheels import WheelModel, WheelState, sense_wheels, wheel_model, wheels_boot
from sim.truth import Truth
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_SHAKEN = wp.constant(9.3)  # factors of the roughest log: isolated, ours is 0.33 m/s² and 0.007 rad/s,
_MAGNETIC = wp.constant(147.0)  # and 0.15 mG


@wp.struct
class SensorModel:
    """What the sensors of one vehicle are like: figures, rates and delays. A row, constant over a flight."""

    home_alt_amsl_m: float
    imu: ImuModel
    gnss: GnssModel
    baro: BaroModel
    mag: MagModel
    range: RangeModel
    wheels: WheelModel
    pitot: PitotModel
    battery: BatteryMonitorModel


@wp.struct
class Faults:
    """The fault of each sensor of one vehicle; all zero is healthy."""

    gyro: SensorFault
    accel: SensorFault
    gnss: SensorFault
    baro: SensorFault
    mag: SensorFault
    range: SensorFault
    wheels: SensorFault
    airspeed: SensorFault
    battery: SensorFault
    motor_loss: vec8  # [0..1] fraction of its command that each motor loses


@wp.struct
class SensorState:
    """Errors, queues and the latest samples. A row; all zero means that the sensors boot at the next tick."""

    is_booted: int
    imu: ImuState
    gnss: GnssState
    baro: BaroState
    mag: MagState
    wheels: WheelState
    pitot: PitotState
    samples: Samples  # what the drivers have delivered so far


def sensor_model(noise_scale: float = 1.0, home: GeoPoint = DEFAULT_HOME, roughness: float = 0.0) -> Any:
    """The default sensors of a vehicle that boots at `home`.

    Args:
        noise_scale: factor on every error: noise, bias, drift, vibration, iron. 0 gives perfect values with the same
            rates and delays.
        home: origin of ned; sets air pressure and magnetic field.
        roughness: of vibration and magnetic noise, see `roughened`.

    Raises:
        ValueError: a negative noise scale, or a roughness that is not between 0 and 1.
    """
    if not noise_scale >= 0.0:
        raise ValueError(f"noise scale must be at least 0, not {noise_scale}")
    if not 0.0 <= roughness <= 1.0:
        raise ValueError(f"roughness must be between 0 and 1, not {roughness}")
    model = SensorModel()
    model.home_alt_amsl_m = home.alt_m
    model.imu = imu_model(noise_scale)
    model.gnss = gnss_model(noise_scale)
    model.baro = baro_model(noise_scale)
    model.mag = mag_model(field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m), noise_scale)
    model.range = range_model(noise_scale)
    model.wheels = wheel_model(noise_scale)
    model.pitot = pitot_model(noise_scale)
    model.battery = battery_monitor_model(noise_scale)
    return roughened.func(model, roughness)


@wp.func
def roughened(model: SensorModel, roughness: float) -> SensorModel:
    """Sensors as logs of real flights show them: 1 is the roughest of five, 0 those of a well isolated controller.

    Roughness 1 is 3.1 m/s² and 0.065 rad/s RMS of vibration where an x500 hovers, less where motors turn slower, and 22
    mG of white noise of the field; nothing where there is no noise.
    """
    shaken = 1.0 + roughness * (_SHAKEN - 1.0)
    model.imu.accel_tone = shaken * model.imu.accel_tone
    model.imu.accel_broadband = shaken * model.imu.accel_broadband
    model.imu.gyro_tone = shaken * model.imu.gyro_tone
    model.imu.gyro_broadband = shaken * model.imu.gyro_broadband
    model.mag.white_std = (1.0 + roughness * (_MAGNETIC - 1.0)) * model.mag.white_std
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
    state.wheels = wheels_boot(model.wheels, seed, i, draw_tick(tick))
    state.pitot = pitot_boot(model.pitot, seed, i, draw_tick(tick))
    state.samples.gnss.fix_type = 1
    return state


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
    if state.is_booted == 0:
        out = sensors_boot(model, seed, i, tick)
    imu, imu_now = sense_imu(model.imu, out.imu, out.samples.imu, faults.gyro, faults.accel, truth, seed, i, tick)
    gnss, gnss_now = sense_gnss(model.gnss, out.gnss, out.samples.gnss, faults.gnss, truth, seed, i, tick)
    alt_m = model.home_alt_amsl_m - truth.pos_ned[2]
    baro, baro_now = sense_baro(model.baro, out.baro, out.samples.baro, faults.baro, alt_m, seed, i, tick)
    out.imu = imu
    out.samples.imu = imu_now
    out.gnss = gnss
    out.samples.gnss = gnss_now
    out.baro = baro
    out.samples.baro = baro_now
    out.samples.mag = sense_mag(model.mag, out.mag, out.samples.mag, faults.mag, truth.q_ned_from_frd, seed, i, tick)
    out.samples.range = sense_range(model.range, out.samples.range, faults.range, truth, world, seed, i, tick)
    wheels, wheels_now = sense_wheels(model.wheels, out.wheels, out.samples.wheels, faults.wheels, truth, seed, i, tick)
    out.wheels = wheels
    out.samples.wheels = wheels_now
    out.samples.airspeed = sense_pitot(
        model.pitot, out.pitot, out.samples.airspeed, faults.airspeed, truth, seed, i, tick
    )
    out.samples.battery = sense_battery(model.battery, out.samples.battery, faults.battery, truth, seed, i, tick)
    return out
