"""What Navigate asks of a vehicle, of what flies and of what drives: one name each, told apart by the rig's arrays."""

import warp as wp

from policies.tasks.flight.driven_vehicle import RoverArrays, vary_rover
from policies.tasks.flight.flight_params import FlightParams
from policies.tasks.flight.flown_vehicle import Makes, own_state, vary_vehicle
from policies.tasks.flight.own_state import OwnState
from sim.advance import RigArrays
from sim.truth import has_touched

wp.set_module_options({"enable_backward": False})


@wp.func
def vary(
    rig: RigArrays,
    makes: Makes,
    flight: FlightParams,
    seed: int,
    i: int,
    episode: int,
) -> None:
    """Gives row i the air, the sensors and the make of its episode."""
    vary_vehicle(rig, makes, flight, seed, i, episode)


@wp.func  # type: ignore[no-redef]
def vary(  # noqa: F811
    rig: RoverArrays,
    makes: Makes,
    flight: FlightParams,
    seed: int,
    i: int,
    episode: int,
) -> None:
    vary_rover(rig, makes, flight, 1.0, 1.0, seed, i, episode)


@wp.func
def own(rig: RigArrays, i: int, has_estimator: int) -> OwnState:
    """What a policy is told of its vehicle."""
    return own_state(rig, i, has_estimator)


@wp.func  # type: ignore[no-redef]
def own(rig: RoverArrays, i: int, has_estimator: int) -> OwnState:  # noqa: F811
    standing = own_state(rig, i, has_estimator)
    standing.is_height_valid = 0  # it carries no range finder that looks down
    return standing


@wp.func
def touches(rig: RigArrays, i: int) -> bool:
    """Whether it has touched anything solid, ground that it stands on apart."""
    return has_touched(rig.truth[i])


@wp.func  # type: ignore[no-redef]
def touches(rig: RoverArrays, i: int) -> bool:  # noqa: F811
    return rig.truth[i].impact_speed > 0.0 or rig.truth[i].is_crashed == 1


@wp.func
def goal_shown(rig: RigArrays, shown: OwnState, goal_ned: wp.vec3) -> wp.vec3:  # noqa: ARG001
    """The goal as a policy is told of it [m]; what drives is not told how high it lies: the ground decides."""
    return goal_ned


@wp.func  # type: ignore[no-redef]
def goal_shown(rig: RoverArrays, shown: OwnState, goal_ned: wp.vec3) -> wp.vec3:  # noqa: F811, ARG001
    return wp.vec3(goal_ned[0], goal_ned[1], shown.pos_ned[2])
