"""Where the vehicles of a fleet boot, and the configuration of each.

In: which they are, a base configuration, the world. Out: one `FlightConfig` per vehicle, with which it
flies the same alone: numbered from 1 in MAV_SYS_ID, a seed of its own, side by side from home on.
"""

from collections.abc import Iterator, Sequence

from autopilot.mavlink.server import SYSID_PARAMETER
from common.airframe import load_airframe
from common.params import ParameterError
from mission.console.option_checks import UserError
from mission.fleet.fleet_options import Member
from mission.flight_config import FlightConfig, flight_parameters
from mission.flight_settings import OURS
from sim.world.world import WorldMap

SPACING_M = 10.0  # less, and rovers on the default mission run over who has landed
SEED_MAX = 2**31 - 1
_FREE_M = 1.0  # to trees, walls and boxes, beyond half the spacing at most; guess
_LEVEL = 0.99  # of the ground's normal: 8 deg, on which every class stands
_RINGS_MAX = 100


def fleet_configs(
    base: FlightConfig, members: Sequence[Member], world: WorldMap, spacing_m: float = SPACING_M
) -> list[FlightConfig]:
    """The configuration of each vehicle of a fleet.

    Args:
        base: what they have in common; the first boots at its home.
        members: which they are.
        world: the ground.
        spacing_m: between neighbours.

    Raises:
        UserError: there is no room for so many.
        ParameterError, AirframeError: as of any flight.
    """
    places = free_places(world, len(members), spacing_m)
    return [
        base.model_copy(
            update={
                "airframe": member.airframe,
                "seed": (base.seed + i) % (SEED_MAX + 1),
                "start_ne_m": place,
                "parameters": _own_parameters(base, member, i + 1),
            }
        )
        for i, (member, place) in enumerate(zip(members, places, strict=True))
    ]


def check_fleet_parameters(base: FlightConfig, members: Sequence[Member]) -> None:
    """Refuses parameters that no vehicle of a fleet has, or values that they cannot have; others' are theirs to judge.

    Raises:
        ParameterError: of the first such.
    """
    known: set[str] = set()
    for member in dict.fromkeys(members):
        own = _own_parameters(base, member, 1)
        if member.board in OURS:
            flight_parameters(base.model_copy(update={"parameters": own}), load_airframe(member.airframe))
        known |= own.keys()
    unknown = {name: value for name, value in base.parameters.items() if name not in known}
    flight_parameters(base.model_copy(update={"parameters": unknown}), load_airframe(members[0].airframe))


def _own_parameters(base: FlightConfig, member: Member, number: int) -> dict[str, float]:
    """Those of the given ones that a vehicle has, and its number; another program's are all, it knows its number.

    Raises:
        ParameterError: the number of the vehicle is one of them.
    """
    if SYSID_PARAMETER in base.parameters:
        raise ParameterError(f"{SYSID_PARAMETER}: several vehicles are numbered from 1, leave it out")
    if member.board not in OURS:
        return base.parameters
    has = flight_parameters(base.model_copy(update={"parameters": {}}), load_airframe(member.airframe))
    return {name: value for name, value in base.parameters.items() if name in has} | {SYSID_PARAMETER: float(number)}


def free_places(world: WorldMap, count: int, spacing_m: float) -> list[tuple[float, float]]:
    """Where vehicles boot, north and east of home [m]: home first, then the nearest points of a grid on free ground.

    Raises:
        UserError: the world has too few.
    """
    free: list[tuple[float, float]] = [(0.0, 0.0)]
    for north, east in _grid(spacing_m, 0.5 * world.config.size_m):
        if len(free) == count:
            break
        height = float(world.height(north, east))
        gap_m = float(world.obstacle_distance([north, east, -height - 0.3]))
        if gap_m > _FREE_M and -float(world.normal_ned(north, east)[2]) > _LEVEL:
            free.append((north, east))
    if len(free) < count:
        raise UserError(f"--vehicles: the world has free ground for {len(free)} vehicles {spacing_m:g} m apart")
    return free[:count]


def _grid(spacing_m: float, half_size_m: float) -> Iterator[tuple[float, float]]:
    """Points of a square grid round home, without home: ring by ring, the nearest of a ring first."""
    for ring in range(1, _RINGS_MAX):
        if ring * spacing_m >= half_size_m:
            return
        steps = range(-ring, ring + 1)
        around = [(i, j) for i in steps for j in steps if max(abs(i), abs(j)) == ring]
        for i, j in sorted(around, key=lambda at: (at[0] ** 2 + at[1] ** 2, -at[1], at[0])):
            yield i * spacing_m, j * spacing_m
