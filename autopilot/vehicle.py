"""What the MAVLink part and the commander say to each other.

`VehicleState` is the vehicle as every telemetry stream, check and navigator mode reads it, renewed once per frame.
`Vehicle` is what a command handler may ask for; each answer is a `Reply` whose reason the ground station is shown.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, IntEnum, IntFlag
from math import nan
from typing import TYPE_CHECKING, Any, Protocol

from autopilot.host import Host
from autopilot.sticks import StickInput, Sticks
from common.geodesy import GeoPoint
from common.params import ParameterTable

if TYPE_CHECKING:  # they answer with the Reply below
    from autopilot.camera.camera import Camera
    from autopilot.gimbal.control import GimbalControl


class Mode(IntEnum):
    """Flight modes; a dialect maps them to its numbers."""

    HOLD = 0
    TAKEOFF = 1
    MISSION = 2
    RETURN = 3
    LAND = 4
    OFFBOARD = 5
    MANUAL = 6
    STABILIZED = 7
    ACRO = 8
    ALTITUDE = 9
    POSITION = 10
    PRECISION_LAND = 11
    FOLLOW = 12
    ORBIT = 13
    BRAKE = 14
    SMART_RETURN = 15  # back along the way it came
    GUIDED = 16  # external commands and setpoints by ArduPilot's rules: no stream needed to enter
    TERMINATION = 17


class Verdict(IntEnum):
    """Answer to a request, numbered as MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


class LandedState(IntEnum):
    """Numbered as MAV_LANDED_STATE."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class BatteryLevel(IntEnum):
    """Numbered as MAV_BATTERY_CHARGE_STATE."""

    UNDEFINED = 0
    OK = 1
    LOW = 2
    CRITICAL = 3
    EMERGENCY = 4


class Severity(IntEnum):
    """Numbered as MAV_SEVERITY."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


@dataclass(frozen=True, slots=True)
class Reply:
    """A verdict, with the reason whenever it is a refusal."""

    verdict: Verdict
    reason: str = ""


