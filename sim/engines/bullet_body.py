"""What a class of bodies gives the engine pybullet: what its legs or wheels and the air do to it, and its hull."""

from collections.abc import Callable
from typing import Any, NamedTuple


class Hull(NamedTuple):
    """The solid part of one vehicle."""

    shape: int
    """Of Bullet's."""
    friction: float
    """Of the hull; the ground's is 1, Bullet takes the product."""
    crash_m_s: float
    """A blow faster than this along the contact's normal ends it."""
    feet_from_m: float | None
    """What touches below this, along frd z [m], is a foot; the ground must not touch the rest. None: it has no feet."""


class BulletBody(NamedTuple):
    """A class of bodies. The kernel functions leave out motion; of obstacles their world has other vehicles alone."""

    Inputs: type
    """Kernel struct of what stays the same over the substeps of a tick."""
    begin: Any
    """`@wp.func (Model, State, command: vec8, wind_ned: vec3, World) -> (State, Inputs)`, every 4 ms."""
    wrench: Any
    """`@wp.func (Model, State, Inputs) -> (State, Inputs, force_frd [N], torque_frd [N m])`, every millisecond."""
    end: Any
    """`@wp.func (Model, State, Inputs) -> State`: battery and what else is judged once a tick."""
    hull: Callable[[Any, int], Hull]
    """Makes the hull from a row of `Model` and Bullet's client."""
