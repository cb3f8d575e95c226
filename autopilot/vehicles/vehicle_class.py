"""A class of vehicles: its control law, and what the Python part of the flight controller must know of it.

Adding a class is adding a folder beside the others whose `vehicle.py` has one of these.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from autopilot.control.law import ControlLaw
from autopilot.interface.ardupilot_vehicle import ArduPilotVehicle
from autopilot.interface.client_requests import LandAt, TakeOff
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.outputs import Output
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import Mode, VehicleState
from common.airframe import Airframe
from common.params import Parameter, ParameterTable

ArmingCheck = Callable[[VehicleState, ParameterTable], str]
"""Says why the vehicle may not be armed; empty if it may."""


class GroundDetector(Protocol):
    """Says whether the vehicle stands on the ground."""

    lift_timeout_s: float
    """A take-off that has not left the ground by then has failed."""
    has_contact: bool
    """The ground carries it, perhaps not for long."""
    has_struck: bool
    """It has struck something while nothing held it in the air."""
    is_landed: bool

    @property
    def is_down(self) -> bool:
        """It lies still, its motors off, whatever the estimate says."""

    def reset(self) -> None:
        """The vehicle is on the ground and about to leave it."""

    def update(self, estimate: Any, thrust: float, descent_sp: float, dt_s: float) -> bool:
        """Takes one frame and returns whether the vehicle stands on the ground.

        Args:
            estimate: the Estimate record.
            thrust: [0..1] thrust setpoint.
            descent_sp: [m/s] downward speed asked for, 0 if it shall not end on the ground.
            dt_s: [s] since the last frame.
        """


class DriveWatch(Protocol):
    """Says whether a motor has failed, or moves nothing."""

    def reset(self) -> None:
        """The vehicle has just been armed."""

    def has_failure(self) -> bool: ...

    def is_stuck(self) -> bool:
        """Whether the vehicle drives and does not get on; asked each frame."""


@dataclass(frozen=True, slots=True)
class DriveParts:
    """What a drive watch may be made from."""

    state: VehicleState
    params: ParameterTable
    announcer: Announcer
    airframe: Any  # the class's
    read_speeds: Callable[[], Sequence[float]] | None  # [rad/s] of each motor, as its controller reports it
    airframe_row: np.ndarray[Any, Any] | None  # live structured view, shape (1,), of the law's Airframe row


@dataclass(frozen=True, slots=True, kw_only=True)
class VerticalLimits:
    """Names of the parameters that bound how it climbs and descends."""

    climb_speed: str  # [m/s] where nothing else is asked for
    descend_speed: str
    climb_max: str  # [m/s]
    descend_max: str
    accel_up: str  # [m/s²]
    accel_down: str
    alt_radius: str  # [m] height error at which a place counts as reached


@dataclass(frozen=True, slots=True, kw_only=True)
class Turning:
    """How a vehicle that cannot turn on the spot goes round a corner."""

    radius: Callable[[Callable[[str], float]], float]  # [m] of its smallest circle, from the numbers of parameters
    gain: str  # factor on the distance from a corner at which the turn begins
    largest: str  # [m] of that distance; negative: it is the acceptance radius always


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLimits:
    """Names of the parameters that bound how a class of vehicles moves, where all modes need to know it."""

    cruise_speed: str  # [m/s] where nothing else is asked for
    speed_max: str  # [m/s]
    accel_hor: str  # [m/s²]
    accel_across: str = ""  # [m/s²] in turns; empty: half of `accel_hor`
    jerk: str  # [m/s³]
    jerk_auto: str  # [m/s³] on missions
    vertical: VerticalLimits | None = None  # None: heights are the ground's
    turning: Turning | None = None  # None: it goes round any corner
    path_error: str  # [m] by which the vehicle may lag behind what it tracks
    yaw_rate: str  # [deg/s] of a turn that names none


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundHandling:
    """How a class of vehicles leaves the ground and comes back to it; speeds and heights are names of parameters."""

    detector: Callable[[ParameterTable, Any], GroundDetector]
    lift_thrust: Callable[[Any], float]  # [0..1] that carries the vehicle
    takeoff_speed: str  # [m/s]
    land_speed: str  # [m/s] low over the ground
    crawl_speed: str  # [m/s] just above the ground, where its height is measured
    slowing_height: str  # [m] above ground, from which a descent slows down
    slow_height: str  # [m] at which it has slowed down to `land_speed`
    crawl_height: str  # [m] from which it crawls
    settles: bool = True  # where it touches the ground it lets itself down; else its modes see to that


@dataclass(frozen=True, slots=True)
class Craft:
    """What the navigator knows of the vehicle itself."""

    lift_thrust: float  # [0..1] that carries it; 0 where the ground does
    standing_height_m: float  # of its centre over level ground
    limits: MotionLimits
    ground: GroundHandling | None  # None: it never leaves the ground
    yaw_mode_param: str  # empty if the class has none
    front_m: float  # of its front before its centre; 0 for what flies
    leg: Callable[..., Any] | None = None  # see `VehicleClass.leg`


@dataclass(frozen=True, slots=True)
class Lane:
    """The room that a vehicle takes on its way, from where its distances are measured."""

    front_m: float
    rear_m: float
    half_width_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleClass:
    """One class of vehicles; its functions get the airframe that `common/airframes/NAME.py` makes of a file."""

    name: str
    law: ControlLaw
    """The kernel half."""
    parameters: Sequence[Parameter]
    """Those of the law, and of the class's own modes and detectors."""
    defaults: Callable[[Any], Mapping[str, int | float]]
    """Parameters whose default the airframe file decides."""
    modes: ModeTable
    """Its flight modes; one of them is Hold, in which it boots."""
    last_resort: Mode
    """Where a mode leads that cannot be flown on: down for what flies, a stop for what drives."""
    limits: MotionLimits
    mav_type: Callable[[Any], int]
    """MAV_TYPE of the heartbeat."""
    ardupilot: ArduPilotVehicle
    outputs: Callable[[Any], Sequence[Output]]
    """What the elements of `Actuators.command` are, in their order."""
    motors: Callable[[Any], Sequence[int]]
    """Its motors among the outputs, clockwise from the nose on, as ArduPilot counts them to test one."""
    standing_height_m: Callable[[Any], float]
    """Of the vehicle's centre over level ground."""
    ground: GroundHandling | None = None
    """None: it never leaves the ground, and has no modes that take off or land."""
    yaw_mode_param: str = ""
    """Parameter that says where the nose points on mission legs, as autopilot.navigator.heading.YawMode; empty: towards
    the waypoint."""
    arming_checks: Sequence[ArmingCheck] = ()
    """Its own, besides those of all vehicles (autopilot.commander.arming)."""
    lane: Callable[[Any], Lane] | None = None
    """Of what stops before obstacles in its lane, in every mode (CP_DIST); None: modes see to that themselves."""
    leg: Callable[..., Any] | None = None
    """Makes what flies a mission's items, of what cannot stop; None: autopilot.navigator.mission.mission_legs.Leg."""
    drive_watch: Callable[[DriveParts], DriveWatch] | None = None
    """None: nobody looks whether a motor has failed or the vehicle is stuck."""

    def __post_init__(self) -> None:
        if self.ground is None:
            for mode, spec in self.modes.items():
                if not {TakeOff, LandAt}.isdisjoint(spec.takes):
                    raise ValueError(f"{self.name}: mode {mode.name} takes off or lands, and the class has no `ground`")

    def craft(self, airframe: Airframe) -> Craft:
        """A vehicle of the class, as the navigator knows it."""
        lift_thrust = 0.0 if self.ground is None else self.ground.lift_thrust(airframe)
        return Craft(
            lift_thrust,
            self.standing_height_m(airframe),
            self.limits,
            self.ground,
            self.yaw_mode_param,
            0.0 if self.lane is None else self.lane(airframe).front_m,
            self.leg,
        )
