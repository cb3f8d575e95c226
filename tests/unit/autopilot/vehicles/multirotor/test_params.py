import math

import pytest

from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS, ControlParams, control_params
from common.params import ParameterTable


def test_every_field_has_exactly_one_declaration() -> None:
    fields = [item.field for item in CONTROL_PARAMETERS]
    assert sorted(fields) == sorted(ControlParams.vars)


def test_defaults_fill_the_struct_in_si() -> None:
    params = control_params()
    assert params.tilt_max == pytest.approx(math.radians(45.0))
    assert params.rate_max_roll == pytest.approx(math.radians(220.0))
    assert control_params({"pos_p_xy": 1.25}).pos_p_xy == 1.25


def test_every_declaration_is_valid_and_says_where_its_default_comes_from() -> None:
    table = ParameterTable(CONTROL_PARAMETERS)
    assert len(table) == len(CONTROL_PARAMETERS)
    assert all(item.source and item.meaning for item in CONTROL_PARAMETERS)
