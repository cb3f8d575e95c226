"""A flight with its companion on board, in one process and simulated time: the same flight byte for byte each time.

In: what the flight is made from, and who flies. Out: the flight, ready to be advanced; its companion speaks MAVLink
over a link in memory and gets the camera's pictures from memory, and is otherwise the one that flies as a process.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from autopilot.mavlink.transport.links import Link, LinkRole, LinkSource, memory_pair
from common.params import Parameter
from mission.flight import Flight, FlightConfig
from mission.flight_base import FlightBase
from mission.follow.follow_scoring import FollowWatch
from mission.follow.late_link import LateLink
from mission.follow.vehicle_setup import as_trained, owner_brake
from mission.script import set_out
from policies.companion.companion import Companion
from policies.companion.engagement import Phase
from policies.companion.guard.guard import Guard
from policies.companion.guard.settings import GuardSettings
from policies.companion.image_client import MemoryCamera
from policies.companion.skills.driving import Driving
from policies.companion.skills.following import Following, Pilot
from policies.companion.skills.navigating import Navigating
from policies.companion.skills.skill import Skill
from policies.companion.vector_pilot import DrivingPilot, NavigationPilot
from policies.tasks.follow_me.tracked.quick_vehicle import BRAKE_PARAMETERS
from sim.world.world import WorldMap

_SET_OUT_S, _ENGAGE_S = 40.0, 5.0  # at most, until it hovers, and until it follows


def flight_with_companion(
    config: FlightConfig,
    pilot: Pilot | NavigationPilot,
    *,
    is_reported: bool = True,
    links: Sequence[Link | LinkSource] = (),
    folder: Path | None = None,
    wall_s: Callable[[], float] | None = None,
    make_flight: Callable[..., FlightBase] = Flight,
    guard: GuardSettings | None = None,
) -> tuple[Any, Companion]:
    """A flight, and the companion on board that follows, which engages as soon as the vehicle hovers or is armed.

    Args:
        config: with an owner; with the scanner where a pilot navigates.
        pilot: who flies or drives, by what it sees of the owner or by what stands on the way to them.
        is_reported: False: it waits for the pilot to choose Offboard.
        links: of ground stations.
        folder: of the logs.
        wall_s: a clock that the companion's latency is measured with.
        make_flight: takes the configuration, links and a folder.
        guard: who bounds the pilot; None: as it ships.
    """
    vehicle_end, companion_end = memory_pair(LinkRole.ONBOARD)
    is_ours = make_flight is Flight
    if is_ours and not isinstance(pilot, NavigationPilot):
        config = as_trained(config, pilot)
    flight = make_flight(config, links=[vehicle_end, *links], folder=folder)
    if flight.onboard is None:
        raise ValueError("a companion needs a flight with an owner")
    camera = MemoryCamera()
    flight.onboard.add_sink(camera.publish)
    skill: Skill
    if isinstance(pilot, NavigationPilot):
        skill = Navigating(pilot, camera=camera, guard=guard)
    else:
        skill = Following(camera, pilot, guard or GuardSettings())
        if isinstance(flight, Flight) and skill.guard is not None:
            _tell_brakes(flight, skill.guard, is_ours=is_ours)
    lag_s = config.owner.numbers.get("setpoint_lag_s", 0.0) if config.owner is not None else 0.0
    link = LateLink(companion_end, lag_s, lambda: flight.time_us) if lag_s > 0.0 else companion_end
    companion = Companion(link, skill, is_reported=is_reported, wall_s=wall_s)
    flight.computers.append(companion)
    return flight, companion


def _tell_brakes(flight: Flight, guard: Guard, *, is_ours: bool) -> None:
    """Tells a guard how a vehicle brakes, whose inner loops may be another's, and again when its parameters change."""

    def tell(changed: Parameter | None = None) -> None:
        if changed is None or changed.name in BRAKE_PARAMETERS:
            guard.reckon_with_brake(owner_brake(flight.config, flight.params, is_ours=is_ours))

    tell()
    flight.params.on_change(tell)


def follow_for(
    flight: FlightBase,
    companion: Companion,
    seconds: float,
    on_frame: Callable[[FollowWatch], None] = lambda _: None,
) -> FollowWatch:
    """Sets out, follows for so long, closes the flight; what was followed. One that never begins follows nobody.

    Args:
        flight: with an owner.
        companion: on board.
        seconds: of following.
        on_frame: called after each frame of it.
    """
    try:
        flight.fly(set_out, seconds=_SET_OUT_S)
        end_us = flight.time_us + round(_ENGAGE_S * 1e6)
        flight.run(lambda _: companion.phase is Phase.FLYING or flight.time_us >= end_us)
        watch = FollowWatch(flight, lambda: companion.phase is Phase.FLYING, seconds)
        watch.begin()

        def look(_: FlightBase) -> None:
            watch.frame()
            on_frame(watch)

        flight.run(lambda _: watch.is_over, on_frame=look)
    finally:
        flight.close()
    return watch


def flight_with_navigator(
    config: FlightConfig,
    pilot: NavigationPilot,
    *,
    is_reported: bool = True,
    links: Sequence[Link | LinkSource] = (),
    folder: Path | None = None,
    guard: GuardSettings | None = None,
) -> tuple[Flight, Companion]:
    """A flight, and the companion on board that navigates to each goto, and along the plan.

    Args:
        config: of a forest.
        pilot: who flies.
        is_reported: False: it waits for the pilot to choose Offboard.
        links: of ground stations.
        folder: of the logs.
        guard: who bounds the pilot; None: as it ships.
    """
    vehicle_end, companion_end = memory_pair(LinkRole.ONBOARD)
    flight = Flight(config, links=[vehicle_end, *links], folder=folder)
    skill = Navigating(pilot, is_ordered_by_goto=is_reported, guard=guard)
    companion = Companion(companion_end, skill, is_reported=is_reported)
    flight.computers.append(companion)
    return flight, companion


def flight_with_driver(
    config: FlightConfig,
    pilot: DrivingPilot,
    *,
    is_reported: bool = True,
    is_by_sticks: bool = False,
    links: Sequence[Link | LinkSource] = (),
    folder: Path | None = None,
    world: WorldMap | None = None,
    guard: GuardSettings | None = None,
) -> tuple[Flight, Companion]:
    """A rover's flight, and the companion on board that drives to each goto, and along the plan.

    Args:
        config: of a rover with a ring of range finders.
        pilot: who drives.
        is_reported: False: it waits for the pilot to choose Offboard.
        is_by_sticks: it drives by MANUAL_CONTROL, and not in Offboard.
        links: of ground stations.
        folder: of the logs.
        world: the ground; None: as the configuration says.
        guard: who bounds the pilot; None: as it ships.
    """
    vehicle_end, companion_end = memory_pair(LinkRole.ONBOARD)
    flight = Flight(config, links=[vehicle_end, *links], folder=folder, world=world)
    skill = Driving(pilot, is_ordered_by_goto=is_reported, guard=guard)
    companion = Companion(companion_end, skill, is_reported=is_reported, is_by_sticks=is_by_sticks)
    flight.computers.append(companion)
    return flight, companion
