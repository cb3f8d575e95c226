"""The battery monitor."""

import numpy as np
import pytest

from tests.unit.sim.sensors.recorder import Recorder, arrivals


def test_samples_come_at_ten_hertz_with_small_noise():
    battery = Recorder(64).run(2500)["battery"]
    new = arrivals(battery[0])
    assert np.all(np.diff(new) == 25)
    assert np.all(battery[0]["time_us"][new] == (new + 1) * 4000)
    assert battery[:, new]["voltage_v"].astype(np.float64).std() == pytest.approx(0.01, rel=0.05)
    assert battery[:, new]["current_a"].astype(np.float64).std() == pytest.approx(0.1, rel=0.05)
    assert battery[:, new]["voltage_v"].mean() == pytest.approx(15.0, abs=0.001)
    assert battery[:, new]["current_a"].mean() == pytest.approx(12.0, abs=0.01)
