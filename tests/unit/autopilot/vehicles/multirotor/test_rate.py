import numpy as np
import pytest
import warp as wp

from autopilot.vehicles.multirotor.params import ControlParams, control_params
from autopilot.vehicles.multirotor.rate import RateState, filter_rates, rate_step, rate_torque

INERTIA = wp.vec3(0.01, 0.02, 0.03)


@pytest.fixture
def params() -> ControlParams:
    return control_params()


def test_derivative_acts_on_the_measurement_and_not_on_the_setpoint(params: ControlParams) -> None:
    state = filter_rates(params, RateState(), wp.vec3(0.0, 0.0, 0.0), 0.004)
    first = np.array(rate_torque(params, state, wp.vec3(1.0, 0.0, 0.0), INERTIA))
    assert first[0] == pytest.approx(0.01 * params.rate_p_tilt, rel=1e-5)
    moving = filter_rates(params, state, wp.vec3(0.5, 0.0, 0.0), 0.004)
    assert moving.omega_dot_frd[0] > 0.0
    braked = np.array(rate_torque(params, moving, wp.vec3(0.5, 0.0, 0.0), INERTIA))
    still = params.rate_p_tilt * (0.5 - moving.omega_frd[0])
    assert braked[0] == pytest.approx(0.01 * (still - params.rate_d_tilt * moving.omega_dot_frd[0]), rel=1e-4)


def test_first_measurement_makes_no_derivative_kick(params: ControlParams) -> None:
    state = filter_rates(params, RateState(), wp.vec3(2.0, -1.0, 0.5), 0.004)
    np.testing.assert_array_equal(np.array(state.omega_dot_frd), (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(np.array(state.omega_frd), (2.0, -1.0, 0.5))


def test_integral_grows_with_the_error_and_stops_at_its_bound(params: ControlParams) -> None:
    state = RateState()
    for _ in range(10):
        state = rate_step(params, state, wp.vec3(0.1, 0.0, 0.0), wp.vec3(0.0, 0.0, 0.0), 0.004)
    assert state.integral_frd[0] == pytest.approx(10 * params.rate_i_tilt * 0.1 * 0.004, rel=1e-5)
    for _ in range(3000):
        state = rate_step(params, state, wp.vec3(3.0, 0.0, 0.0), wp.vec3(0.0, 0.0, 0.0), 0.004)
    assert state.integral_frd[0] == pytest.approx(params.rate_integral_max_tilt)


def test_integral_does_not_grow_while_the_torque_falls_short_but_may_shrink(params: ControlParams) -> None:
    state = RateState()
    state = rate_step(params, state, wp.vec3(0.1, 0.0, -0.1), wp.vec3(0.2, 0.0, 0.2), 0.004)
    assert state.integral_frd[0] == 0.0  # short of what the error asks for
    assert state.integral_frd[2] < 0.0  # short the other way


def test_torque_carries_the_gyroscopic_term(params: ControlParams) -> None:
    omega = np.array([1.0, -2.0, 0.5])
    state = filter_rates(params, RateState(), wp.vec3(*omega), 0.004)
    torque = np.array(rate_torque(params, state, wp.vec3(*omega), INERTIA))
    np.testing.assert_allclose(torque, np.cross(omega, np.array(INERTIA) * omega), rtol=1e-5)
