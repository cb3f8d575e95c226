"""The vehicle as of this frame, and how it answers.

`VehicleState` is what every telemetry stream, check and navigator mode reads, renewed once per frame. A `Reply` is the
answer to whatever is asked of the vehicle; the ground station is shown the reason of a refusal.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from math import nan
from typing import Any

from autopilot.inputs.obstacles import Obstacles
from autopilot.inputs.sticks import StickInput
from autopilot.interface.aircraft import Aircraft
from autopilot.interface.outputs import Output
from common.geodesy import GeoPoint, geodetic_from_ned


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
    boot_us: int = 0  # when the flight controller was last restarted; clients' clocks begin there
    estimate: Any = None  # Estimate
    samples: Any = None  # Samples
    actuators: Any = None  # Actuators
    health: Any = None  # EstimatorState, renewed at 5 Hz
    origin: GeoPoint = field(default_factory=lambda: GeoPoint(0.0, 0.0, 0.0))  # of the ned frame
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
    outputs: Sequence[Output] = ()  # what the motor commands are for
    motor_count: int = 4
    mav_type: int = 2  # MAV_TYPE
    is_armed: bool = False
    landed_state: LandedState = LandedState.ON_GROUND
    has_ground_contact: bool = False  # stands on something, though perhaps not landed yet
    is_ready_to_arm: bool = False
    is_failsafe: bool = False
    is_calibrating: bool = False
    awaits_launch: bool = False  # armed and to be thrown: its motor stands until it feels that
    armed_since_us: int = 0
    goal_ned: tuple[float, float, float] = (nan, nan, nan)  # [m] place flown to; NaN: free
    path_start_ned: tuple[float, float, float] = (nan, nan, nan)  # [m] of the straight way there; NaN: none
    takeoff_us: int = 0  # when it last left the ground; 0: not since it was armed
    flight_number: int = 0  # how often it has been armed since power-on
    battery_remaining: float = nan  # [0..1]
    battery_used_mah: float = 0.0
    battery_level: BatteryLevel = BatteryLevel.UNDEFINED
    load: float = 0.0  # [0..1] fraction of the frame time the Python part took; 0 in lockstep
    mission_count: int = 0
    mission_current: int = 0  # seq
    mission_state: int = 0  # MISSION_STATE
    aux_pulses_us: tuple[int, ...] = (0,) * 8  # of the outputs 9 to 16, 0: never set
    traffic_conflict_us: int = 0  # until then an aircraft counts as near
    nearest_aircraft: Aircraft | None = None
    read_motor_speeds: Callable[[], Sequence[float]] | None = None  # [rad/s] as the ESCs report them
    read_winch: Callable[[], WinchStatus] | None = None  # asked when it is sent
    obstacles: Obstacles | None = None
    relays: int = 0  # a bit for each that is on
    orbit: OrbitStatus | None = None  # while one is flown
    sticks: StickInput = field(default_factory=StickInput)
    fence: FenceState = field(default_factory=FenceState)
    ticks: "list[VehicleState]" = field(
        default_factory=list
    )  # the moments since the last frame, while somebody listens
    _placed: Any = None  # the estimate that `_position` belongs to
    _position: GeoPoint | None = None

    @property
    def position(self) -> GeoPoint:
        """Where it is: latitude, longitude, altitude above sea level; worked out when it is asked for."""
        estimate = self.estimate
        if self._position is None or estimate is not self._placed:
            north, east, down = (0.0, 0.0, 0.0) if estimate is None else estimate.pos_ned
            self._placed = estimate
            self._position = GeoPoint(*geodetic_from_ned(north, east, down, self.origin))
        return self._position

    @property
    def is_flying(self) -> bool:
        """Armed, and off the ground."""
        return self.is_armed and self.landed_state is not LandedState.ON_GROUND
