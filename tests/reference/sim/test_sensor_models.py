"""Sensor models against plain NumPy written from their equations."""

import numpy as np
import pytest

from tests.unit.sim.sensors.recorder import REST_ACCEL_FRD, Recorder


def test_pressure_inverts_to_altitude_within_a_centimetre():
    recorder = Recorder(64, noise_scale=0.0)
    heights = np.linspace(-100.0, 2000.0, 64)
    recorder.bodies["pos_ned"][:, 2] = -heights
    pressure = recorder.run(5)["baro"]["pressure_pa"][:, -1].astype(np.float64)
    # hydrostatic equation dp/dh = -g p M / (R T) with T = T0 - L h, solved for h (ISO 2533)
    exponent = 8.31432 * 0.0065 / (9.80665 * 0.0289644)
    altitude = 288.15 / 0.0065 * (1.0 - (pressure / 101325.0) ** exponent)
    assert altitude - 488.0 == pytest.approx(heights, abs=0.02)  # float32 pressure: 0.008 Pa, 0.7 mm; power: 1e-7


def test_the_vibration_tone_is_the_mean_of_a_turning_force_over_each_sample():
    recorder = Recorder(noise_scale=1.0)
    imu_model = recorder.models["imu"]
    for field in ("gyro_std", "accel_std", "gyro_turn_on_std", "accel_turn_on_std", "gyro_drift_std",
                  "accel_drift_std", "gyro_broadband", "accel_broadband"):  # fmt: skip
        imu_model[field] = 0.0
    speeds = np.float32([500.0, 620.0, 580.0, 660.0])
    recorder.bodies["motor_speed"][0, :4] = speeds
    accel = recorder.run(200)["imu"]["accel_frd"][0].astype(np.float64) - np.float32(REST_ACCEL_FRD)
    speed = np.sum(speeds.astype(np.float64) ** 2) / np.sum(speeds)
    amplitude = float(imu_model["accel_tone"][0]) * speed**2
    fine_s = (np.arange(200 * 400) + 0.5) * 1e-5  # 400 points a sample, midpoint rule
    north = amplitude * np.cos(speed * fine_s).reshape(200, 400).mean(axis=1)
    east = amplitude * np.sin(speed * fine_s).reshape(200, 400).mean(axis=1)
    expected = np.stack([north, east, 0.5 * (north + east)], axis=1)
    assert accel == pytest.approx(expected, abs=2e-3 * amplitude)  # float32 phase over 200 samples


def test_soft_and_hard_iron_act_as_matrix_and_offset():
    recorder = Recorder(32)
    recorder.models["mag"]["white_std"] = 0.0
    q = np.array([0.2, -0.4, 0.5, 0.7])
    q /= np.linalg.norm(q)
    recorder.bodies["q_ned_from_frd"][:] = q
    observation = recorder.run(10)["mag"]["field_frd_gauss"][:, -1].astype(np.float64)
    x, y, z, w = q
    rotation_ned_from_frd = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    field_frd = rotation_ned_from_frd.T @ recorder.models["mag"]["field_ned_gauss"][0].astype(np.float64)
    expected = recorder.states["mag"]["soft_iron"] @ field_frd + recorder.states["mag"]["hard_iron_frd"]
    assert observation == pytest.approx(expected, abs=1e-6)
