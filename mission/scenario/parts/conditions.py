"""Conditions as people write them: `altitude > 10 and speed < 2`, read once, without evaluating any code.

QUANTITY OP NUMBER, joined by `and`. Which quantities there are, with their units and meanings, is said here; what they
are worth in a flight is in `quantities.py`. Light to import.
"""

import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator

from common.config.refusal import nearest

QUANTITIES: dict[str, tuple[str, str]] = {
    "time": ("s", "simulated time since power-on"),
    "north": ("m", "true position, north of home"),
    "east": ("m", "true position, east of home"),
    "altitude": ("m", "true height above home"),
    "above_ground": ("m", "true height above the ground under it"),
    "distance": ("m", "true horizontal distance from home"),
    "speed": ("m/s", "true horizontal speed"),
    "climb": ("m/s", "true vertical speed, up"),
    "airspeed": ("m/s", "indicated, of what has a pitot tube"),
    "tilt": ("deg", "true angle between its down and down"),
    "roll": ("deg", "true"),
    "pitch": ("deg", "true, nose up"),
    "heading": ("deg", "true, clockwise from north, 0 to 360"),
    "position_error": ("m", "estimate from truth, horizontal"),
    "height_error": ("m", "estimate from truth, vertical"),
    "velocity_error": ("m/s", "estimate from truth"),
    "tilt_error": ("deg", "estimate from truth"),
    "heading_error": ("deg", "estimate from truth"),
    "clearance": ("m", "to the nearest tree, wall or box"),
    "battery": ("", "fraction of its charge that is left, as the vehicle believes"),
    "mission_item": ("", "that is flown, from 0"),
    "armed": ("", "1 while it is armed"),
}
OPERATORS = ("<=", ">=", "<", ">", "==")
_TERM = re.compile(r"\s*([A-Za-z_]\w*)\s*(<=|>=|==|<|>)\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*\Z")
_FORM = "'QUANTITY OP NUMBER', joined by 'and', as 'altitude > 10 and speed < 2'"


@dataclass(frozen=True, slots=True)
class Term:
    """One comparison."""

    quantity: str
    operator: str
    number: float

    def room(self, value: Any) -> Any:
        """How far a value, or an array of them, is from the bound, positive where the term holds."""
        if self.operator in ("<", "<="):
            return self.number - value
        if self.operator in (">", ">="):
            return value - self.number
        return -abs(value - self.number)

    def holds(self, value: Any) -> Any:
        """Whether it holds of a value, or of which of an array."""
        room = self.room(value)
        return room > 0.0 if self.operator in ("<", ">") else room >= 0.0


def terms_of(text: str) -> tuple[Term, ...]:
    """The comparisons of a condition, all of which have to hold.

    Raises:
        ValueError: it is none; the message is a sentence.
    """
    terms = []
    for part in re.split(r"\band\b", text):
        found = _TERM.match(part)
        if found is None:
            raise ValueError(f"'{text}': a condition is {_FORM}")
        name, operator, number = found.groups()
        if name not in QUANTITIES:
            known = f"There are {', '.join(QUANTITIES)}"
            raise ValueError(
                f"'{name}': no such quantity; {' '.join(filter(None, (nearest(name, QUANTITIES), known)))}"
            )
        try:
            terms.append(Term(name, operator, float(number)))
        except ValueError:
            raise ValueError(f"'{number}': no number; a condition is {_FORM}") from None
    return tuple(terms)


def _checked(text: str) -> str:
    terms_of(text)
    return text


Condition = Annotated[str, AfterValidator(_checked)]
