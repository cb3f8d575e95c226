"""The modes of ArduPilot's Rover that PX4 has not: one row each; a PX4 client sees the nearest of its own."""

from autopilot.interface.client_requests import GoTo, LandingTargetReport, OffboardSetpoint
from autopilot.interface.mode_spec import (
    AUTO_OVERRIDE,
    HOLD_EXCEPTED,
    DialectMode,
    Disarmed,
    FlightMode,
    ModeSpec,
    further_mode,
)
from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.mode_parts import ModeParts, of_context
from autopilot.vehicles import ardupilot_modes
from autopilot.vehicles.rover.modes.auto import RoverLoiter, RoverSmartReturn
from autopilot.vehicles.rover.modes.dock import RoverDock
from autopilot.vehicles.rover.modes.guided import RoverGuided
from autopilot.vehicles.rover.modes.sticks import Simple

LOITER = further_mode(32, "LOITER")
SIMPLE = further_mode(33, "SIMPLE")
DOCK = further_mode(34, "DOCK")


def _smart_return(parts: ModeParts) -> FlightMode:
    return RoverSmartReturn(parts.context, parts.crumbs)


ARDUPILOT_MODES = (
    ModeSpec(
        mode=LOITER,
        build=of_context(RoverLoiter),
        needs_position=True,
        may_arm=True,
        on_ground=True,
        px4=Mode.HOLD,
        ardupilot=DialectMode(5, "Loiter"),
        nav_state=4,
        aux_function=56,
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=SIMPLE,
        build=of_context(Simple),
        needs_position=True,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=Mode.POSITION,
        ardupilot=DialectMode(7, "Simple"),
        nav_state=2,
        aux_function=59,
        rests_in_middle=True,
    ),
    ModeSpec(
        mode=DOCK,
        build=of_context(RoverDock),
        needs_position=True,
        on_ground=True,
        takes=(LandingTargetReport,),
        px4=Mode.HOLD,
        ardupilot=DialectMode(8, "Dock"),
        nav_state=4,
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ardupilot_modes.SMART_RETURN(build=_smart_return, on_ground=True, ardupilot=DialectMode(12, "Smart RTL")),
    ardupilot_modes.GUIDED(
        build=of_context(RoverGuided), takes=(GoTo, OffboardSetpoint), ardupilot=DialectMode(15, "Guided")
    ),
)
