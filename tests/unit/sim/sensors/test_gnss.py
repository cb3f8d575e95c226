"""The receiver: when its samples arrive and how large its errors are."""

import numpy as np
import pytest

from tests.unit.sim.sensors.recorder import Recorder, arrivals


def test_samples_come_at_five_hertz_exactly_120_ms_late():
    gnss = Recorder().run(2500)["gnss"][0]
    new = arrivals(gnss)
    arrival_us = (new + 1) * 4000
    assert np.all(np.diff(new) == 50)
    assert np.all(arrival_us - gnss["time_us"][new] == 120_000)


def test_a_late_sample_holds_the_position_of_its_own_time():
    recorder = Recorder(noise_scale=0.0)
    recorder.run(400)  # the end of tick 399 is a multiple of 200 ms
    recorder.bodies["pos_ned"][0] = (50.0, 60.0, -70.0)
    gnss = recorder.run(50)["gnss"][0]
    delivered = gnss[arrivals(gnss)[-1]]
    assert delivered["time_us"] == 1_600_000
    assert delivered["pos_ned"].tolist() == [1.0, 2.0, -10.0]
    assert recorder.run(30)["gnss"][0, -1]["pos_ned"].tolist() == [50.0, 60.0, -70.0]


@pytest.mark.parametrize("delay_ticks", [0, 49, 50, 110, 199])
def test_delays_up_to_four_periods_lose_no_sample(delay_ticks):
    recorder = Recorder()
    recorder.models["gnss"]["delay_ticks"] = delay_ticks
    gnss = recorder.run(2500)["gnss"][0]
    new = arrivals(gnss)
    times = gnss["time_us"][new]
    assert np.all((new + 1) * 4000 - times == delay_ticks * 4000)
    assert np.all(np.diff(times) == 200_000)


def test_the_first_fix_comes_within_two_seconds_and_before_it_there_is_none():
    gnss = Recorder().run(600)["gnss"][0]
    first = arrivals(gnss)[0]
    assert 1.0 < (first + 1) * 0.004 < 2.0
    assert np.all(gnss["fix_type"][:first] == 1)
    assert np.all(gnss["time_us"][:first] == 0)
    assert np.all(gnss["fix_type"][first:] == 3)


def test_a_vehicle_that_boots_later_counts_its_first_fix_from_there():
    recorder = Recorder()
    recorder.tick = 10_000
    gnss = recorder.run(600)["gnss"][0]
    first = arrivals(gnss)[0]
    assert 1.0 < (first + 1) * 0.004 < 2.0
    assert gnss["time_us"][first] == (10_000 + first + 1) * 4000 - 120_000


def test_white_position_noise_is_0_3_m_and_vertical_1_5_times_that():
    recorder = Recorder(256)
    recorder.models["gnss"]["correlated_std_ned"] = 0.0
    recorder.run(500)
    error = recorder.run(100, stride=50)["gnss"]["pos_ned"] - np.float32([1.0, 2.0, -10.0])
    assert error.std(axis=(0, 1)) == pytest.approx([0.3, 0.3, 0.45], rel=0.03)


def test_correlated_position_error_has_its_deviation_and_correlation_time():
    recorder = Recorder(512)
    recorder.models["gnss"]["pos_std_ned"] = 0.0
    recorder.run(1, stride=500)
    error = recorder.run(3, stride=7500)["gnss"]["pos_ned"] - np.float32([1.0, 2.0, -10.0])  # 30 s apart
    assert error.std(axis=0).ravel() == pytest.approx([0.6, 0.6, 0.9] * 3, rel=0.1)
    for axis in range(3):
        half = np.corrcoef(error[:, 0, axis], error[:, 1, axis])[0, 1]
        full = np.corrcoef(error[:, 0, axis], error[:, 2, axis])[0, 1]
        assert half == pytest.approx(np.exp(-0.5), abs=0.12)
        assert full == pytest.approx(np.exp(-1.0), abs=0.12)


def test_velocity_noise_is_0_1_m_s_per_axis():
    recorder = Recorder(256)
    recorder.run(500)
    error = recorder.run(50, stride=50)["gnss"]["vel_ned"] - np.float32([0.5, -0.25, 0.125])
    assert error.std(axis=(0, 1)) == pytest.approx(0.1, rel=0.03)
    assert np.abs(error.mean(axis=(0, 1))).max() < 0.005


def test_an_outage_ends_the_fix_and_the_receiver_comes_back():
    recorder = Recorder()
    recorder.run(1000)
    recorder.fault("gnss", "off")
    out = recorder.run(500)["gnss"][0]
    assert len(np.unique(out["time_us"])) == 1
    assert np.all(out["fix_type"] == 0)
    assert np.all(out["satellites"] == 0)
    recorder.fault("gnss", "none")
    back = recorder.run(200)["gnss"][0]
    assert back["fix_type"][-1] == 3
    times = back["time_us"][back["fix_type"] == 3]
    assert np.all(times > 1500 * 4000)  # nothing from before or during the outage


def test_a_biased_receiver_is_wrong_by_the_bias_on_each_axis():
    recorder = Recorder(noise_scale=0.0)
    recorder.fault("gnss", "biased", 5.0)
    gnss = recorder.run(600)["gnss"][0, -1]
    assert gnss["pos_ned"].tolist() == [6.0, 7.0, -5.0]
    assert gnss["vel_ned"].tolist() == [0.5, -0.25, 0.125]
