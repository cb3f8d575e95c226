"""Ten decisions a second, whatever a camera or a scanner does."""

import numpy as np
import pytest

from policies.companion.skills.pace import Pace

STEP_US = 4_000
SECONDS = 20.0


def decided_us(arrivals_us, *, waits=True):
    """When is decided, things coming in at these times; `waits`: where none comes, on the last once more."""
    pace, is_new, out = Pace(), False, []
    arrivals = list(arrivals_us)
    for time_us in range(0, int(SECONDS * 1e6), STEP_US):
        while arrivals and arrivals[0] <= time_us:
            arrivals.pop(0)
            is_new = True
        if (is_new or waits) and pace.is_due(time_us, is_new=is_new):
            pace.decided(time_us)
            is_new = False
            out.append(time_us)
    return np.array(out)


@pytest.mark.parametrize("rate_hz", [5, 8, 9, 10, 11, 12, 13, 15, 20, 25, 30, 60])
def test_a_camera_of_any_rate_makes_ten_decisions_a_second(rate_hz):
    times = decided_us(np.arange(0.0, SECONDS * 1e6, 1e6 / rate_hz))
    assert len(times) / SECONDS == pytest.approx(10.0, abs=0.4)
    assert np.diff(times).max() <= 250_000


@pytest.mark.parametrize("rate_hz", [10, 12, 13, 15, 25, 50])
def test_a_scanner_without_which_nothing_is_decided_makes_ten_too(rate_hz):
    times = decided_us(np.arange(0.0, SECONDS * 1e6, 1e6 / rate_hz), waits=False)
    assert len(times) / SECONDS == pytest.approx(10.0, abs=0.4)


def test_a_scanner_of_five_hertz_makes_five():
    assert len(decided_us(np.arange(0.0, SECONDS * 1e6, 2e5), waits=False)) / SECONDS == pytest.approx(5.0, abs=0.1)


def test_each_of_ten_a_second_is_decided_on_as_it_comes_however_it_jitters():
    rng = np.random.default_rng(3)
    arrivals_us = np.arange(0.0, SECONDS * 1e6, 1e5) + rng.uniform(0.0, 4e4, int(SECONDS * 10))
    times = decided_us(arrivals_us)
    assert len(times) == len(arrivals_us)
    assert (times - arrivals_us < STEP_US).all()


def test_after_a_pause_it_does_not_catch_up():
    arrivals_us = [*np.arange(0.0, 5e6, 1e5), *np.arange(10e6, SECONDS * 1e6, 1e5)]
    times = decided_us(arrivals_us, waits=False)
    assert np.diff(times).min() >= 1e5 - STEP_US


@pytest.mark.parametrize("off_us", [8_000, 40_000, 60_000, 92_000])
def test_ten_a_second_are_soon_decided_on_as_they_come_wherever_the_first_fell(off_us):
    times = decided_us([0.0, *np.arange(off_us, SECONDS * 1e6, 1e5)])
    assert (((times[20:] - off_us) % 100_000) < STEP_US).all()
