"""Flights made from a scenario: their configurations, the world, links, and the companion that a policy flies.

In: a checked scenario and a seed. Out: vehicles that have not begun, each with who watches it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from autopilot.mavlink.client_end import GROUND_STATION, ClientEnd
from autopilot.mavlink.transport.links import Link, LinkRole, memory_pair
from common.config.refusal import sentence
from common.geodesy import DEFAULT_HOME, GeoPoint
from mission.console.option_checks import UserError
from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import Member
from mission.fleet.roster import fleet_configs
from mission.flight import Flight
from mission.flight_config import AIRFIELD, TREELESS_M, FlightConfig, OwnerConfig
from mission.kernel_loading import load_kernels
from mission.scenario.flight.checking import (
    airframe_of,
    check_checks,
    check_faults,
    check_orders,
    check_parameters,
    check_purpose,
    check_starts,
    check_steps,
)
from mission.scenario.parts.part import KeyRefusal
from mission.scenario.scenario import Scenario, Vehicle, World
from mission.simulator.flight_rig import flight_world
from mission.world.world_reader import read_world
from sim.bodies.vehicles import class_of
from sim.world.driving_worlds import CAR_PARK, COURSE
from sim.world.forest_world import FOREST, WALLED_FOREST
from sim.world.world import WorldConfig

KINDS = {
    "hills": WorldConfig(treeless_radius_m=TREELESS_M),
    "plain": WorldConfig(hill_height_m=0.0, trees_per_ha=0.0),
    "airfield": AIRFIELD,
    "forest": FOREST.model_copy(update={"trees_per_ha": 400.0}),
    "walled-forest": WALLED_FOREST,
    "course": COURSE,
    "car-park": CAR_PARK,
}
FORESTS = ("forest", "walled-forest")
STATION_SYSTEM, STATION_COMPONENT = 255, 190  # as QGroundControl's


class GroundStation:
    """A ground station that is connected, and can be cut off; a computer of the flight."""

    def __init__(self) -> None:
        self.vehicle_end, self._link = memory_pair(LinkRole.GROUND)
        self._client = ClientEnd(self._link, STATION_SYSTEM, STATION_COMPONENT, mav_type=GROUND_STATION)
        self.is_cut = False

    def frame(self, time_us: int) -> None:
        """Hears the vehicle, and sends its heartbeat."""
        self._link.receive()
        if not self.is_cut:
            self._client.keep_alive(time_us)


def _kind(name: str) -> WorldConfig:
    """The world that a kind stands for."""
    if name == "follow":
        from policies.tasks.follow_me.world import FOLLOW_WORLD

        return FOLLOW_WORLD
    return KINDS[name]


def world_config(world: World) -> WorldConfig:
    """The ground as the world module has it.

    Raises:
        KeyRefusal: it cannot be made so.
    """
    if world.file is not None:
        return _world_of(world.file)
    given = {k: v for k, v in world.model_dump(exclude={"kind", "file"}).items() if v is not None}
    try:
        return WorldConfig(**{**_kind(world.kind).model_dump(), **given})
    except ValidationError as error:
        first = error.errors()[0]
        raise KeyRefusal(("world", *first["loc"]), sentence(first, WorldConfig)) from error


def _world_of(file: Path) -> WorldConfig:
    """The world of a file."""
    key = ("world", "file")
    if not file.is_file():
        raise KeyRefusal(key, f"{file}: no such file")
    try:
        return read_world(file)
    except UserError as error:
        raise KeyRefusal(key, str(error)) from error


def flight_configs(scenario: Scenario, seed: int) -> list[FlightConfig]:
    """The configuration of each vehicle, with its parameters checked.

    Raises:
        KeyRefusal: an airframe, a parameter or the world is wrong.
    """
    base, own = _own_configs(scenario, seed)
    return own if len(own) == 1 else _placed(base, scenario, own)


def load_scenario_kernels(scenario: Scenario) -> None:
    """Loads the kernels that a scenario is flown by; those that the cache lacks are compiled, which takes minutes."""
    if scenario.owner is not None:
        import mission.follow.onboard_camera
        import mission.follow.owner_device
        import mission.scenario.flight.companions  # noqa: F401  (their kernels are loaded with the others)
    try:
        _, configs = _own_configs(scenario, scenario.seeds[0])
    except UserError:
        return  # who flies it says so
    for config in {(config.airframe, config.has_lidar): config for config in configs}.values():
        load_kernels(lambda _: None, config, has_camera=False)


def _own_configs(scenario: Scenario, seed: int) -> tuple[FlightConfig, list[FlightConfig]]:
    """What all vehicles have in common, and the configuration of each, which is not yet in its place.

    Raises:
        KeyRefusal: an airframe, a parameter or the world is wrong.
    """
    fleet = scenario.fleet
    home = DEFAULT_HOME if scenario.home is None else GeoPoint(*scenario.home.model_dump().values())
    base = FlightConfig(
        seed=seed,
        wind_m_s=scenario.wind.speed_m_s,
        wind_from_deg=scenario.wind.from_deg,
        noise=scenario.noise,
        sensor_roughness=scenario.sensor_roughness,
        engine=scenario.engine,
        traffic_count=scenario.traffic,
        home=home,
        world=world_config(scenario.world),
        owner=None if scenario.owner is None else OwnerConfig(**scenario.owner.model_dump()),
    )
    own = []
    for key, vehicle in zip(scenario.fleet_keys, fleet, strict=True):
        airframe = airframe_of(vehicle, key)
        own.append(_own(base, scenario, vehicle, drives=class_of(airframe).drives))
        check_parameters(own[-1], airframe, key)
    return base, own


def check_scenario(scenario: Scenario, file: str, *, is_whole: bool = True) -> None:
    """Refuses what can be seen to be wrong before anything is flown.

    Args:
        scenario: what is to be flown.
        file: how refusals call a scenario that was read from no file; others have file and line of the key.
        is_whole: nobody tells the vehicles anything besides.

    Raises:
        UserError: an airframe, parameter, plan, policy or function is not there, a step, a fault or a check is of what
            a vehicle has not, or a vehicle starts where it cannot.
    """
    try:
        configs = flight_configs(scenario, scenario.seeds[0])
        check_orders(scenario)
        check_steps(scenario, configs)
        check_faults(scenario, configs)
        check_checks(scenario, configs)
        check_starts(scenario, configs)
        if is_whole:
            check_purpose(scenario)
    except UserError as error:
        raise UserError(scenario.refusal(error, file)) from error


def _own(base: FlightConfig, scenario: Scenario, vehicle: Vehicle, *, drives: bool) -> FlightConfig:
    follows_on_wheels = scenario.owner is not None and drives
    return base.model_copy(
        update={
            "airframe": vehicle.airframe,
            "throw_m_s": vehicle.throw_m_s,
            "has_lidar": vehicle.has_lidar,
            "has_base": vehicle.has_base,
            "start_ne_m": vehicle.start.ne_m,
            "start_heading_deg": vehicle.start.heading_deg,
            "parameters": dict(vehicle.parameters),
            "is_forest": vehicle.policy is not None and (scenario.world.kind in FORESTS or follows_on_wheels),
            "scan_lag_s": 0.0 if vehicle.policy is None else vehicle.policy.scan_lag_s,
        }
    )


def _placed(base: FlightConfig, scenario: Scenario, own: list[FlightConfig]) -> list[FlightConfig]:
    """Side by side where they have no place of their own, each with its number and seed."""
    members = [Member(config.airframe, "own") for config in own]
    try:
        placed = fleet_configs(base, members, flight_world(base))
    except UserError as error:
        raise KeyRefusal(("vehicles",), str(error).removeprefix("--vehicles: ")) from error
    fleet = []
    for config, mine, vehicle in zip(placed, own, scenario.fleet, strict=True):
        has_place = "ne_m" in vehicle.start.model_fields_set
        fleet.append(
            mine.model_copy(
                update={
                    "seed": config.seed,
                    "start_ne_m": mine.start_ne_m if has_place else config.start_ne_m,
                    "parameters": {**mine.parameters, **config.parameters},
                }
            )
        )
    return fleet


class Built:
    """The flights of a scenario, before their first frame.

    Args:
        scenario: what is flown.
        seed: of noise, turbulence and the owner's path.
        folder: where logs go; None writes none.

    Raises:
        UserError: it cannot be built.
    """

    def __init__(self, scenario: Scenario, seed: int, folder: Path | None) -> None:
        configs = flight_configs(scenario, seed)
        check_starts(scenario, configs)
        self.stations = [GroundStation() for _ in configs] if scenario.has_ground_station else []
        links: list[Sequence[Link]] = [(station.vehicle_end,) for station in self.stations] or [()] * len(configs)
        self.companion: Any = None
        self.fleet: FleetFlight | None = None
        if len(configs) > 1:
            world = flight_world(configs[0])
            self.fleet = FleetFlight(
                configs, world, links=links, folder=folder, has_transponders=scenario.has_transponders
            )
            self.flights: list[Any] = list(self.fleet.flights)
        else:
            self.flights = [self._alone(scenario, configs[0], links[0], folder)]
        for i, (flight, vehicle) in enumerate(zip(self.flights, scenario.fleet, strict=True)):
            if self.stations:
                flight.computers.append(self.stations[i])
            if scenario.wind.turbulence_m_s is not None:
                flight.set_air(scenario.wind.speed_m_s, scenario.wind.from_deg, scenario.wind.turbulence_m_s)
            set_charge(flight, vehicle.start.battery)

    def _alone(self, scenario: Scenario, config: FlightConfig, links: Sequence[Link], folder: Path | None) -> Any:
        policy = scenario.fleet[0].policy
        if policy is None:
            return Flight(config, links=links, folder=folder)
        from mission.scenario.flight.companions import flight_with_policy

        flight, self.companion = flight_with_policy(config, policy, links, folder)
        return flight

    def close(self) -> list[Any]:
        """Completes the logs; the history of each."""
        return self.fleet.close() if self.fleet is not None else [self.flights[0].close()]


def set_charge(flight: Any, remaining: float) -> None:
    """Gives the battery so much of its charge, if it has less than all of it."""
    body = flight.rig.rows["body"]
    if remaining < 1.0 and "battery_charge_c" in body.dtype.names:
        body["battery_charge_c"][0] = remaining * 3.6 * flight.airframe.battery.capacity_mah
