"""What a flight is made from, as values that can be checked before anything of it is built.

Light to import: a wrong option is told before kernels, servers or pictures are loaded.
"""

from pydantic import BaseModel, ConfigDict, Field

from autopilot.ardupilot_only_params import ARDUPILOT_PARAMETERS
from autopilot.params import parameter_table
from common.airframe import Airframe, AirframeError
from common.airframes.plane import PlaneAirframe, Throw
from common.clock import SIMULATED_EPOCH_US
from common.geodesy import DEFAULT_HOME, GeoPoint, geodetic_from_ned
from common.params import ParameterTable
from mission.flight_settings import FlightSettings, Pace
from mission.simulator.simulator_params import simulator_parameters
from sim.bodies.vehicles import class_of
from sim.world.custom.world_file import WorldFile
from sim.world.world_config import WorldConfig

# For what needs a runway: level where it takes off and lands, and no trees where it flies.
AIRFIELD = WorldConfig(clearing_radius_m=150.0, treeless_radius_m=500.0)
CATAPULT = Throw.model_construct(
    speed_m_s=0.0, elevation_rad=0.26, stroke_s=0.5, height_m=1.5
)  # guess; of a file without
TREELESS_M = 80.0  # round home, of the command line's worlds: clients' examples fly to 60 m from it, lower than trees


class OwnerConfig(BaseModel):
    """Who is followed."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pace: Pace = "walk"
    """`walk`: up to 2 m/s; `run`: up to 5 m/s."""
    start_m: float = Field(default=3.0, ge=1.0, le=50.0)
    """How far north of home they wait."""
    numbers: dict[str, float] = Field(default_factory=dict)
    """Of FollowMe, by name, that hold for a flight too: how the owner and others walk and look, the phone, the camera,
    what happens to pictures on their way, and to setpoints of a companion on board. The others are at the task's
    defaults."""


class FlightConfig(FlightSettings):
    """What a flight is made from: the settings, and what several options together make."""

    home: GeoPoint = DEFAULT_HOME
    """The origin of the local frame."""
    start_ne_m: tuple[float, float] = (0.0, 0.0)
    """Where the vehicle boots, north and east of it [m]."""
    start_heading_deg: float = Field(default=0.0, ge=0.0, le=360.0)
    """Where its nose points then, from north, clockwise."""
    parameters: dict[str, float] = Field(default_factory=dict)
    """Values of the flight controller's parameters that differ from their defaults, by name."""
    world: WorldConfig | WorldFile = WorldConfig()
    """The ground, or a world of one's own; with an owner: grown as in training, from its seed."""
    boot_unix_us: int = Field(default=SIMULATED_EPOCH_US, ge=0)
    """The date of power-on, as Unix time, in lockstep; a flight that is paced by the wall clock takes the wall's."""
    is_forest: bool = False
    """The vehicle carries the scanner that policies of Navigate see by; the world is grown as in their training."""
    scan_lag_s: float = Field(default=0.0, ge=0.0, le=1.0)
    """From what this scanner, or the ring of range finders, measures to its messages, besides the frame they take."""
    owner: OwnerConfig | None = None
    """Who walks through the world with a phone, to be followed; the vehicle then carries a camera for its companion."""


def start_of(config: FlightConfig) -> GeoPoint:
    """Where a vehicle boots; the altitude is home's."""
    lat_deg, lon_deg, _ = geodetic_from_ned(*config.start_ne_m, 0.0, config.home)
    return GeoPoint(lat_deg, lon_deg, config.home.alt_m)


def as_launched(config: FlightConfig, airframe: Airframe) -> Airframe:
    """The airframe, thrown as the configuration says.

    Raises:
        AirframeError: it is no plane.
    """
    if config.throw_m_s is None:
        return airframe
    if not isinstance(airframe, PlaneAirframe):
        raise AirframeError(f"airframe '{airframe.name}': only a plane can be thrown")
    throw = airframe.throw or CATAPULT
    return airframe.model_copy(update={"throw": throw.model_copy(update={"speed_m_s": config.throw_m_s})})


def flight_parameters(config: FlightConfig, airframe: Airframe) -> ParameterTable:
    """The flight controller's parameters: the defaults of the airframe, and what the configuration says.

    Raises:
        ParameterError: an unknown name, or a value out of bounds.
        AirframeError: an airframe of no known class of vehicles.
    """
    airframe = as_launched(config, airframe)
    own = []
    if config.dialect == "ardupilot":
        simulated = simulator_parameters(airframe, config.home, config.wind_m_s, config.wind_from_deg)
        own = [*ARDUPILOT_PARAMETERS, *simulated]
    table = parameter_table(airframe, own, class_of(airframe).vehicle)
    for name, value in config.parameters.items():
        table.set_exactly(name, value)
    return table
