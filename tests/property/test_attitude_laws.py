"""Rotations in plain numbers: the group's axioms, and angles there and back."""

from math import cos, isclose, pi, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from common.attitude import inverse, product, quat_of, roll_pitch_yaw_of, rotated, wrapped, yaw_of

ROUNDING = 1e-9
parts = st.floats(-1.0, 1.0)
angles = st.floats(-3.1, 3.1)
vectors = st.tuples(*[st.floats(-100.0, 100.0)] * 3)


@st.composite
def rotations(draw):
    q = draw(st.tuples(parts, parts, parts, parts))
    length = sum(element * element for element in q) ** 0.5
    assume(length > 0.1)
    return tuple(element / length for element in q)


@given(rotations(), rotations(), vectors)
def test_turning_twice_is_turning_by_the_product(a, b, v):
    assert rotated(product(a, b), v) == pytest.approx(rotated(a, rotated(b, v)), abs=1e-9)


@given(rotations(), vectors)
def test_inverse_turns_back(q, v):
    assert rotated(inverse(q), rotated(q, v)) == pytest.approx(v, abs=1e-9)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_angles_are_those_it_was_made_of(yaw, pitch, roll):
    q = product(quat_of(yaw, pitch), (sin(0.5 * roll), 0.0, 0.0, cos(0.5 * roll)))
    assert roll_pitch_yaw_of(q) == pytest.approx((roll, pitch, yaw), abs=1e-6)
    assert yaw_of(q) == roll_pitch_yaw_of(q)[2]


def test_a_positive_yaw_turns_north_to_east():
    assert rotated(quat_of(0.5 * pi, 0.0), (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))


@given(st.floats(-50.0, 50.0))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle):
    assert -pi <= wrapped(angle) <= pi
    assert isclose(cos(wrapped(angle)), cos(angle), abs_tol=ROUNDING)
    assert isclose(sin(wrapped(angle)), sin(angle), abs_tol=ROUNDING)
