"""The flight modes of a rover, one row each, in the order in which PX4's clients get them listed."""

from autopilot.interface.client_requests import GoTo, OffboardSetpoint
from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import (
    AUTO_OVERRIDE,
    HOLD_EXCEPTED,
    MISSION_EXCEPTED,
    OFFBOARD_EXCEPTED,
    OFFBOARD_OVERRIDE,
    DialectMode,
    Disarmed,
    FlightMode,
    ModeSpec,
    Px4Main,
    StandardMode,
    mode_table,
    px4_mode,
)
from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.mode_parts import ModeParts, of_context
from autopilot.navigator.modes.rtl_destination import Destinations
from autopilot.vehicles.rover.auto_modes import RoverHold, RoverReturn
from autopilot.vehicles.rover.offboard import RoverOffboard
from autopilot.vehicles.rover.stick_modes import Acro, Manual, Position, Stabilized


def _mission(parts: ModeParts) -> FlightMode:
    return parts.mission


def _return(parts: ModeParts) -> FlightMode:
    destinations = Destinations(parts.context, parts.rally, parts.mission, parts.fence)
    return RoverReturn(parts.context, destinations, parts.fence)


ROVER_MODES = mode_table(
    ModeSpec(
        mode=Mode.POSITION,
        build=of_context(Position),
        needs_position=True,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.POSCTL, 0, "Position"),
        ardupilot=DialectMode(3, "Steering"),
        standard=StandardMode.POSITION_HOLD,
        nav_state=2,
        shell_name="posctl",
        switch=2,
        aux_function=53,
        is_climb_rate=True,
    ),
    ModeSpec(
        mode=Mode.HOLD,
        build=of_context(RoverHold),
        may_arm=True,
        on_ground=True,
        takes=(GoTo,),
        px4=px4_mode(Px4Main.AUTO, 3, "Hold"),
        ardupilot=DialectMode(4, "Hold"),
        nav_state=4,
        shell_name="auto:loiter",
        switch=4,
        aux_function=74,
        carries_out=(Action.HOLD,),
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
        is_climb_rate=True,
    ),
    ModeSpec(
        mode=Mode.MISSION,
        build=_mission,
        needs_position=True,
        needs_home=True,
        may_arm=True,
        on_ground=True,
        px4=px4_mode(Px4Main.AUTO, 4, "Mission"),
        ardupilot=DialectMode(10, "Auto"),
        standard=StandardMode.MISSION,
        nav_state=3,
        shell_name="auto:mission",
        switch=3,
        aux_function=16,
        exception=MISSION_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.RETURN,
        build=_return,
        needs_position=True,
        needs_home=True,
        on_ground=True,
        px4=px4_mode(Px4Main.AUTO, 5, "Return"),
        ardupilot=DialectMode(11, "RTL"),
        standard=StandardMode.SAFE_RECOVERY,
        nav_state=5,
        shell_name="auto:rtl",
        switch=5,
        aux_function=4,
        strength=Action.RETURN,
        carries_out=(Action.RETURN,),
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.OFFBOARD,
        build=of_context(RoverOffboard),
        needs_position=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.HOLD,
        takes=(OffboardSetpoint,),
        px4=px4_mode(Px4Main.OFFBOARD, 0, "Offboard"),
        ardupilot=DialectMode(15, "Guided"),
        is_advanced=True,
        nav_state=14,
        switch=7,
        exception=OFFBOARD_EXCEPTED,
        override=OFFBOARD_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.STABILIZED,
        build=of_context(Stabilized),
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.STABILIZED, 0, "Stabilized"),
        ardupilot=Mode.POSITION,
        is_advanced=True,
        nav_state=15,
        switch=8,
        is_climb_rate=True,
    ),
    ModeSpec(
        mode=Mode.MANUAL,
        build=of_context(Manual),
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.MANUAL, 0, "Manual"),
        ardupilot=DialectMode(0, "Manual"),
        is_advanced=True,
        nav_state=0,
        shell_name="manual",
        switch=0,
        aux_function=51,
        is_climb_rate=True,
    ),
    ModeSpec(
        mode=Mode.ACRO,
        build=of_context(Acro),
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.ACRO, 0, "Acro"),
        ardupilot=DialectMode(1, "Acro"),
        is_advanced=True,
        nav_state=10,
        switch=6,
        aux_function=52,
        is_climb_rate=True,
    ),
)
