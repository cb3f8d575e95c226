"""The barometer: the standard atmosphere, noise and drift."""

import numpy as np
import pytest

from tests.unit.sim.sensors.recorder import Recorder, arrivals


def quiet(recorder, *kept):
    for field in {"white_std", "offset_std", "drift_std"} - set(kept):
        recorder.models["baro"][field] = 0.0
    return recorder


@pytest.mark.parametrize(
    ("alt_amsl_m", "pressure_pa", "temperature_c"),
    [(0.0, 101325.0, 15.0), (500.0, 95460.8, 11.75), (1000.0, 89874.6, 8.5), (3000.0, 70108.5, -4.5)],
)
def test_pressure_and_temperature_are_those_of_the_tables_of_iso_2533(alt_amsl_m, pressure_pa, temperature_c):
    recorder = Recorder(noise_scale=0.0)
    recorder.bodies["pos_ned"][0] = (0.0, 0.0, 488.0 - alt_amsl_m)
    baro = recorder.run(5)["baro"][0, -1]
    assert baro["pressure_pa"] == pytest.approx(pressure_pa, rel=2e-5)  # tables give five digits
    assert baro["temperature_c"] == pytest.approx(temperature_c, abs=1e-3)


def test_samples_come_at_fifty_hertz_without_delay():
    baro = Recorder().run(500)["baro"][0]
    new = arrivals(baro)
    assert np.all(np.diff(new) == 5)
    assert np.all(baro["time_us"][new] == (new + 1) * 4000)


def test_white_noise_is_that_of_the_ms5611():
    baro = quiet(Recorder(64), "white_std").run(200, stride=5)["baro"]
    assert baro["pressure_pa"].astype(np.float64).std() == pytest.approx(1.2, rel=0.03)


def test_drift_has_its_deviation_and_correlation_time():
    recorder = quiet(Recorder(512), "drift_std")
    pressure = recorder.run(2, stride=15_000)["baro"]["pressure_pa"].astype(np.float64)  # 60 s apart
    assert pressure.std(axis=0) == pytest.approx(4.0, rel=0.1)
    assert np.corrcoef(pressure.T)[0, 1] == pytest.approx(np.exp(-0.2), abs=0.06)


def test_the_offset_of_a_power_on_stays_constant():
    pressure = quiet(Recorder(1024), "offset_std").run(2, stride=100)["baro"]["pressure_pa"]
    assert np.array_equal(pressure[:, 0], pressure[:, 1])
    assert pressure[:, 0].astype(np.float64).std() == pytest.approx(50.0, rel=0.08)