ACCEPTED = Reply(Verdict.ACCEPTED)


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One mission item as the protocol carries it; x and y are degrees (or metres in a local frame)."""

    seq: int
    frame: int  # MAV_FRAME
    command: int  # MAV_CMD
    params: tuple[float, float, float, float]
    x: float  # [deg] latitude
    y: float  # [deg] longitude
    z: float  # [m] in the item's frame
    autocontinue: bool = True


@dataclass(frozen=True, slots=True)
class ItemRefusal:
    """Why a mission was not taken: the item and the MAV_MISSION_RESULT to answer with."""

    seq: int
    result: int
    reason: str


class ListKind(IntEnum):
    """The lists of items that clients upload, numbered as MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class ItemList(Protocol):
    """One such list: checked and kept as a whole."""

    @property
    def items(self) -> Sequence[MissionItem]: ...

    @property
    def capacity(self) -> int:
        """How many items it may have."""
        ...

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Replaces the list as a whole, or refuses it as a whole and keeps the old one."""
        ...


class FenceSwitch(Protocol):
    """What may be asked of the fence besides loading it; `limits` are bits of FenceLimit."""

    def enable(self, limits: int) -> Reply: ...

    def disable(self, limits: int) -> Reply: ...


class StoredLists(Protocol):
    """All of them, for those who upload, read back or keep them (autopilot.lists)."""

    def items(self, kind: ListKind) -> Sequence[MissionItem]: ...

    def capacity(self, kind: ListKind) -> int: ...

    def load(self, kind: ListKind, items: Sequence[MissionItem]) -> ItemRefusal | None: ...

    def on_change(self, listener: Callable[[ListKind], None]) -> None: ...


@dataclass(frozen=True, slots=True)
class OffboardSetpoint:
    """An external setpoint in our frames; NaN frees an element. `kind` is a SETPOINT_* of autopilot.ports."""

    time_us: int
    kind: int
    pos_ned: tuple[float, float, float] = (nan, nan, nan)
    vel_ned: tuple[float, float, float] = (nan, nan, nan)
    accel_ned: tuple[float, float, float] = (nan, nan, nan)
    yaw: float = nan
    yaw_rate: float = nan
    q_ned_from_frd: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)  # x, y, z, w
    omega_frd: tuple[float, float, float] = (nan, nan, nan)
    thrust: float = nan


@dataclass(frozen=True, slots=True)
class TargetReport:
    """Where a target to follow says it is, when it said so."""

    pos_ned: tuple[float, float, float]  # [m]
    vel_ned: tuple[float, float, float] | None  # [m/s], None if not reported
    pos_std: float  # [m] per axis
    vel_std: float  # [m/s] per axis
    course_rad: float = nan  # where its nose points, NaN if not reported


@dataclass(frozen=True, slots=True)
class OrbitRequest:
    """A circle a client asks for; NaN is the default."""

    radius_m: float = nan  # positive is clockwise
    speed_m_s: float = nan  # negative turns the other way
    yaw: int = 5  # ORBIT_YAW_BEHAVIOUR
    turns_rad: float = 0.0  # 0: for ever
    lat_deg: float = nan
    lon_deg: float = nan
    alt_amsl_m: float = nan


@dataclass(frozen=True, slots=True)
class WinchStatus:
    """What a winch tells."""

    length_m: float  # of line let out
    rate_m_s: float  # positive lets line out
    tension_kg: float
    voltage_v: float
    current_a: float
    flags: int  # MAV_WINCH_STATUS_FLAG


@dataclass(frozen=True, slots=True)
class OrbitStatus:
    """The circle being flown."""

    radius_m: float  # positive is clockwise
    yaw: int  # ORBIT_YAW_BEHAVIOUR
    centre: GeoPoint


class FenceLimit(IntFlag):
    """The kinds of limits a fence may have, numbered as ArduPilot's fence types."""

    CEILING = 1
    RADIUS = 2  # around home
    SHAPES = 4  # polygons and circles that clients upload
    FLOOR = 8


@dataclass(slots=True)
class FenceState:
    """What the fence's watch has found; limits are bits of FenceLimit."""

    is_active: bool = False  # there are limits, and a breach has consequences
    breached: int = 0
    last_breach: int = 0
    breach_count: int = 0  # since power-on
    breach_time_us: int = 0


@dataclass(slots=True)
class VehicleState:
    """The vehicle as of this frame.

    The four records are rows of the kernel structs of the same name (autopilot.ports, autopilot.estimator.state) as
    named tuples: `state.estimate.pos_ned[2]`.
    """

    time_us: int = 0
    estimate: Any = None  # Estimate
    samples: Any = None  # Samples
    actuators: Any = None  # Actuators
    health: Any = None  # EstimatorState, renewed at 5 Hz
    origin: GeoPoint = field(default_factory=lambda: GeoPoint(0.0, 0.0, 0.0))  # of the ned frame
    position: GeoPoint = field(default_factory=lambda: GeoPoint(0.0, 0.0, 0.0))  # lat_deg, lon_deg, alt_m AMSL
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    home: GeoPoint | None = None
    home_ned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    home_yaw_rad: float = 0.0
    stand_ned: tuple[float, float, float] | None = (
        None  # where it last stood; home may be set anywhere, also in the air
    )
    mode: Mode = Mode.HOLD
    rotor_count: int = 4
    is_armed: bool = False
    landed_state: LandedState = LandedState.ON_GROUND
    has_ground_contact: bool = False  # stands on something, though perhaps not landed yet
    is_ready_to_arm: bool = False
    is_failsafe: bool = False
    is_calibrating: bool = False
    armed_since_us: int = 0
    goal_ned: tuple[float, float, float] = (nan, nan, nan)  # [m] place flown to; NaN: free
    path_start_ned: tuple[float, float, float] = (nan, nan, nan)  # [m] of the straight way there; NaN: none
    takeoff_us: int = 0  # when it last left the ground; 0: not since it was armed
    flight_number: int = 0  # how often it has been armed since power-on
    battery_remaining: float = nan  # [0..1]
    battery_used_mah: float = 0.0
    battery_level: BatteryLevel = BatteryLevel.UNDEFINED
    load: float = 0.0  # [0..1] share of the frame time the Python part took; 0 in lockstep
    mission_count: int = 0
    mission_current: int = 0  # seq
    mission_state: int = 0  # MISSION_STATE
    aux_pulses_us: tuple[int, ...] = (0,) * 8  # of the outputs 9 to 16, 0: never set
    traffic_conflict_us: int = 0  # until then an aircraft counts as near
    nearest_aircraft: Any = None  # autopilot.traffic.Aircraft
    read_truth: Callable[[], Any] | None = None  # the simulator's body state, for telemetry alone
    read_winch: Callable[[], WinchStatus] | None = None  # asked when it is sent
    obstacles: Any = None  # autopilot.obstacles.Obstacles
    relays: int = 0  # a bit for each that is on
    orbit: OrbitStatus | None = None  # while one is flown
    gimbal: "GimbalControl | None" = None  # None: the vehicle carries none
    sticks: StickInput = field(default_factory=StickInput)
    fence: FenceState = field(default_factory=FenceState)


