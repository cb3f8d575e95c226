"""Covariance prediction and updates against dense NumPy in float64."""

from typing import Any

import numpy as np
import pytest
import sympy as sp
import warp as wp

from autopilot.estimator.derive import COUNT, SLOW_COUNT, transition
from autopilot.estimator.fuse import (
    fuse,
    fuse_part,
    offset_products,
    set_offset_by_state,
    set_slow_variance,
    set_state_by_offset,
    set_variance,
)
from autopilot.estimator.generated import mag_products, predict_covariance
from autopilot.estimator.params import EstimatorParams, estimator_params
from autopilot.estimator.state import ACCEL_BIAS, COV_ROWS, POS, SLOW, SLOW_BARO, SLOW_COV, Nominal
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

ALL = COUNT + SLOW_COUNT


@wp.kernel(enable_backward=False)
def predict_once(cov: wp.array2d(dtype=vec24), rot: wp.mat33, delta_vel_ned: wp.vec3, dt_s: float, added_var: vec24):
    predict_covariance(cov, 0, rot, delta_vel_ned, dt_s, added_var)


@wp.kernel(enable_backward=False)
def fuse_once(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    axis_ned: wp.vec3,
    earth_ned: wp.vec3,
    innov: float,
    obs_var: float,
    first: int,
    count: int,
    nominal_rows: wp.array(dtype=Nominal),
):
    ph, ph_slow, hph = mag_products(cov, 0, axis_ned, 1, earth_ned)
    if count == 0:
        nominal_rows[0] = fuse(params, cov, 0, nominal_rows[0], ph, ph_slow, innov, hph + obs_var)
    else:
        nominal_rows[0] = fuse_part(params, cov, 0, nominal_rows[0], ph, ph_slow, innov, hph + obs_var, first, count)


@wp.kernel(enable_backward=False)
def forget(cov: wp.array2d(dtype=vec24), k: int, variance: float):
    set_variance(cov, 0, k, variance)


@wp.kernel(enable_backward=False)
def fuse_height(
    params: EstimatorParams, cov: wp.array2d(dtype=vec24), innov: float, obs_var: float, rows: wp.array(dtype=Nominal)
):
    ph, ph_slow, hph = offset_products(cov, 0, POS + 2, SLOW_BARO)
    rows[0] = fuse(params, cov, 0, rows[0], ph, ph_slow, innov, hph + obs_var)


@wp.kernel(enable_backward=False)
def set_height(cov: wp.array2d(dtype=vec24), is_state: int, obs_var: float):
    if is_state == 1:
        set_state_by_offset(cov, 0, POS + 2, SLOW_BARO, obs_var)
    else:
        set_offset_by_state(cov, 0, POS + 2, SLOW_BARO, obs_var)


@wp.kernel(enable_backward=False)
def forget_slow(cov: wp.array2d(dtype=vec24), j: int, variance: float):
    set_slow_variance(cov, 0, j, variance)


def random_covariance(seed: int = 0) -> np.ndarray:
    """Of the 24 errors and the slow ones, in one matrix."""
    root = np.random.default_rng(seed).normal(0.0, 0.1, (ALL, ALL))
    return (root @ root.T).astype(np.float32)


def on_device(covariance: np.ndarray) -> Any:
    """The matrix as the estimator keeps it."""
    rows = np.zeros((COV_ROWS, COUNT), dtype=np.float32)
    rows[:ALL] = covariance[:, :COUNT]
    rows[SLOW_COV, : SLOW_COUNT**2] = covariance[SLOW:, SLOW:].ravel()
    return wp.array(rows[None], dtype=vec24, device="cpu")


def dense(cov: Any) -> np.ndarray:
    """The whole matrix again."""
    rows = cov.numpy()[0]
    covariance = np.empty((ALL, ALL), dtype=np.float32)
    covariance[:, :COUNT] = rows[:ALL]
    covariance[:COUNT, SLOW:] = rows[SLOW:ALL].T
    covariance[SLOW:, SLOW:] = rows[SLOW_COV, : SLOW_COUNT**2].reshape(SLOW_COUNT, SLOW_COUNT)
    return covariance


def joseph(before: np.ndarray, gain: np.ndarray, row: np.ndarray, obs_var: float) -> np.ndarray:
    left = np.eye(ALL) - np.outer(gain, row)
    return left @ before @ left.T + obs_var * np.outer(gain, gain)


def a_rotation() -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def mag_row(axis: np.ndarray, earth: np.ndarray) -> np.ndarray:
    row = np.zeros(ALL)
    row[0:3] = np.cross(axis, earth)
    row[15:18] = axis
    row[19] = 1.0
    return row


def height_row() -> np.ndarray:
    """A height is the position's down coordinate plus the barometer's slow error."""
    row = np.zeros(ALL)
    row[POS + 2] = row[SLOW + SLOW_BARO] = 1.0
    return row


def fused(
    covariance: np.ndarray, first: int, count: int, holds_accel_bias: int = 0
) -> tuple[np.ndarray, Any, np.ndarray]:
    """The covariance and nominal state after a magnetometer axis, and the observation's row."""
    axis, earth = a_rotation()[:, 1], np.array([0.2, 0.01, 0.43])
    cov = on_device(covariance)
    nominal = Nominal()
    nominal.q_ned_from_frd = wp.quat_identity()
    nominal.holds_accel_bias = holds_accel_bias
    rows = wp.array([nominal], dtype=Nominal, device="cpu")
    params = estimator_params()
    inputs = [params, cov, wp.vec3(*axis), wp.vec3(*earth), 0.01, 0.02, first, count, rows]
    wp.launch(fuse_once, 1, inputs=inputs, device="cpu")
    return dense(cov), rows.numpy()[0], mag_row(axis, earth)


