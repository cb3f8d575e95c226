"""The inertial sensor's noise against its data sheet, and its vibration against its model."""

from math import pi, radians, sqrt

import numpy as np
import pytest

from sim.sensors.imu import ACCEL_BROADBAND_RMS, ACCEL_TONE_RMS, GYRO_BROADBAND_RMS, GYRO_TONE_RMS
from tests.unit.sim.sensors.recorder import REST_ACCEL_FRD, Recorder

RATE_HZ = 250.0


def bias_free(recorder):
    recorder.models["imu"]["gyro_turn_on_std"] = 0.0
    recorder.models["imu"]["accel_turn_on_std"] = 0.0
    recorder.models["imu"]["gyro_drift_std"] = 0.0
    recorder.models["imu"]["accel_drift_std"] = 0.0
    return recorder


def only_vibration(recorder, speed_rad_s):
    bias_free(recorder)
    recorder.models["imu"]["gyro_std"] = 0.0
    recorder.models["imu"]["accel_std"] = 0.0
    recorder.bodies["motor_speed"][:, :4] = speed_rad_s
    return recorder


def test_a_sample_comes_every_tick_with_the_length_of_the_tick():
    imu = Recorder().run(50)["imu"][0]
    assert imu["time_us"].tolist() == [4000 * (k + 1) for k in range(50)]
    assert np.all(imu["dt_s"] == np.float32(0.004))


def test_allan_deviation_at_one_second_is_the_noise_density_of_the_bmi088():
    imu = bias_free(Recorder(32)).run(5000)["imu"]
    for field, density in (("gyro_frd", radians(0.014)), ("accel_frd", 190e-6 * 9.80665)):
        means = imu[field].reshape(32, 20, 250, 3).mean(axis=2, dtype=np.float64)
        allan = np.sqrt(0.5 * np.mean(np.diff(means, axis=1) ** 2))
        assert allan == pytest.approx(density, rel=0.06)  # 1,824 differences: 2 % standard error, three of them


def test_white_noise_is_white_normal_and_alike_on_all_axes():
    imu = bias_free(Recorder(32)).run(2000)["imu"]
    noise = np.concatenate([imu["gyro_frd"], imu["accel_frd"] - np.float32(REST_ACCEL_FRD)], axis=-1)
    noise = noise.astype(np.float64) / noise.std(axis=(0, 1))
    flat = noise.reshape(-1, 6)
    assert imu["gyro_frd"].std(axis=(0, 1)) == pytest.approx(radians(0.014) * sqrt(RATE_HZ), rel=0.015)
    assert np.abs(np.corrcoef(flat.T) - np.eye(6)).max() < 0.02  # 64,000 samples: 0.004 standard error
    assert abs(np.mean(noise[:, 1:] * noise[:, :-1])) < 0.01
    assert np.mean(flat**4) == pytest.approx(3.0, abs=0.1)


def test_turn_on_bias_differs_per_vehicle_and_stays():
    recorder = Recorder(1024)
    recorder.models["imu"]["gyro_std"] = 0.0
    recorder.models["imu"]["accel_std"] = 0.0
    imu = recorder.run(20)["imu"]
    assert imu["gyro_frd"][:, 0].std(axis=0) == pytest.approx(radians(0.1), rel=0.1)
    accel_bias = imu["accel_frd"][:, 0] - np.float32(REST_ACCEL_FRD)
    assert accel_bias.std(axis=0) == pytest.approx(2e-3 * 9.80665, rel=0.1)
    assert np.array_equal(imu["gyro_frd"][:, 0], imu["gyro_frd"][:, 19])


def test_bias_drift_has_its_deviation_and_correlation_time():
    recorder = Recorder(512)
    recorder.run(1)
    start = recorder.states["imu"]["gyro_drift_frd"].astype(np.float64).ravel()
    recorder.run(1, stride=25_000)  # 100 s, half a time constant
    end = recorder.states["imu"]["gyro_drift_frd"].astype(np.float64).ravel()
    std = radians(2.0) / 3600.0 / 0.617
    assert start.std() == pytest.approx(std, rel=0.08)
    assert end.std() == pytest.approx(std, rel=0.08)
    assert np.corrcoef(start, end)[0, 1] == pytest.approx(np.exp(-0.5), abs=0.06)


def test_vibration_has_the_stated_size_in_hover():
    imu = only_vibration(Recorder(16), 600.0).run(4000)["imu"]
    averaging = np.sinc(600.0 * 0.004 / (2.0 * pi))  # of a tone over a tick; NumPy's sinc has the pi inside
    accel = (imu["accel_frd"] - np.float32(REST_ACCEL_FRD)).std(axis=(0, 1))
    gyro = imu["gyro_frd"].std(axis=(0, 1))
    expected_accel = sqrt(ACCEL_BROADBAND_RMS**2 + (ACCEL_TONE_RMS * averaging) ** 2)
    assert accel[:2] == pytest.approx(expected_accel, rel=0.03)
    expected_gyro = sqrt(GYRO_BROADBAND_RMS**2 + (GYRO_TONE_RMS * averaging) ** 2)
    assert gyro[:2] == pytest.approx(expected_gyro, rel=0.03)


def test_vibration_grows_with_the_square_of_rotor_speed_and_rests_with_the_rotors():
    def shake(speed_rad_s):
        recorder = only_vibration(Recorder(16), speed_rad_s)
        recorder.models["imu"]["accel_tone"] = 0.0
        return (recorder.run(1000)["imu"]["accel_frd"] - np.float32(REST_ACCEL_FRD)).std()

    assert shake(0.0) == 0.0
    assert shake(600.0) / shake(300.0) == pytest.approx(4.0, rel=0.03)


@pytest.mark.parametrize(("rotor_hz", "seen_hz"), [(90.0, 90.0), (160.0, 90.0), (240.0, 10.0), (260.0, 10.0)])
def test_the_rotor_tone_aliases_at_the_sample_rate(rotor_hz, seen_hz):
    recorder = only_vibration(Recorder(), 2.0 * pi * rotor_hz)
    recorder.models["imu"]["accel_broadband"] = 0.0
    accel = recorder.run(1000)["imu"]["accel_frd"][0, :, 0].astype(np.float64)
    spectrum = np.abs(np.fft.rfft(accel * np.hanning(1000)))
    assert np.argmax(spectrum) * RATE_HZ / 1000 == pytest.approx(seen_hz, abs=0.3)


def test_a_rotor_turning_once_per_sample_does_not_shift_the_mean():
    recorder = only_vibration(Recorder(), 2.0 * pi * 250.0)
    recorder.models["imu"]["accel_broadband"] = 0.0
    recorder.models["imu"]["gyro_broadband"] = 0.0
    imu = recorder.run(500)["imu"][0]
    # float32 phases: 1e-6 of an amplitude of 2 m/s²
    assert np.abs(imu["accel_frd"] - np.float32(REST_ACCEL_FRD)).max() < 1e-4
    assert np.abs(imu["gyro_frd"]).max() < 1e-6


def test_the_sensor_saturates_at_its_range():
    recorder = Recorder(noise_scale=0.0)
    recorder.bodies["gyro_frd"][0] = (100.0, -100.0, 1.0)
    recorder.bodies["accel_frd"][0] = (-1000.0, 1000.0, 1.0)
    imu = recorder.run(1)["imu"][0, 0]
    assert imu["gyro_frd"] == pytest.approx([radians(2000.0), -radians(2000.0), 1.0])
    assert imu["accel_frd"] == pytest.approx([-24 * 9.80665, 24 * 9.80665, 1.0])
