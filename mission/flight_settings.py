"""The options of `honeyguide fly` and `follow`, each declared once: name, flag, help, bounds and default.

The commands are made from these models (`console/model_command.py`), and `FlightConfig` has the fields of
`FlightSettings` as its own. Light to import: the command line does so before anything else.
"""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

from autopilot.mavlink.transport.links import GROUND_STATION_PORT, OFFBOARD_PORT
from common.geodesy import DEFAULT_HOME
from mission.console.help_texts import GUARD_SETTING
from mission.console.model_command import option

Pace = Literal["walk", "run"]
EngineName = Literal["native", "pybullet", "jsbsim"]
BoardName = Literal["own", "ardupilot", "px4", "betaflight"]
WORLD_KINDS = ("hills", "forest", "walled-forest", "course", "car-park")
WORLD_FILES = (".yaml", ".yml")
OURS: tuple[BoardName, ...] = ("own", "betaflight")
"""Under these it is our own flight controller that flies, with its options, parameters and links."""
_HOME = f"{DEFAULT_HOME.lat_deg},{DEFAULT_HOME.lon_deg},{DEFAULT_HOME.alt_m:g}"


class FlightSettings(BaseModel):
    """What a flight takes as it is given: options of the command line, and fields of its configuration."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    seed: int = option(0, "Seed of sensor noise and turbulence.", ge=0, le=2**31 - 1)
    wind_m_s: float = option(0.0, "Wind speed [m/s], with turbulence and gusts.", "--wind", ge=0.0, le=20.0)
    """The mean; more would blow a parked vehicle over."""
    wind_from_deg: float = option(270.0, "Where the wind comes from [deg].", "--wind-from", ge=0.0, le=360.0)
    """Clockwise from north."""
    noise: float = option(1.0, "Scale of all sensor noise.", ge=0.0, le=10.0)
    """Of the onboard camera's, too; 0 makes them perfect."""
    sensor_roughness: float = option(
        0.0, "Vibration and magnetic noise: 1 as in the roughest of five real logs.", ge=0.0, le=1.0
    )
    """0 is a well isolated controller's."""
    airframe: str = option("x500", "Airframe name or TOML file.")
    dialect: Literal["px4", "ardupilot"] = option("px4", "What ground stations take it for: px4 or ardupilot.")
    """Which autopilot's numbers they get. The flight's own script always gets PX4's."""
    announces_components: bool = option(
        False, "ArduPilot's dialect: heartbeats of camera, gimbal and winch, too.", "--announce-components"
    )
    """In PX4's they always send them."""
    traffic_count: int = option(0, "Other aircraft that are heard by ADS-B.", "--traffic", ge=0, le=50)
    engine: EngineName = option("native", "Who moves the body: native, pybullet or jsbsim.")
    """Air, sensors and flight controller are ours with each."""
    throw_m_s: float | None = option(
        None,
        "A plane: thrown at this speed [m/s]. Default: from the runway, or as its file has it.",
        "--throw",
        shown="as its file has it",
        ge=1.0,
        le=60.0,
    )
    has_lidar: bool = option(False, "Carry a ring of range finders that looks round.", "--lidar")
    has_base: bool = option(False, "A base station beside home sends the GNSS receiver corrections.", "--rtk")


class FlightOptions(FlightSettings):
    """The options of `honeyguide fly`, as given: the settings, what several of which make, and the session's own."""

    board: BoardName = option(
        "own", "Who flies: own, or another program: ardupilot, px4 or betaflight (docs/boards.md)."
    )
    command: tuple[str, ...] = option(
        (),
        "Starts that program: {folder}, {params}, {home}, {instance} and {vehicle} are filled in. Of several "
        "vehicles with several programs: BOARD=COMMAND, repeated.",
        shown="wait for it",
    )
    instance: int = option(0, "Its number, from which its ports follow.", ge=0, le=99)
    plan: Path | None = option(None, "A QGroundControl .plan or QGC WPL 110 file. Default: a tour of the hills.")
    is_idle: bool = option(False, "Fly no plan: wait for a ground station.", "--idle")
    once: bool = option(False, "End with the mission; exit code 0 only if it succeeded.")
    speed: str = option("1", "Times real time, or 'max': lockstep, without network links.")
    seconds: float | None = option(None, "End after this much simulated time.", ge=0.1)
    home: str | None = option(None, "Latitude,longitude[,altitude AMSL].", shown=f"{_HOME}, or as stored")
    world_seed: int = option(1, "Seed of hills and trees.", ge=0)
    trees_per_ha: float | None = option(
        None, "Trees per hectare.", "--trees", shown="60; in the forest 400", ge=0.0, le=1000.0
    )
    hill_height_m: float | None = option(
        None, "Height of the hills [m].", "--hills", shown="12; in the forest 4", ge=0.0, le=300.0
    )
    has_walls: bool = option(False, "Walls along the edges of the map.", "--walls")
    world_kind: str = option(
        "hills",
        "hills, forest, walled-forest (for a rover), course (walls, trees, movers), car-park, or a world file (.yaml).",
        "--world",
    )
    """The last two kinds are to be driven in: of the options about the world they take its seed alone; a file none."""
    host: str = option("127.0.0.1", "Address ground stations are sent to.")
    bind: str = option("", "Address the vehicle's ports are open at. Default: loopback.")
    tcp_port: int | None = option(None, "TCP port for clients that connect; ArduPilot's is 5760.", ge=1, le=65535)
    has_to_sign: bool = option(False, "Refuse unsigned messages on this machine's links too.", "--require-signing")
    gcs_port: int = option(GROUND_STATION_PORT, "UDP port of ground stations.", ge=1, le=65535)
    api_port: int = option(OFFBOARD_PORT, "UDP port of the offboard API.", ge=1, le=65535)
    stream_port: int = option(0, "HTTP port of the camera's live picture; 0: none.", ge=0, le=65535)
    video_port: int | None = option(
        None,
        "UDP port of --host that the camera's video is sent to (H.264, RTP); 0: none.",
        shown="5600, when a client starts the video",
        ge=0,
        le=65534,
    )
    has_view: bool = option(False, "Show the flight on a live page in the browser.", "--view")
    view_port: int = option(8080, "HTTP port of the live page.", ge=1, le=65535)
    has_mcap: bool = option(False, "Also write flight.mcap, which Foxglove opens.", "--mcap")
    has_foxglove: bool = option(False, "Show the flight in Foxglove while it is flown.", "--foxglove")
    foxglove_port: int = option(8765, "Port that Foxglove connects to.", ge=1, le=65535)
    owner: str | None = option(None, "Somebody with a phone walks through the world: walk or run; see companion.")
    image_port: int = option(14600, "TCP port of the pictures for a companion, with an owner.", ge=1, le=65535)
    parameters: tuple[str, ...] = option(
        (), "Sets a parameter of the flight controller: NAME=VALUE. Repeatable.", "--param"
    )
    vehicles: str | None = option(
        None, "Fly several in one world: a number, or AIRFRAME[@BOARD]:NUMBER,AIRFRAME[@BOARD]:NUMBER,...", shown="one"
    )
    spacing_m: float = option(10.0, "Of several, how far apart they boot [m].", "--spacing", ge=1.0, le=1000.0)
    has_transponders: bool = option(False, "Several hear each other by ADS-B.", "--adsb")
    run_folder: Path | None = option(None, "Where logs go. Default: runs/DATE.")
    state: Path | None = option(None, "Folder for what outlives the run: parameters, mission, fence, files, logs.")


