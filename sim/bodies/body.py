"""A body of the native engine: what is moved, as data and functions. The multirotor's is the first."""

from collections.abc import Callable
from typing import Any, NamedTuple

from autopilot.vehicles.multirotor.law import MULTIROTOR_LAW
from sim.bodies.multirotor import (
    BodyState,
    body_at_rest,
    body_substep,
    body_tick,
    body_truth,
    standing_height,
)
from sim.bodies.multirotor_model import MultirotorModel, multirotor_model
from sim.world.neighbours import Outline, ball_outline


class Body(NamedTuple):
    """A class of bodies, one row of each struct per vehicle."""

    Model: type
    """Kernel struct of the constants of one airframe at one position."""
    State: type
    """Kernel struct of all that the body needs to go on; with `pos_ned`, `vel_ned` and `impact_speed` as in `Truth`.

    One whose battery can be emptied has `battery_charge_c`, one that can be held in the hand `is_held`.
    """
    tick: Any
    """`@wp.func (Model, State, command: vec8, wind_ned: vec3, World) -> State`, every 4 ms."""
    truth: Any
    """`@wp.func (State) -> Truth`: what others may read."""
    at_rest: Any
    """`@wp.func (Model, pos_ned, yaw: float) -> State`: level and still, battery full."""
    standing_height: Any
    """`@wp.func (Model) -> float`: of the centre of gravity over the ground [m]."""
    model: Callable[[Any, float], Any]
    """Makes a `Model` from the airframe file and the altitude of home [m]."""
    substep: Any = None
    """As `tick`, a millisecond of it, for boards that fly it at 1,000 Hz; None: 250 Hz are enough for it."""
    outline: Callable[[Any], Outline] = ball_outline
    """What other vehicles meet of one, from a row of its `Model`."""


MULTIROTOR_BODY = Body(
    MultirotorModel,
    BodyState,
    body_tick,
    body_truth,
    body_at_rest,
    standing_height,
    multirotor_model,
    body_substep,
)
# Of a rig that is told of no other class.
DEFAULT_BODY, DEFAULT_LAW = MULTIROTOR_BODY, MULTIROTOR_LAW
