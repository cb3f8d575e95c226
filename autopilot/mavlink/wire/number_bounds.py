"""How large a number may be that comes in over a link: the one place that says so.

Every service asks here where a message becomes a request. NaN says "not set" in MAVLink and is left to who reads the
field; what is infinite, or larger than any vehicle here can mean, is refused. A vehicle's own limits (its speeds and
turn rates) are applied where it flies.
"""

from collections.abc import Iterable

POSITION_MAX_M = 1.0e6  # on any axis; from there on single precision knows no decimetres
SPEED_MAX_M_S = 1.0e3
ACCEL_MAX_M_S2 = 1.0e3
ANGLE_MAX_RAD = 1.0e3  # clients count turns
RATE_MAX_RAD_S = 1.0e3
PARAMETER_MAX = 1.0e10  # of commands and mission items, whatever it stands for: integers of 32 bits are among them


def is_within(limit: float, *values: float) -> bool:
    """Whether each value is not set (NaN), or of a size there is."""
    return all(value != value or -limit <= value <= limit for value in values)


def is_known(limit: float, *values: float) -> bool:
    """Whether each value is set, and of a size there is."""
    return all(-limit <= value <= limit for value in values)


def first_outside(limit: float, values: Iterable[float]) -> int | None:
    """The position of the first value that is neither NaN nor of a size there is."""
    for i, value in enumerate(values):
        if not (value != value or -limit <= value <= limit):
            return i
    return None
