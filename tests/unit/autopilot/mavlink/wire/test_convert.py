from math import inf, nan, pi, radians

import pytest

from autopilot.mavlink.wire.convert import (
    INT32_MAX,
    bounded_int,
    degrees_e7,
    degrees_from_e7,
    heading_centideg,
    i16,
    is_position,
    quat_from_wxyz,
    u16,
    whole,
    wxyz_from_quat,
)


def test_quaternion_orders():
    assert wxyz_from_quat((0.1, 0.2, 0.3, 0.9)) == (0.9, 0.1, 0.2, 0.3)
    assert quat_from_wxyz((0.9, 0.1, 0.2, 0.3)) == (0.1, 0.2, 0.3, 0.9)


def test_integers_saturate():
    assert i16(1e9) == 32_767
    assert i16(-1e9) == -32_768
    assert u16(-1.0) == 0


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_what_is_not_finite_becomes_the_default(value):
    assert bounded_int(value, 0, 10, 7) == 7


def test_positions_survive_the_round_trip():
    assert degrees_from_e7(degrees_e7(47.3977422)) == pytest.approx(47.3977422, abs=5e-8)
    assert degrees_e7(nan) == INT32_MAX
    assert degrees_from_e7(INT32_MAX) != degrees_from_e7(INT32_MAX)  # NaN


def test_heading_is_a_compass_heading():
    assert heading_centideg(radians(-90.0)) == 27_000
    assert heading_centideg(2.0 * pi) == 0
    assert heading_centideg(-1e-9) == 0
    assert heading_centideg(nan) == 65_535


def test_whole_numbers_only():
    assert whole(3.0, -1) == 3
    assert whole(3.5, -1) == -1
    assert whole(nan, -1) == -1
    assert whole(inf, -1) == -1


def test_positions_on_earth():
    assert is_position(nan, nan)
    assert is_position(-90.0, 180.0)
    assert not is_position(91.0, 0.0)
    assert not is_position(47.0, nan)
