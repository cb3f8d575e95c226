"""When a pitot tube is believed: stuck, silent, contradicting the motion; in wind, on the ground, high up."""

import numpy as np
import pytest
import warp as wp

from autopilot.estimator.airspeed import checked
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import AirspeedCheck
from autopilot.ports import CONTACT_GROUND, CONTACT_NONE, VELOCITY_VALID, AirspeedSample, Estimate

wp.set_module_options({"enable_backward": False})
PERIOD_US = 20_000


@wp.kernel(enable_backward=False)
def run_checks(
    params: EstimatorParams,
    estimates: wp.array(dtype=Estimate),
    samples: wp.array(dtype=AirspeedSample),
    contact: int,
    height_m: float,
    check: wp.array(dtype=AirspeedCheck),
):
    for k in range(samples.shape[0]):
        check[0] = checked(params, check[0], estimates[k], samples[k], contact, height_m)


class Tube:
    """A plane that flies northwards, and what its pitot tube tells."""

    def __init__(self, height_m=0.0):
        self.params = EstimatorParams()
        self.params.airspeed_checks, self.params.airspeed_innov = 7, 5.0
        self.params.airspeed_stop_s, self.params.airspeed_start_s = 1.0, 10.0
        self.height_m = height_m
        self.check = wp.zeros(1, dtype=AirspeedCheck, device="cpu")
        self.time_us = 0

    def fly(self, seconds, ground_m_s, pressure_pa, *, contact=CONTACT_NONE, flags=VELOCITY_VALID, is_stuck=False):
        count = round(seconds * 1e6 / PERIOD_US)
        estimates = np.zeros(count, Estimate.numpy_dtype())
        samples = np.zeros(count, AirspeedSample.numpy_dtype())
        times_us = self.time_us + PERIOD_US * np.arange(1, count + 1)
        self.time_us = int(times_us[-1])
        estimates["time_us"] = samples["time_us"] = times_us
        estimates["flags"] = int(flags)
        estimates["vel_ned"][:, 0] = ground_m_s
        estimates["q_ned_from_frd"][:, 3] = 1.0
        samples["pressure_pa"] = pressure_pa + (0.0 if is_stuck else 0.1) * (np.arange(count) % 2)
        arrays = [
            wp.array(estimates, dtype=Estimate, device="cpu"),
            wp.array(samples, dtype=AirspeedSample, device="cpu"),
        ]
        inputs = [self.params, *arrays, int(contact), self.height_m, self.check]
        wp.launch(run_checks, 1, inputs=inputs, device="cpu")
        return self.check.numpy()[0]


def pressure(speed_m_s, density=1.225):
    return 0.5 * density * speed_m_s**2


@pytest.mark.parametrize("flags", [VELOCITY_VALID, 0], ids=["slow over ground", "no velocity"])
def test_a_stuck_tube_is_found_and_stays_so_whatever_the_speed_over_ground(flags):
    tube = Tube()
    tube.fly(20.0, 10.0, pressure(14.0))
    assert tube.fly(3.0, 4.0, pressure(14.0), flags=flags, is_stuck=True)["is_failed"] == 1
    assert tube.fly(30.0, 4.0, pressure(14.0), flags=flags, is_stuck=True)["is_failed"] == 1


def test_a_tube_that_contradicts_stays_failed_while_nothing_can_judge_it():
    tube = Tube()
    tube.fly(20.0, 10.0, pressure(14.0))
    assert tube.fly(2.0, 10.0, pressure(24.0))["is_failed"] == 1
    assert tube.fly(30.0, 4.0, pressure(24.0))["is_failed"] == 1
    assert tube.fly(11.0, 10.0, pressure(14.0))["is_failed"] == 0


def test_a_value_may_stay_the_same_on_the_ground():
    assert Tube().fly(10.0, 0.0, 0.0, contact=CONTACT_GROUND, is_stuck=True)["is_failed"] == 0


def test_the_wind_is_forgotten_on_the_ground():
    tube = Tube()
    tube.fly(20.0, 5.5, pressure(15.0))
    tube.fly(11.0, 0.0, 0.0, contact=CONTACT_GROUND)
    assert tube.fly(20.0, 15.0, pressure(15.0))["is_failed"] == 0


def test_a_pressure_that_is_no_number_has_not_arrived():
    tube = Tube()
    tube.fly(20.0, 10.0, pressure(14.0))
    assert np.isfinite(tube.fly(0.02, 10.0, np.nan)["wind_ne"]).all()
    assert tube.fly(1.5, 10.0, np.nan)["is_failed"] == 1  # silent
    assert tube.fly(11.0, 10.0, pressure(14.0))["is_failed"] == 0
    assert tube.fly(2.0, 10.0, pressure(24.0))["is_failed"] == 1


def test_no_wind_is_learnt_from_thin_air():
    tube = Tube(height_m=3000.0)
    thin = pressure(30.0, density=0.9093)  # ISO 2533
    told = tube.fly(60.0, 30.0, thin)
    assert told["wind_ne"] == pytest.approx((0.0, 0.0), abs=0.05)
