"""What `honeyguide fly` is given, and the flight that this describes; what is wrong gets one sentence."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, get_args

from pydantic import ValidationError

from common.airframe import AirframeError, load_airframe
from common.geodesy import DEFAULT_HOME, GeoPoint
from common.params import ParameterError
from common.state_folder import StateFolder
from mission.flight_config import TREELESS_M, FlightConfig, OwnerConfig, Pace, flight_parameters
from mission.flight_state_folder import stored_home
from mission.plan.plan_file import PlanError, read_plan
from sim.world.world import WorldConfig

HOME_MOST = (89.0, 180.0, 6000.0)  # latitude and longitude [deg], altitude [m]: highest airfields


class UserError(ValueError):
    """Something the user gave is wrong; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class FlightOptions:
    """The options of `honeyguide fly`, as given."""

    plan: Path | None
    is_idle: bool
    once: bool
    speed: str
    seconds: float | None
    seed: int
    wind_m_s: float
    wind_from_deg: float
    noise: float
    airframe: str
    home: str | None  # None: the stored one, or else the default
    world_seed: int
    trees_per_ha: float
    hill_height_m: float
    has_walls: bool
    host: str
    bind: str
    tcp_port: int | None
    has_to_sign: bool
    gcs_port: int
    api_port: int
    run_folder: Path | None
    dialect: str = "px4"
    announces_components: bool = False
    stream_port: int = 0
    video_port: int | None = None  # None: the default one, when a client starts the stream; 0: no video
    has_view: bool = False
    view_port: int = 8080
    parameters: tuple[str, ...] = ()  # NAME=VALUE
    state: Path | None = None
    traffic_count: int = 0
    has_lidar: bool = False
    owner: str | None = None  # walk or run
    image_port: int = 14600


def speed_of(text: str) -> float | None:
    """Times real time; None: as fast as possible."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = -1.0
    if not 0.0 < speed <= 1000.0:
        raise UserError(f"--speed {text}: must be a number above 0, or 'max'")
    return speed


def check_end(options: FlightOptions, speed: float | None) -> None:
    """Refuses options that leave nothing to fly, or nothing to wait for."""
    if options.is_idle and options.plan is not None:
        raise UserError("--plan and --idle: choose one, to fly a plan or to wait for a ground station")
    if options.is_idle and options.once:
        raise UserError("--idle and --once: without a plan there is no mission to end with; use --seconds to end")
    if options.owner not in (None, *get_args(Pace)):
        raise UserError(f"--owner {options.owner}: must be walk or run")
    if options.is_idle and speed is None and options.seconds is None:
        raise UserError("--idle --speed max: nobody can connect, so give --seconds to say when it ends")


def check_options(options: FlightOptions) -> None:
    """Refuses what can be seen to be wrong before ports, servers or kernels are loaded.

    Raises:
        UserError: an option, the plan, the airframe or a parameter is wrong.
    """
    check_end(options, speed_of(options.speed))
    try:
        if options.plan is not None:
            read_plan(options.plan)
        config = flight_config(options, None)
        flight_parameters(config, load_airframe(config.airframe))
    except (AirframeError, ParameterError, PlanError) as error:
        raise UserError(str(error)) from error


def flight_config(options: FlightOptions, state: StateFolder | None) -> FlightConfig:
    """The flight that the options describe; home may be the one stored."""
    home = stored_home(state) if options.home is None else _home(options.home)
    try:
        return FlightConfig(
            airframe=options.airframe,
            home=home,
            seed=options.seed,
            wind_m_s=options.wind_m_s,
            wind_from_deg=options.wind_from_deg,
            noise=options.noise,
            dialect=options.dialect,
            announces_components=options.announces_components,
            traffic_count=options.traffic_count,
            has_lidar=options.has_lidar,
            parameters=dict(_parameter(text) for text in options.parameters),
            owner=None if options.owner is None else OwnerConfig(pace=cast(Pace, options.owner)),
            world=_world(options),
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def _world(options: FlightOptions) -> WorldConfig:
    """With an owner the world of training: its hills can be walked; otherwise no trees near home."""
    given: dict[str, Any] = {"seed": options.world_seed, "trees_per_ha": options.trees_per_ha}
    if options.owner is not None:
        from policies.tasks.follow_me.world import FOLLOW_WORLD

        return FOLLOW_WORLD.model_copy(update=given)
    return WorldConfig(
        **given, hill_height_m=options.hill_height_m, has_walls=options.has_walls, treeless_radius_m=TREELESS_M
    )


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError as error:
        raise UserError(f"--param {text}: must be NAME=VALUE, with a number") from error


def _home(text: str) -> GeoPoint:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) == 2:
        values.append(DEFAULT_HOME.alt_m)
    if len(values) != 3 or not all(abs(value) <= most for value, most in zip(values, HOME_MOST, strict=True)):
        latitude, longitude, altitude = HOME_MOST
        raise UserError(
            f"--home {text}: must be latitude,longitude or latitude,longitude,altitude, with the latitude within "
            f"±{latitude:g}, the longitude within ±{longitude:g} and the altitude within ±{altitude:g} m"
        )
    return GeoPoint(*values)
