"""What a flight mode is: the object that flies it, and the row that says all the rest about it.

A class of vehicles lists its rows in one table; whoever needs to know something of a mode (commander, navigator,
dialects, telemetry, logs) reads it there. Adding a mode is writing its class and its row.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Any

from autopilot.interface.client_requests import ModeRequest, Report
from autopilot.interface.failsafe_action import Action
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Verdict

# COM_DLL_EXCEPT and COM_RCL_EXCEPT: the bit that lets a mode go on without a ground station, or without sticks (PX4).
MISSION_EXCEPTED, HOLD_EXCEPTED, OFFBOARD_EXCEPTED = 1, 2, 4
# COM_RC_OVERRIDE: the bit that lets a pilot leave a mode by moving the sticks (PX4).
AUTO_OVERRIDE, OFFBOARD_OVERRIDE = 1, 2


class FlightMode:
    """How a mode is flown, once per frame; what a mode does not define is as here."""

    __slots__ = ()

    finishes_takeoff = False
    """A take-off that is still low is finished first."""
    is_below_floor = False
    """May be flown below the fence's floor."""
    takes_heading = False
    """A region of interest and a turn that was asked for are put into its setpoint."""
    begins_anew = True
    """What is asked of it while it is flown ends what it has been doing."""

    def start(self) -> None:
        """Entered while armed, or armed in it."""

    def frame(self) -> None:
        """Renews the setpoint; called while armed."""

    def leave(self, following: Mode) -> None:
        """A mode is entered after this one, perhaps the same again."""

    def take(self, _request: Any, /) -> Reply:
        """Keeps a request that its row takes, or says why not; the vehicle enters the mode then."""
        return ACCEPTED

    def may_go(self, *, is_taking_off: bool) -> bool:
        """Whether a vehicle that is not in the air yet may be sent somewhere by it."""
        return is_taking_off

    @property
    def is_underway(self) -> bool:
        """Whether the vehicle has been sent to a position, and is still on its way there."""
        return False

    def stream_age_us(self) -> int:
        """For how long the setpoints that it lives on have been silent; 0: it lives on none."""
        return 0

    def go_around(self, _height_m: float, /) -> Reply:
        """Gives a landing up and climbs to a height above the touchdown [m], NaN: the usual one; or says why not."""
        return Reply(Verdict.TEMPORARILY_REJECTED, "not landing")

    def forget(self) -> None:
        """What clients have asked of it does not wait for the next time it is entered."""

    def refusal(self) -> str:
        """Why it cannot be flown now, besides what its row says; empty if it can."""
        return ""

    def needs_position(self) -> bool:
        """Whether what it would fly now needs a position, where its row says that it may."""
        return True

    def goes_away(self) -> bool:
        """Whether it leads elsewhere at once."""
        return False


class StandardMode(IntEnum):
    """Numbered as MAV_STANDARD_MODE."""

    NONE = 0
    POSITION_HOLD = 1
    ORBIT = 2
    CRUISE = 3
    ALTITUDE_HOLD = 4
    SAFE_RECOVERY = 5
    MISSION = 6
    LAND = 7
    TAKEOFF = 8


class Px4Main(IntEnum):
    """PX4_CUSTOM_MAIN_MODE."""

    MANUAL = 1
    ALTCTL = 2
    POSCTL = 3
    AUTO = 4
    ACRO = 5
    OFFBOARD = 6
    STABILIZED = 7
    TERMINATION = 10


class Disarmed(IntEnum):
    """Which mode a vehicle is in once it is disarmed."""

    USUAL = 0  # Hold; by ArduPilot's rules the same
    HOLD = 1  # nothing is left of it
    SAME = 2  # arming again in it is usual


@dataclass(frozen=True, slots=True)
class DialectMode:
    """A mode as the clients of one autopilot know it."""

    number: int  # HEARTBEAT.custom_mode
    name: str
    is_selectable: bool = True  # by a pilot; others are entered by a command