def test_prediction_is_the_dense_product() -> None:
    covariance, rot = random_covariance(), a_rotation()
    delta_vel, dt_s = np.array([0.01, -0.02, -0.08]), 0.008
    added = np.random.default_rng(2).uniform(0.0, 1e-3, COUNT)
    values = {sp.Symbol(f"rot[{r}, {c}]"): rot[r, c] for r in range(3) for c in range(3)}
    values |= {sp.Symbol(f"delta_vel_ned[{k}]", real=True): delta_vel[k] for k in range(3)}
    matrix = np.array(transition().subs(values | {sp.Symbol("dt_s"): dt_s}), dtype=float)
    whole, noise = np.eye(ALL), np.zeros(ALL)
    whole[:COUNT, :COUNT], noise[:COUNT] = matrix, added
    expected = whole @ covariance.astype(float) @ whole.T + np.diag(noise)
    cov = on_device(covariance)
    inputs = [cov, wp.mat33(*rot.ravel()), wp.vec3(*delta_vel), dt_s, vec24(*added)]
    wp.launch(predict_once, 1, inputs=inputs, device="cpu")
    found = dense(cov)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_array_equal(found, found.T)


def test_fusion_is_the_kalman_update() -> None:
    covariance = random_covariance()
    found, nominal, row = fused(covariance, 0, 0)
    before = covariance.astype(float)
    gain = before @ row / (row @ before @ row + 0.02)
    np.testing.assert_allclose(found, joseph(before, gain, row, 0.02), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_allclose(nominal["vel_ned"], gain[3:6] * 0.01, atol=1e-6)
    np.testing.assert_allclose(nominal["q_ned_from_frd"][:3], 0.5 * gain[0:3] * 0.01, atol=1e-6)
    np.testing.assert_allclose(nominal["terrain_d"], gain[23] * 0.01, atol=1e-6)
    np.testing.assert_allclose(nominal["slow"], gain[SLOW:] * 0.01, atol=1e-6)


@pytest.mark.parametrize(("first", "count"), [(0, 0), (9, 9)])
def test_held_bias_is_considered_and_not_corrected(first: int, count: int) -> None:
    """Schmidt's update: its gain is zero, and the covariance is that of any gain."""
    covariance = random_covariance()
    found, nominal, row = fused(covariance, first, count, holds_accel_bias=1)
    before = covariance.astype(float)
    gain = before @ row / (row @ before @ row + 0.02)
    if count > 0:
        gain[:first] = gain[first + count :] = 0.0
    gain[ACCEL_BIAS : ACCEL_BIAS + 3] = 0.0
    np.testing.assert_allclose(found, joseph(before, gain, row, 0.02), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_array_equal(nominal["accel_bias_frd"], np.zeros(3))
    np.testing.assert_allclose(nominal["gyro_bias_frd"], gain[9:12] * 0.01, atol=1e-6)


def test_fusion_of_a_position_with_a_slow_error_is_the_kalman_update() -> None:
    covariance, row = random_covariance(), height_row()
    cov, rows = on_device(covariance), wp.array([Nominal()], dtype=Nominal, device="cpu")
    wp.launch(fuse_height, 1, inputs=[estimator_params(), cov, 0.01, 0.02, rows], device="cpu")
    before = covariance.astype(float)
    gain = before @ row / (row @ before @ row + 0.02)
    found = dense(cov)
    np.testing.assert_allclose(found, joseph(before, gain, row, 0.02), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_allclose(rows.numpy()[0]["pos_ned"][2], gain[POS + 2] * 0.01, atol=1e-6)
    np.testing.assert_allclose(rows.numpy()[0]["slow"], gain[SLOW:] * 0.01, atol=1e-6)


@pytest.mark.parametrize(("is_state", "index"), [(1, POS + 2), (0, SLOW + SLOW_BARO)])
def test_what_is_set_from_a_measurement_is_wrong_by_the_other_part_of_it(is_state: int, index: int) -> None:
    covariance = random_covariance()
    cov = on_device(covariance)
    wp.launch(set_height, 1, inputs=[cov, is_state, 0.02], device="cpu")
    # the new error is the measurement's noise minus the error of the other part
    change, noise = np.eye(ALL), np.zeros(ALL)
    change[index] = -height_row()
    change[index, index], noise[index] = 0.0, 0.02
    np.testing.assert_allclose(dense(cov), change @ covariance @ change.T + np.diag(noise), atol=1e-6)


def test_partial_fusion_corrects_only_its_states_and_stays_consistent() -> None:
    covariance = random_covariance()
    found, nominal, row = fused(covariance, 21, 2)
    before = covariance.astype(float)
    gain = np.zeros(ALL)
    gain[21:23] = (before @ row / (row @ before @ row + 0.02))[21:23]
    np.testing.assert_allclose(found, joseph(before, gain, row, 0.02), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_array_equal(nominal["vel_ned"], np.zeros(3))
    np.testing.assert_allclose(nominal["wind_ned"][:2], gain[21:23] * 0.01, atol=1e-6)


def test_forgotten_state_has_no_correlations() -> None:
    for kernel, k, row in ((forget, 5, 5), (forget_slow, 2, SLOW + 2)):
        cov = on_device(random_covariance())
        wp.launch(kernel, 1, inputs=[cov, k, 0.25], device="cpu")
        found = dense(cov)
        expected = np.zeros(ALL)
        expected[row] = 0.25
        np.testing.assert_array_equal(found[row], expected)
        np.testing.assert_array_equal(found[:, row], expected)
