"""A control law: the kernel half of a vehicle class, as data and functions.

`autopilot.advance` composes a law with the estimator; whoever adds a class of vehicles writes these members.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from common.params import Parameter


class ControlLaw(NamedTuple):
    """What flies or drives a class of vehicles, one row of each struct per vehicle."""

    Params: type
    """Kernel struct of the gains and limits, from the parameter table."""
    Airframe: type
    """Kernel struct of what the law knows of the body that it controls."""
    State: type
    """Kernel struct of what it remembers; all zero after power-on. Its `actuators` are the autopilot's `Actuators`."""
    tick: Any
    """`@wp.func (Params, Airframe, State, Estimate, Setpoint, BatterySample, tick: int) -> State`, every 4 ms."""
    default_params: Callable[[], Any]
    """Makes a `Params` of the defaults."""
    airframe_row: Callable[[Any], Any]
    """Makes an `Airframe` from the airframe file."""
    parameters: tuple[Parameter, ...]
    """What fills `Params` from a parameter table."""
