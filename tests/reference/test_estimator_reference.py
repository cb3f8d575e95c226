"""Covariance prediction and updates against dense NumPy in float64."""

from typing import Any

import numpy as np
import sympy as sp
import warp as wp

from autopilot.estimator.derive import COUNT, transition
from autopilot.estimator.fuse import fuse, fuse_part, set_variance
from autopilot.estimator.generated import mag_products, predict_covariance
from autopilot.estimator.params import EstimatorParams, estimator_params
from autopilot.estimator.state import Nominal
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})


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
    ph, hph = mag_products(cov, 0, axis_ned, 1, earth_ned)
    if count == 0:
        nominal_rows[0] = fuse(params, cov, 0, nominal_rows[0], ph, innov, hph + obs_var)
    else:
        nominal_rows[0] = fuse_part(params, cov, 0, nominal_rows[0], ph, innov, hph + obs_var, first, count)


@wp.kernel(enable_backward=False)
def forget(cov: wp.array2d(dtype=vec24), k: int, variance: float):
    set_variance(cov, 0, k, variance)


def random_covariance(seed: int = 0) -> np.ndarray:
    root = np.random.default_rng(seed).normal(0.0, 0.1, (COUNT, COUNT))
    return (root @ root.T).astype(np.float32)


def on_device(covariance: np.ndarray) -> Any:
    return wp.array(covariance[None], dtype=vec24, device="cpu")


def a_rotation() -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def mag_row(axis: np.ndarray, earth: np.ndarray) -> np.ndarray:
    row = np.zeros(COUNT)
    row[0:3] = np.cross(axis, earth)
    row[15:18] = axis
    row[19] = 1.0
    return row


def fused(covariance: np.ndarray, first: int, count: int) -> tuple[np.ndarray, Any, np.ndarray]:
    """The covariance and nominal state after a magnetometer axis, and the observation's row."""
    axis, earth = a_rotation()[:, 1], np.array([0.2, 0.01, 0.43])
    cov = on_device(covariance)
    nominal = Nominal()
    nominal.q_ned_from_frd = wp.quat_identity()
    rows = wp.array([nominal], dtype=Nominal, device="cpu")
    params = estimator_params()
    inputs = [params, cov, wp.vec3(*axis), wp.vec3(*earth), 0.01, 0.02, first, count, rows]
    wp.launch(fuse_once, 1, inputs=inputs, device="cpu")
    return cov.numpy()[0], rows.numpy()[0], mag_row(axis, earth)


def test_prediction_is_the_dense_product() -> None:
    covariance, rot = random_covariance(), a_rotation()
    delta_vel, dt_s = np.array([0.01, -0.02, -0.08]), 0.008
    added = np.random.default_rng(2).uniform(0.0, 1e-3, COUNT)
    values = {sp.Symbol(f"rot[{r}, {c}]"): rot[r, c] for r in range(3) for c in range(3)}
    values |= {sp.Symbol(f"delta_vel_ned[{k}]", real=True): delta_vel[k] for k in range(3)}
    matrix = np.array(transition().subs(values | {sp.Symbol("dt_s"): dt_s}), dtype=float)
    expected = matrix @ covariance.astype(float) @ matrix.T + np.diag(added)
    cov = on_device(covariance)
    inputs = [cov, wp.mat33(*rot.ravel()), wp.vec3(*delta_vel), dt_s, vec24(*added)]
    wp.launch(predict_once, 1, inputs=inputs, device="cpu")
    found = cov.numpy()[0]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_array_equal(found, found.T)


def test_fusion_is_the_kalman_update() -> None:
    covariance = random_covariance()
    found, nominal, row = fused(covariance, 0, 0)
    dense = covariance.astype(float)
    innov_var = row @ dense @ row + 0.02
    gain = dense @ row / innov_var
    joseph = (np.eye(COUNT) - np.outer(gain, row)) @ dense @ (np.eye(COUNT) - np.outer(gain, row)).T
    np.testing.assert_allclose(found, joseph + 0.02 * np.outer(gain, gain), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_allclose(nominal["vel_ned"], gain[3:6] * 0.01, atol=1e-6)
    np.testing.assert_allclose(nominal["q_ned_from_frd"][:3], 0.5 * gain[0:3] * 0.01, atol=1e-6)
    np.testing.assert_allclose(nominal["terrain_d"], gain[23] * 0.01, atol=1e-6)


def test_partial_fusion_corrects_only_its_states_and_stays_consistent() -> None:
    covariance = random_covariance()
    found, nominal, row = fused(covariance, 21, 2)
    dense = covariance.astype(float)
    innov_var = row @ dense @ row + 0.02
    gain = np.zeros(COUNT)
    gain[21:23] = (dense @ row / innov_var)[21:23]
    joseph = (np.eye(COUNT) - np.outer(gain, row)) @ dense @ (np.eye(COUNT) - np.outer(gain, row)).T
    np.testing.assert_allclose(found, joseph + 0.02 * np.outer(gain, gain), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)
    np.testing.assert_array_equal(nominal["vel_ned"], np.zeros(3))
    np.testing.assert_allclose(nominal["wind_ned"][:2], gain[21:23] * 0.01, atol=1e-6)


def test_forgotten_state_has_no_correlations() -> None:
    cov = on_device(random_covariance())
    wp.launch(forget, 1, inputs=[cov, 5, 0.25], device="cpu")
    found = cov.numpy()[0]
    expected = np.zeros(COUNT)
    expected[5] = 0.25
    np.testing.assert_array_equal(found[5], expected)
    np.testing.assert_array_equal(found[:, 5], expected)
