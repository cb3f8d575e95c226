"""The pacer against a clock that moves only when told."""

import pytest

from common.clock import MAX_LAG_S, Pacer


class HandClock:
    def __init__(self):
        self.now_s = 100.0

    def sleep(self, seconds):
        self.now_s += seconds


def paced(speed):
    clock = HandClock()
    return clock, Pacer(speed, now_s=lambda: clock.now_s, sleep=clock.sleep)


@pytest.mark.parametrize("speed", [0.5, 1.0, 8.0])
def test_simulated_time_runs_at_speed_times_the_wall_clock(speed):
    clock, pacer = paced(speed)
    for time_us in range(0, 2_000_001, 20_000):
        pacer.wait_until(time_us)
    assert clock.now_s - 100.0 == pytest.approx(2.0 / speed)
    assert pacer.lag_s == 0.0


def test_lockstep_never_waits():
    clock, pacer = paced(None)
    pacer.wait_until(10**12)
    assert clock.now_s == 100.0


def test_a_short_delay_is_made_up():
    clock, pacer = paced(1.0)
    pacer.wait_until(0)
    clock.now_s += 0.1
    pacer.wait_until(50_000)
    pacer.wait_until(200_000)
    assert clock.now_s == pytest.approx(100.2)


def test_a_stall_is_not_chased():
    clock, pacer = paced(1.0)
    pacer.wait_until(0)
    clock.now_s += 10.0
    pacer.wait_until(20_000)
    pacer.wait_until(40_000)
    assert clock.now_s == pytest.approx(110.02)
    assert pacer.lag_s == pytest.approx(9.98)
    assert pacer.lag_s > MAX_LAG_S


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_speed_that_is_not_positive_is_refused(speed):
    with pytest.raises(ValueError, match="speed must be a positive number"):
        Pacer(speed)