def px4_mode(main: Px4Main, sub: int, name: str, *, is_selectable: bool = True) -> DialectMode:
    """A mode of px4_custom_mode.h."""
    return DialectMode(main << 16 | sub << 24, name, is_selectable)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeSpec:
    """One flight mode of a class of vehicles."""

    mode: Mode
    build: Callable[[Any], FlightMode]
    """Makes what flies it, from the navigator's ModeParts; modes with the same builder share the object."""

    # What it needs, and when it may be chosen.
    needs_position: bool = False  # valid horizontal position, velocity and height
    needs_height: bool = False  # a valid height
    needs_home: bool = False
    needs_sticks: bool = False  # flown by a pilot
    may_arm: bool = False  # the vehicle may be armed in it
    on_ground: bool = False  # may be chosen while standing on the ground
    on_takeoff: bool = False  # may be chosen on the ground once a take-off has begun, which is finished first
    disarmed: Disarmed = Disarmed.USUAL
    takes: tuple[type[ModeRequest] | type[Report], ...] = ()  # what clients may ask of it besides to be entered

    # How clients and logs know it.
    px4: DialectMode | Mode  # a mode: PX4 does not have this one, and that is the nearest of its own
    ardupilot: DialectMode | Mode
    standard: StandardMode = StandardMode.NONE
    is_advanced: bool = False
    nav_state: int  # vehicle_status.nav_state of PX4's logs
    shell_name: str = ""  # of PX4's `commander mode`, besides its own name
    switch: int | None = None  # value of COM_FLTMODE1..6
    aux_function: int | None = None  # value of ArduPilot's RCx_OPTION

    # Failsafes and the pilot's sticks.
    strength: Action = Action.WARN  # failsafe actions as strong as this, or weaker, do not end it
    carries_out: tuple[Action, ...] = ()  # the failsafe actions that lead to it
    exception: int = 0  # its bit of COM_DLL_EXCEPT and COM_RCL_EXCEPT
    override: int = 0  # its bit of COM_RC_OVERRIDE
    rests_in_middle: bool = False  # the throttle stick: armed with it there, rather than down

    @property
    def is_offboard(self) -> bool:
        """Whether a client's setpoints fly it, PX4's way or ArduPilot's."""
        return self.override == OFFBOARD_OVERRIDE


ModeTable = Mapping[Mode, ModeSpec]


def mode_table(*specs: ModeSpec) -> ModeTable:
    """The modes of a class of vehicles, in the order in which clients get them listed.

    Raises:
        ValueError: two modes share a number, or a mode is shown as one that is not there.
    """
    table = {spec.mode: spec for spec in specs}
    for what, numbers in (
        ("mode", [int(spec.mode) for spec in specs]),
        ("PX4 number", [spec.px4.number for spec in specs if isinstance(spec.px4, DialectMode)]),
        ("ArduPilot number", [spec.ardupilot.number for spec in specs if isinstance(spec.ardupilot, DialectMode)]),
        ("switch number", [spec.switch for spec in specs if spec.switch is not None]),
        ("auxiliary function", [spec.aux_function for spec in specs if spec.aux_function is not None]),
        ("failsafe action", [int(action) for spec in specs for action in spec.carries_out]),
    ):
        twice = sorted({number for number in numbers if numbers.count(number) > 1})
        if twice:
            raise ValueError(f"two modes have {what} {twice[0]}")
    for spec in specs:
        for shown in (spec.px4, spec.ardupilot):
            if isinstance(shown, Mode) and shown not in table:
                raise ValueError(f"mode {spec.mode.name} is shown as {shown.name}, which is not there")
    return MappingProxyType(table)


def further_mode(number: int, name: str) -> Mode:
    """A mode that `Mode` does not name, of another class of vehicles or of an experiment: only its row knows it."""
    mode = int.__new__(Mode, number)
    mode._name_, mode._value_ = name, number
    return mode
