"""Conditions are read, or refused in one sentence; nothing of them is evaluated as code."""

import pytest

from mission.scenario.flight.quantities import VALUES
from mission.scenario.parts.conditions import QUANTITIES, Term, terms_of


def test_terms_are_joined_by_and():
    assert terms_of("altitude > 10 and speed<=2.5") == (Term("altitude", ">", 10.0), Term("speed", "<=", 2.5))


@pytest.mark.parametrize(
    "text", ["altitude", "altitude > ten", "altitude > 1 or speed > 2", "__import__('os')", "", "> 3"]
)
def test_anything_else_is_refused(text):
    with pytest.raises(ValueError, match="a condition is 'QUANTITY OP NUMBER'"):
        terms_of(text)


def test_an_unknown_quantity_is_named_with_the_nearest():
    with pytest.raises(ValueError, match="'altitud': no such quantity; did you mean altitude"):
        terms_of("altitud > 3")


@pytest.mark.parametrize(
    ("operator", "value", "room", "holds"),
    [
        ("<", 3.0, 2.0, True),
        ("<", 5.0, 0.0, False),
        ("<=", 5.0, 0.0, True),
        (">", 6.0, 1.0, True),
        ("==", 5.0, 0.0, True),
    ],
)
def test_room_is_positive_where_a_term_holds(operator, value, room, holds):
    term = Term("speed", operator, 5.0)
    assert term.room(value) == room
    assert term.holds(value) is holds


def test_every_quantity_has_a_value():
    assert VALUES.keys() == QUANTITIES.keys()