class FollowOptions(FlightOptions):
    """The options of `honeyguide follow`, as given: those of `fly` that `FOLLOWED_WITH` names, some told otherwise."""

    is_idle: bool = True
    has_walls: bool = True
    policy: str | None = option(
        None,
        "A policy of FollowMe, or 'scripted'; for a rover of NavigateRover.",
        shown="the shipped one",
    )
    owner: str = option("walk", "How the owner moves: walk (to 2 m/s) or run (to 5 m/s).")
    seconds: float = option(60.0, "How long to follow; then it lands.", ge=1.0)
    seed: int = option(0, "Seed of the owner's path, noise, turbulence.", ge=0, le=2**31 - 1)
    trees_per_ha: float = option(100.0, "Trees per hectare.", "--trees", ge=0.0, le=1000.0)
    hill_height_m: float = option(8.0, "Height of the hills [m]; trained on 8.", "--hills", ge=0.0, le=300.0)
    airframe: str = option("x500", "Airframe name or TOML file; policies were trained on x500 and rover.")
    has_guard: bool = option(True, "A guard that does not believe the policy bounds it.", "--guard/--no-guard")
    guard_settings: tuple[str, ...] = option((), GUARD_SETTING, "--guard-setting")
    is_recorded: bool = option(
        False, "Keep each decision, with its picture, for a dataset (honeyguide dataset build).", "--record"
    )
    has_film: bool = option(True, "Film it afterwards: chase and onboard view.", "--mp4/--no-mp4")


FOLLOWED_WITH = (
    "policy", "owner", "seconds", "speed", "seed", "wind_m_s", "wind_from_deg", "noise",
    "sensor_roughness", "world_seed", "trees_per_ha", "hill_height_m", "airframe", "dialect", "engine", "board",
    "command", "instance", "parameters", "has_guard", "guard_settings", "is_recorded", "has_view", "view_port",
    "has_film", "has_mcap", "has_foxglove", "foxglove_port", "gcs_port", "api_port", "host", "run_folder",
)  # fmt: skip


class ParkOptions(FlightOptions):
    """The options of `honeyguide park`, as given: those of `fly` that `PARKED_WITH` names, some told otherwise."""

    policy: str = option("drive-park", "A policy of Drive: a file, a run's folder, or one that ships.")
    spot: int | None = option(None, "The spot to park in, from 1.", shown="a free one, drawn by --seed", ge=1)
    is_reverse: bool = option(False, "Nose to the aisle: it reverses into the spot.", "--reverse")
    is_idle: bool = option(False, "Park nowhere by itself: wait for clicks on the page, and for gotos.", "--idle")
    airframe: str = option("rover", "Airframe name or TOML file; the policies were trained on rover.")
    has_guard: bool = option(True, "A guard that does not believe the policy bounds it.", "--guard/--no-guard")
    guard_settings: tuple[str, ...] = option((), GUARD_SETTING, "--guard-setting")
    is_recorded: bool = option(False, "Keep each decision for a dataset (honeyguide dataset build).", "--record")
    world_kind: str = "car-park"
    has_lidar: bool = True
    has_base: bool = True


PARKED_WITH = (
    "policy", "spot", "is_reverse", "is_idle", "speed", "seconds", "seed", "wind_m_s", "wind_from_deg", "noise",
    "sensor_roughness", "world_seed", "airframe", "parameters", "has_guard", "guard_settings", "is_recorded",
    "has_view", "view_port", "has_mcap", "has_foxglove", "foxglove_port", "gcs_port", "api_port", "host", "run_folder",
)  # fmt: skip
