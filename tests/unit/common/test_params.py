from math import inf, nan, pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot.params import all_parameters
from common.params import Parameter, ParameterError, ParameterTable

SPEED = Parameter("SPEED", 5.0, 0.5, 20.0, "m/s", "cruise speed", "guess", field="cruise_speed")
COUNT = Parameter("COUNT", 3, 0, 9, "", "how many", "guess")
ANGLE = Parameter("ANGLE", 45.0, 0.0, 90.0, "deg", "largest tilt", "guess", field="tilt_max")
SHARE = Parameter("SHARE", 20.0, 0.0, 100.0, "%", "a share", "guess", field="share")


@pytest.fixture
def table():
    return ParameterTable([SPEED, COUNT, ANGLE, SHARE])


def test_names_are_dense_and_alphabetical(table):
    assert table.names == ["ANGLE", "COUNT", "SHARE", "SPEED"]
    assert list(table) == table.names
    assert len(table) == 4
    assert "SPEED" in table
    assert "SPEEDS" not in table


def test_defaults_count_until_something_is_set(table):
    assert table["SPEED"] == 5.0
    assert table.set("SPEED", 7.0) == 7.0
    assert table["SPEED"] == 7.0


@pytest.mark.parametrize(("asked", "stored"), [(1e9, 20.0), (-1.0, 0.5), (nan, 5.0), (inf, 5.0), (-inf, 5.0)])
def test_out_of_range_is_clamped_and_no_number_changes_nothing(table, asked, stored):
    assert table.set("SPEED", asked) == stored
    assert table["SPEED"] == stored


def test_integers_stay_integers(table):
    stored = table.set("COUNT", 4.6)
    assert stored == 5
    assert isinstance(stored, int)
    assert table.set("COUNT", 99.0) == 9


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("NOPE", 1.0, "parameter NOPE: there is none of that name"),
        ("SPEED", 21.0, "parameter SPEED: 21 is not between 0.5 and 20"),
        ("SPEED", nan, "parameter SPEED: nan is not between"),
        ("COUNT", 1.5, "parameter COUNT: 1.5 is not a whole number"),
    ],
)
def test_exact_setting_refuses_what_it_would_have_to_change(table, name, value, message):
    with pytest.raises(ParameterError, match=message):
        table.set_exactly(name, value)
    table.set_exactly("SPEED", 6.5)
    table.set_exactly("COUNT", 4.0)
    assert (table["SPEED"], table["COUNT"]) == (6.5, 4)


@given(value=st.floats(width=32))
def test_what_is_stored_is_always_within_bounds(value):
    table = ParameterTable([SPEED, COUNT])
    for name in table:
        declaration = table.declarations[name]
        assert declaration.minimum <= table.set(name, value) <= declaration.maximum


def test_listeners_hear_of_changes_only(table):
    heard = []
    table.on_change(lambda declaration: heard.append((declaration.name, table["SPEED"])))
    table.set("SPEED", 5.0)
    table.set("SPEED", nan)
    assert heard == []
    table.set("SPEED", 100.0)
    table.set("SPEED", 200.0)  # clamped to what it is already
    assert heard == [("SPEED", 20.0)]


def test_kernel_fields_are_in_si(table):
    assert table.fields([SPEED, COUNT, ANGLE, SHARE]) == pytest.approx(
        {"cruise_speed": 5.0, "tilt_max": pi / 4, "share": 0.2}
    )
    assert table.si("ANGLE") == radians(45.0)


def test_unknown_name_is_an_error(table):
    with pytest.raises(KeyError):
        table.set("NOPE", 1.0)
    with pytest.raises(KeyError):
        table["NOPE"]


@pytest.mark.parametrize(
    ("declarations", "message"),
    [
        ([SPEED, SPEED], "SPEED is declared twice"),
        ([Parameter("A" * 17, 0, 0, 1, "", "", "")], "longer than 16 characters"),
        ([Parameter("LOW", 0, 1, 2, "", "", "")], "default 0 is out of bounds"),
    ],
)
def test_wrong_declarations_are_refused(declarations, message):
    with pytest.raises(ValueError, match=message):
        ParameterTable(declarations)


@pytest.mark.parametrize("declaration", all_parameters(), ids=lambda declaration: declaration.name)
def test_every_declaration_is_complete(declaration):
    assert declaration.meaning
    assert declaration.source
    assert declaration.name == declaration.name.upper()
    assert declaration.minimum <= declaration.default <= declaration.maximum
    assert declaration.clamped(declaration.default) == declaration.default