class Announcer(Protocol):
    """Where the vehicle's parts report events; the MAVLink server sends them to every link."""

    def statustext(self, severity: Severity, text: str) -> None: ...

    def mission_item_reached(self, seq: int) -> None: ...

    def mission_current_changed(self, seq: int) -> None: ...

    def home_changed(self) -> None: ...

    def heartbeat_now(self) -> None:
        """Mode or arming changed: send a heartbeat in this frame."""
        ...


class CalibrationKind(Enum):
    """What is calibrated; the value is the first word of its name in texts."""

    GYRO = "gyro"
    MAG = "mag"
    ACCEL = "accel"
    ACCEL_SIMPLE = "accel simple"  # the vehicle stays level
    LEVEL = "level"


class Calibration(Protocol):
    """The calibration of the sensors of a disarmed vehicle."""

    def start(self, kind: CalibrationKind) -> Reply: ...

    def cancel(self) -> Reply: ...

    def set_offsets(self, sensor: str, offsets: tuple[float, float, float]) -> None:
        """Writes the offsets of a sensor: GYRO, ACC or MAG."""
        ...


class Station(Protocol):
    """Whether a ground station is there."""

    def heard(self, time_us: int) -> None:
        """A heartbeat of a ground station has come in."""
        ...


class Guidance(Protocol):
    """What may be asked of the flight besides a mode, a place or a mission (autopilot.guidance)."""

    def look_at(self, command: int, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        """Nose and gimbal towards a place from now on; `command` is handed to the payload."""
        ...

    def look_ahead(self, command: int, offset_deg: float) -> Reply:
        """Nose and gimbal as the mode has them, on mission legs turned by an offset."""
        ...

    def turn(self, angle_deg: float, rate_deg_s: float, direction: float, *, is_relative: bool) -> Reply: ...

    def pause(self) -> Reply:
        """Stops a mission or a client's setpoints, and holds."""
        ...

    def resume(self) -> Reply:
        """Goes on with what was paused; with the mission if nothing was."""
        ...

    def fly_landing_sequence(self) -> Reply: ...

    def fly_return_path(self) -> Reply: ...

    def abort_landing(self, height_m: float) -> Reply:
        """Climbs away from a landing, to a height above home at least, and holds."""
        ...


class GuidedPort(Protocol):
    """What may be asked of mode GUIDED; the caller changes to it."""

    def takeoff(self, alt_amsl_m: float, yaw_rad: float) -> Reply: ...

    def goto(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, yaw_rad: float, speed_m_s: float) -> Reply: ...

    def forget_goto(self) -> None:
        """The mode could not be entered."""
        ...


class PayloadPort(Protocol):
    """What the vehicle carries (autopilot.payload)."""

    def takes(self, command: int) -> bool: ...

    def run(self, command: int, params: tuple[float, float, float, float], x: float, y: float, z: float) -> Reply: ...


class ObstaclePort(Protocol):
    """What is round the vehicle (autopilot.obstacles)."""

    def reported(self, time_us: int, distances_m: Sequence[float], first_rad: float, increment_rad: float) -> None: ...


class ExternalPort(Protocol):
    """Positions from outside (autopilot.external)."""

    def report(self, report: Any) -> str: ...


class TrafficPort(Protocol):
    """Other aircraft (autopilot.traffic)."""

    def report(self, aircraft: Any) -> None: ...

    def known(self) -> Sequence[Any]: ...


class Vehicle(Protocol):
    """What may be asked of the vehicle. Altitudes are AMSL [m], angles radians, NaN means default."""

    state: VehicleState
    params: ParameterTable
    host: Host
    camera: "Camera | None"

    @property
    def lists(self) -> StoredLists:
        """Mission, fence and rally points."""
        ...

    @property
    def station(self) -> Station: ...

    @property
    def calibration(self) -> Calibration: ...

    sticks: Sticks

    @property
    def fence(self) -> FenceSwitch: ...

    @property
    def guidance(self) -> Guidance: ...
    @property
    def payload(self) -> PayloadPort: ...

    @property
    def traffic(self) -> TrafficPort: ...

    @property
    def obstacles(self) -> ObstaclePort: ...

    @property
    def external(self) -> ExternalPort: ...

    @property
    def guided(self) -> GuidedPort: ...

    def has_mode(self, mode: Mode) -> bool:
        """Whether there is such a mode at all."""
        ...

    def arm(self, *, force: bool) -> Reply: ...

    def disarm(self, *, force: bool) -> Reply: ...

    def terminate(self) -> Reply:
        """Stops the motors for good, wherever the vehicle is."""
        ...

    def inject_failure(self, unit: int, failure: int, instance: int) -> Reply:
        """Breaks or repairs a part; numbers as FAILURE_UNIT and FAILURE_TYPE, instances from 1, 0: all."""
        ...

    def check_arming(self) -> list[str]:
        """Reasons why the vehicle may not be armed now; empty when ready."""
        ...

    def set_mode(self, mode: Mode) -> Reply: ...

    def takeoff(self, alt_amsl_m: float, yaw_rad: float) -> Reply: ...

    def land(self, lat_deg: float, lon_deg: float, yaw_rad: float) -> Reply: ...

    def reposition(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, yaw_rad: float, speed_m_s: float) -> Reply:
        """Goes there and holds (mode HOLD); all NaN: hold here (pause)."""
        ...

    def change_speed(self, speed_m_s: float, kind: int) -> Reply:
        """A speed from now on; `kind` as SPEED_TYPE: 2 climb, 3 descent, else over ground; NaN: the default."""
        ...

    def set_home(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        """All NaN: home is here."""
        ...

    def set_offboard(self, setpoint: OffboardSetpoint) -> None: ...

    def give_corrections(self, rtcm: bytes) -> None:
        """Passes corrections on to the GNSS receiver."""
        ...

    def orbit(self, request: OrbitRequest) -> Reply:
        """Flies round a point (mode ORBIT)."""
        ...

    def report_target(self, report: TargetReport) -> None:
        """What mode FOLLOW follows."""
        ...

    def report_landing_target(self, pos_ned: tuple[float, float, float]) -> None:
        """Where mode PRECISION_LAND lands [m]."""
        ...

    def start_mission(self, first: int, last: int) -> Reply:
        """Mode MISSION from item `first` (-1: where it stands) to item `last` (-1: to its end)."""
        ...

    def set_current_item(self, seq: int, *, is_reset: bool = False) -> Reply:
        """Reset: every jump counts from the beginning again."""
        ...

    def reboot(self) -> Reply: ...
