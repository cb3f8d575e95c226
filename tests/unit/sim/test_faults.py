"""Each sensor in each fault, and what `set_fault` refuses."""

import numpy as np
import pytest

from sim.faults import BIAS_UNITS, set_fault
from sim.sensors.sensors import Faults
from tests.unit.sim.sensors.recorder import Recorder, arrivals

VALUES = {
    "gyro": ("imu", "gyro_frd", 1),
    "accel": ("imu", "accel_frd", 1),
    "gnss": ("gnss", "pos_ned", 50),
    "baro": ("baro", "pressure_pa", 5),
    "mag": ("mag", "field_frd_gauss", 10),
    "range": ("range", "distance_m", 10),
    "battery": ("battery", "voltage_v", 25),
}
WARM_UP_TICKS = 600  # past the first fix

sensors = pytest.mark.parametrize("sensor", VALUES)


def warm(noise_scale=1.0, vehicle_count=1):
    recorder = Recorder(vehicle_count, noise_scale)
    before = recorder.run(WARM_UP_TICKS)
    return recorder, before


def test_every_sensor_has_a_bias_unit():
    assert set(VALUES) == set(BIAS_UNITS) - {"wheels", "airspeed"}  # which a multirotor does not have


@sensors
def test_off_stops_the_samples(sensor):
    port, field, _ = VALUES[sensor]
    recorder, before = warm()
    recorder.fault(sensor, "off")
    after = recorder.run(200)[port][0]
    assert np.all(after["time_us"] == before[port][0, -1]["time_us"])
    assert np.all(after[field] == before[port][0, -1][field])


@sensors
def test_stuck_repeats_the_value_with_new_times(sensor):
    port, field, period = VALUES[sensor]
    recorder, before = warm()
    recorder.fault(sensor, "stuck")
    after = recorder.run(500)[port][0]
    assert len(arrivals(after)) >= 500 // period
    assert np.all(after[field] == before[port][0, -1][field])


def test_a_stuck_gyro_leaves_the_accelerometer_alive():
    recorder, _ = warm()
    recorder.fault("gyro", "stuck")
    imu = recorder.run(100)["imu"][0]
    assert len(np.unique(imu["gyro_frd"], axis=0)) == 1
    assert len(np.unique(imu["accel_frd"], axis=0)) == 100


@sensors
def test_biased_adds_the_magnitude_and_nothing_else(sensor):
    port, field, _ = VALUES[sensor]
    healthy, _ = warm()
    broken, _ = warm()
    broken.fault(sensor, "biased", 0.25)
    difference = broken.run(500)[port][0, -1][field] - healthy.run(500)[port][0, -1][field]
    assert difference == pytest.approx(np.full_like(difference, 0.25), abs=0.01)  # float32 pressure


def test_turned_magnetometer_reads_the_field_of_a_vehicle_that_heads_elsewhere():
    healthy, _ = warm(noise_scale=0.0)
    turned, _ = warm(noise_scale=0.0)
    turned.fault("mag", "turned", 90.0)
    x, y, z = healthy.run(50)["mag"][0, -1]["field_frd_gauss"]
    assert turned.run(50)["mag"][0, -1]["field_frd_gauss"] == pytest.approx([-y, x, z], abs=1e-6)


@sensors
def test_noisy_multiplies_the_white_noise(sensor):
    port, field, period = VALUES[sensor]
    spreads = []
    for gain in (1.0, 10.0):
        recorder = Recorder(32)
        recorder.models["gnss"]["correlated_std_ned"] = 0.0
        recorder.models["baro"]["drift_std"] = 0.0
        recorder.fault(sensor, "noisy", gain)
        recorder.run(1, stride=WARM_UP_TICKS)
        values = recorder.run(40, stride=period)[port][field].astype(np.float64)
        spreads.append((values - values.mean(axis=1, keepdims=True)).std())
    assert spreads[1] / spreads[0] == pytest.approx(10.0, rel=0.02)  # the same draws


@sensors
def test_slow_divides_the_rate(sensor):
    port, _, period = VALUES[sensor]
    recorder, _ = warm()
    recorder.fault(sensor, "slow", 4.0)
    samples = recorder.run(1600)[port][0]
    new = arrivals(samples)[3:]  # a GNSS sample of before may be on its way
    assert np.all(np.diff(new) == 4 * period)


def test_a_slow_imu_reports_its_longer_interval():
    recorder, _ = warm()
    recorder.fault("accel", "slow", 5.0)
    imu = recorder.run(20)["imu"][0]
    assert imu["dt_s"][-1] == pytest.approx(0.02)
    assert len(np.unique(imu["time_us"])) == 5  # four new ones after the last of before


@sensors
def test_a_fault_of_one_vehicle_leaves_the_others_alone(sensor):
    healthy = Recorder(3)
    broken = Recorder(3)
    set_fault(broken.faults[1], sensor, "off")
    healthy_samples = healthy.run(WARM_UP_TICKS)
    broken_samples = broken.run(WARM_UP_TICKS)
    assert np.array_equal(healthy_samples[[0, 2]], broken_samples[[0, 2]])
    assert not np.array_equal(healthy_samples[1], broken_samples[1])


def test_a_repaired_sensor_is_as_before():
    recorder, _ = warm(noise_scale=0.0)
    recorder.fault("baro", "biased", 100.0)
    recorder.run(5)
    recorder.fault("baro", "none")
    healthy, _ = warm(noise_scale=0.0)
    healthy.run(5)
    assert recorder.run(5)["baro"][0, -1] == healthy.run(5)["baro"][0, -1]


def test_a_struct_instance_can_be_set_too():
    faults = Faults()
    set_fault(faults, "mag", "biased", 0.5)
    assert (faults.mag.mode, faults.mag.magnitude) == (3, 0.5)


@pytest.mark.parametrize(
    ("sensor", "mode", "magnitude", "said"),
    [
        ("sonar", "off", 0.0, "unknown sensor 'sonar'"),
        ("gnss", "broken", 0.0, "unknown fault mode 'broken'"),
        ("gnss", "noisy", 0.5, "at least 1"),
        ("baro", "slow", 0.0, "at least 1"),
        ("mag", "biased", float("nan"), "finite"),
        ("gyro", "turned", 90.0, "only the magnetometer"),
    ],
)
def test_set_fault_names_what_is_wrong(sensor, mode, magnitude, said):
    with pytest.raises(ValueError, match=said):
        set_fault(Faults(), sensor, mode, magnitude)
