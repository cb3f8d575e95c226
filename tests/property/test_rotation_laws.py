"""Laws of rotations in kernels: unit quaternions are a group, exponential and logarithm undo each other."""

from math import pi

import numpy as np
import warp as wp
from hypothesis import given, settings
from hypothesis import strategies as st

from common.rotation import quat_from_rotvec, quat_from_yaw, rotvec_from_quat, wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

LAWS = settings(max_examples=200, deadline=None)
EPS = 1.2e-7  # of float32
ROUNDING = 10.0 * EPS  # of a few products of numbers up to 1
TINY = 1.2e-38  # below it float32 has fewer digits
IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])

Vector = tuple[float, float, float]


def vectors(largest: float) -> st.SearchStrategy[Vector]:
    """Vectors of any direction, of a length up to `largest`, small ones as likely as large ones."""
    direction = st.tuples(*(st.floats(-1.0, 1.0),) * 3).filter(lambda d: np.linalg.norm(d) > 0.1)
    length = st.one_of(st.floats(0.0, largest), st.floats(-12.0, 0.0).map(lambda e: largest * 10.0**e))
    return st.builds(lambda d, n: tuple((np.array(d) * n / np.linalg.norm(d)).tolist()), direction, length)


rotations = vectors(3.0 * pi)  # beyond half a turn too
angles = st.floats(-20.0, 20.0, width=32)


@wp.kernel
def _exp(rotvec: wp.array(dtype=wp.vec3), q: wp.array(dtype=wp.quat)):
    i = wp.tid()
    q[i] = quat_from_rotvec(rotvec[i])


