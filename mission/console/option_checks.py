"""What is wrong with the options of a flight gets one sentence, before anything heavy is imported to find it.

Warp, which the world and the vehicle are made of, takes longer to import than all else.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import get_args

from common.airframe import Airframe, AirframeError, load_airframe
from common.airframes.multirotor import MultirotorAirframe
from common.airframes.plane import PlaneAirframe
from common.airframes.rover import RoverAirframe
from common.geodesy import DEFAULT_HOME, GeoPoint
from mission.flight_settings import WORLD_FILES, WORLD_KINDS, FlightOptions, FlightSettings, Pace
from mission.plan.plan_file import PlanError, read_plan

HOME_MOST = (89.0, 180.0, 6000.0)  # latitude and longitude [deg], altitude [m]: highest airfields


class UserError(ValueError):
    """Something the user gave is wrong; the message is one sentence."""


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
    check_owner(options)
    if options.is_idle and speed is None and options.seconds is None:
        raise UserError("--idle --speed max: nobody can connect, so give --seconds to say when it ends")


def check_alone(options: FlightOptions) -> None:
    """Refuses what only several vehicles have, where there is one."""
    if options.vehicles is None:
        for flag, name in (("--adsb", "has_transponders"), ("--spacing", "spacing_m")):
            if getattr(options, name) != FlightOptions.model_fields[name].default:
                raise UserError(f"{flag}: is for several vehicles; add --vehicles")


def check_owner(options: FlightOptions) -> None:
    """Refuses an owner who does not move as owners do."""
    if options.owner not in (None, *get_args(Pace)):
        raise UserError(f"--owner {options.owner}: must be walk or run")
    if options.owner is not None and options.world_kind == "forest":
        raise UserError("--owner and --world forest: choose one, owners walk where more room is")


def is_world_file(options: FlightOptions) -> bool:
    """Whether the world is one of the user's own."""
    return options.world_kind.lower().endswith(WORLD_FILES)


def check_world(options: FlightOptions) -> None:
    """Refuses a world that is neither of a known kind nor a file, and what a file has itself."""
    kind = options.world_kind
    if not is_world_file(options):
        if kind not in WORLD_KINDS:
            raise UserError(f"--world {kind}: must be {', '.join(WORLD_KINDS)} or a file that ends with .yaml")
        return
    if not Path(kind).is_file():
        raise UserError(f"--world {kind}: no such file")
    if options.owner is not None:
        raise UserError("--owner and a world file: choose one, owners walk in worlds that are grown")
    for flag, name in (
        ("--trees", "trees_per_ha"),
        ("--hills", "hill_height_m"),
        ("--walls", "has_walls"),
        ("--world-seed", "world_seed"),
    ):
        if getattr(options, name) != type(options).model_fields[name].default:
            raise UserError(f"{flag}: is said in the world file, {kind}")


def check_options(options: FlightOptions) -> None:
    """Refuses what can be seen to be wrong before Warp is imported; parameters are left to `flight_options`.

    Raises:
        UserError: an option, the plan or the airframe is wrong.
    """
    check_end(options, speed_of(options.speed))
    check_alone(options)
    check_world(options)
    try:
        if options.plan is not None:
            read_plan(options.plan)
    except PlanError as error:
        raise UserError(str(error)) from error
    check_vehicle(options)


def check_vehicle(options: FlightOptions) -> None:
    """Refuses a home, a parameter or an airframe that cannot be read."""
    if options.home is not None:
        home_of(options.home)
    for text in options.parameters:
        parameter_of(text)
    try:
        airframe = load_airframe(options.airframe)
    except AirframeError as error:
        raise UserError(str(error)) from error
    check_engine(options, airframe)


def check_engine(options: FlightSettings, airframe: Airframe) -> None:
    """Refuses an engine that does not move the airframe, or is not installed."""
    aircraft = airframe.jsbsim_aircraft if isinstance(airframe, PlaneAirframe) else ""
    if options.engine == "native":
        if aircraft:
            raise UserError(f"--airframe {options.airframe}: it is JSBSim's {aircraft}; add --engine jsbsim")
        return
    is_moved = isinstance(airframe, MultirotorAirframe)
    is_moved |= isinstance(airframe, RoverAirframe) if options.engine == "pybullet" else bool(aircraft)
    if not is_moved:
        raise UserError(f"--engine {options.engine}: it does not move {options.airframe}")
    if find_spec(options.engine) is None:
        raise UserError(f"--engine {options.engine}: comes with the extra 'engines' (docs/start/installing.md)")


def parameter_of(text: str) -> tuple[str, float]:
    """Name and value of `NAME=VALUE`."""
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError as error:
        raise UserError(f"--param {text}: must be NAME=VALUE, with a number") from error


def home_of(text: str) -> GeoPoint:
    """The place that `--home` says."""
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