@wp.kernel
def _log(q: wp.array(dtype=wp.quat), rotvec: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    rotvec[i] = rotvec_from_quat(q[i])


@wp.kernel
def _product(a: wp.array(dtype=wp.quat), b: wp.array(dtype=wp.quat), q: wp.array(dtype=wp.quat)):
    i = wp.tid()
    q[i] = a[i] * b[i]


@wp.kernel
def _inverse(a: wp.array(dtype=wp.quat), q: wp.array(dtype=wp.quat)):
    i = wp.tid()
    q[i] = wp.quat_inverse(a[i])


@wp.kernel
def _rotated(q: wp.array(dtype=wp.quat), v: wp.array(dtype=wp.vec3), turned: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    turned[i] = wp.quat_rotate(q[i], v[i])


@wp.kernel
def _yaw(q: wp.array(dtype=wp.quat), yaw: wp.array(dtype=float)):
    i = wp.tid()
    yaw[i] = yaw_from_quat(q[i])


@wp.kernel
def _from_yaw(yaw: wp.array(dtype=float), q: wp.array(dtype=wp.quat)):
    i = wp.tid()
    q[i] = quat_from_yaw(yaw[i])


@wp.kernel
def _wrap(angle: wp.array(dtype=float), wrapped: wp.array(dtype=float)):
    i = wp.tid()
    wrapped[i] = wrap_pi(angle[i])


def call(kernel, dtype, *arguments):
    """What the kernel makes of one set of arguments, as float64; quaternions are (x, y, z, w)."""
    dtypes = {(): float, (3,): wp.vec3, (4,): wp.quat}
    inputs = [wp.array([argument], dtype=dtypes[np.shape(argument)]) for argument in arguments]
    output = wp.zeros(1, dtype=dtype)
    wp.launch(kernel, 1, inputs=inputs, outputs=[output])
    return output.numpy()[0].astype(float)


def exp(rotvec):
    return call(_exp, wp.quat, np.asarray(rotvec, float))


def log(q):
    return call(_log, wp.vec3, np.asarray(q, float))


def product(a, b):
    return call(_product, wp.quat, a, b)


def rotated(q, v):
    return call(_rotated, wp.vec3, q, np.asarray(v, float))


def same_rotation(a, b, atol=ROUNDING):
    """q and -q are the same rotation."""
    sign = 1.0 if np.dot(a, b) >= 0.0 else -1.0
    np.testing.assert_allclose(a, sign * np.asarray(b), atol=atol)


@LAWS
@given(a=rotations, b=rotations, c=rotations)
def test_unit_quaternions_are_a_group(a: Vector, b: Vector, c: Vector) -> None:
    qa, qb, qc = exp(a), exp(b), exp(c)
    for q in (qa, product(qa, qb)):
        assert abs(np.linalg.norm(q) - 1.0) < ROUNDING
    np.testing.assert_allclose(product(product(qa, qb), qc), product(qa, product(qb, qc)), atol=ROUNDING)
    np.testing.assert_allclose(product(qa, IDENTITY), qa, atol=ROUNDING)
    np.testing.assert_allclose(product(IDENTITY, qa), qa, atol=ROUNDING)
    inverse = call(_inverse, wp.quat, qa)
    np.testing.assert_allclose(product(qa, inverse), IDENTITY, atol=ROUNDING)
    np.testing.assert_allclose(exp(-np.array(a)), inverse, atol=ROUNDING)


@LAWS
@given(a=rotations, b=rotations, v=vectors(100.0), w=vectors(100.0))
def test_rotation_acts_on_vectors_and_keeps_lengths_angles_and_handedness(
    a: Vector, b: Vector, v: Vector, w: Vector
) -> None:
    qa, qb = exp(a), exp(b)
    size = 20.0 * EPS * (1.0 + np.linalg.norm(v))
    np.testing.assert_allclose(rotated(product(qa, qb), v), rotated(qa, rotated(qb, v)), atol=size)
    v_turned, w_turned = rotated(qa, v), rotated(qa, w)
    both = size * (1.0 + np.linalg.norm(w)) + 20.0 * EPS * np.linalg.norm(v) * np.linalg.norm(w)
    np.testing.assert_allclose(np.dot(v_turned, w_turned), np.dot(v, w), atol=both)
    np.testing.assert_allclose(np.cross(v_turned, w_turned), rotated(qa, np.cross(v, w)), atol=2.0 * both)


@LAWS
@given(a=rotations, v=vectors(1.0))
def test_a_quaternion_and_its_negative_are_the_same_rotation(a: Vector, v: Vector) -> None:
    q = exp(a)
    np.testing.assert_allclose(rotated(-q, v), rotated(q, v), atol=ROUNDING)
    np.testing.assert_array_equal(call(_yaw, float, -q), call(_yaw, float, q))
    if q[3] != 0.0:  # at half a turn both axes are right
        np.testing.assert_array_equal(log(-q), log(q))


@LAWS
@given(rotvec=vectors(2.0 * pi))
def test_exponential_is_half_the_angle_about_the_axis(rotvec: Vector) -> None:
    v = np.array(rotvec, np.float32).astype(float)
    angle = np.linalg.norm(v)
    axis_share = 0.5 * np.sinc(0.5 * angle / pi)  # sin(angle / 2) / angle, 1/2 at 0
    q = exp(v)
    np.testing.assert_allclose(q[:3], v * axis_share, rtol=ROUNDING, atol=3.0 * ROUNDING * min(angle, 1.0) + TINY)
    np.testing.assert_allclose(q[3], np.cos(0.5 * angle), atol=ROUNDING)


@LAWS
@given(rotvec=vectors(pi - 2.0e-3))
def test_logarithm_undoes_the_exponential_down_to_the_smallest_rotations(rotvec: Vector) -> None:
    v = np.array(rotvec, np.float32).astype(float)
    np.testing.assert_allclose(log(exp(v)), v, atol=5.0 * ROUNDING * min(np.linalg.norm(v), 1.0) + TINY)


@LAWS
@given(axis=vectors(1.0).filter(lambda a: np.linalg.norm(a) > 0.5), short_rad=st.floats(-1.0e-2, 1.0e-2))
def test_logarithm_near_half_a_turn_is_the_same_rotation_the_short_way(axis: Vector, short_rad: float) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    q = exp((pi + short_rad) * unit)
    rotvec = log(q)
    assert np.linalg.norm(rotvec) <= pi + ROUNDING
    same_rotation(exp(rotvec), q)
    if abs(short_rad) > 1.0e-4:
        expected = (pi + short_rad) if short_rad < 0.0 else (short_rad - pi)
        np.testing.assert_allclose(rotvec, expected * unit, atol=3.0 * ROUNDING)


@LAWS
@given(angle=angles)
def test_wrapped_angle_is_the_same_direction_within_half_a_turn(angle: float) -> None:
    wrapped = call(_wrap, float, angle)
    assert abs(wrapped) <= pi + 20.0 * ROUNDING  # float32 of 20 rad, in steps of 2e-6
    turns = (angle - wrapped) / (2.0 * pi)
    assert abs(turns - round(turns)) < 20.0 * ROUNDING


@LAWS
@given(yaw=angles, pitch=st.floats(-1.4, 1.4), roll=st.floats(-3.0, 3.0))
def test_yaw_is_the_heading_whatever_the_tilt(yaw: float, pitch: float, roll: float) -> None:
    level = call(_from_yaw, wp.quat, yaw)
    np.testing.assert_allclose(rotated(level, [1.0, 0.0, 0.0]), [np.cos(yaw), np.sin(yaw), 0.0], atol=ROUNDING)
    tilted = product(product(level, exp([0.0, pitch, 0.0])), exp([roll, 0.0, 0.0]))
    difference = call(_yaw, float, tilted) - yaw
    tolerance = 20.0 * ROUNDING / np.cos(pitch)
    assert abs(difference - 2.0 * pi * round(difference / (2.0 * pi))) < tolerance
