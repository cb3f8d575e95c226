"""The flight modes of a multirotor, one row each, in the order in which PX4's clients get them listed."""

from autopilot.interface.client_requests import (
    GoTo,
    LandAt,
    LandingTargetReport,
    OffboardSetpoint,
    TakeOff,
)
from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import (
    AUTO_OVERRIDE,
    HOLD_EXCEPTED,
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
from autopilot.navigator.mode_parts import ModeParts, mission_mode, of_context
from autopilot.navigator.modes.brake import Brake
from autopilot.navigator.modes.follow import Follow
from autopilot.navigator.modes.guided import Guided
from autopilot.navigator.modes.hold import Hold
from autopilot.navigator.modes.land import Land
from autopilot.navigator.modes.offboard import Offboard
from autopilot.navigator.modes.rtl import Return
from autopilot.navigator.modes.rtl_destination import Destinations
from autopilot.navigator.modes.smart_return import SmartReturn
from autopilot.navigator.modes.takeoff import Takeoff
from autopilot.navigator.modes.termination import Termination
from autopilot.vehicles import ardupilot_modes, px4_modes
from autopilot.vehicles.multirotor.orbit import Orbit
from autopilot.vehicles.multirotor.stick_modes import Acro, Altitude, Position, Stabilized


def _hold(parts: ModeParts) -> FlightMode:
    return Hold(parts.context, steered=Position(parts.context))


def _precision_land(parts: ModeParts) -> FlightMode:
    return parts.mission.precision  # landing items use it too


def _return(parts: ModeParts) -> FlightMode:
    destinations = Destinations(parts.context, parts.rally, parts.mission, parts.fence)
    return Return(parts.context, destinations, parts.fence, parts.mission)


def _smart_return(parts: ModeParts) -> FlightMode:
    return SmartReturn(parts.context, parts.crumbs)


_stabilized = of_context(Stabilized)

MULTIROTOR_MODES = mode_table(
    px4_modes.POSITION(build=of_context(Position), ardupilot=DialectMode(16, "PosHold"), aux_function=69),
    ModeSpec(
        mode=Mode.ALTITUDE,
        build=of_context(Altitude),
        needs_height=True,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.ALTCTL, 0, "Altitude"),
        ardupilot=DialectMode(2, "Alt Hold"),
        standard=StandardMode.ALTITUDE_HOLD,
        nav_state=1,
        shell_name="altctl",
        switch=1,
        aux_function=70,
        carries_out=(Action.ALTITUDE,),
        rests_in_middle=True,
    ),
    px4_modes.HOLD(build=_hold, needs_position=True, ardupilot=DialectMode(5, "Loiter"), aux_function=56),
    px4_modes.MISSION(build=mission_mode, ardupilot=DialectMode(3, "Auto")),
    px4_modes.RETURN(build=_return, ardupilot=DialectMode(6, "RTL")),
    ModeSpec(
        mode=Mode.LAND,
        build=of_context(Land),
        takes=(LandAt,),
        px4=px4_mode(Px4Main.AUTO, 6, "Land"),
        ardupilot=DialectMode(9, "Land"),
        standard=StandardMode.LAND,
        nav_state=18,
        shell_name="auto:land",
        switch=11,
        aux_function=18,
        strength=Action.LAND,
        carries_out=(Action.LAND,),
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.PRECISION_LAND,
        build=_precision_land,
        needs_position=True,
        takes=(LandingTargetReport,),
        px4=px4_mode(Px4Main.AUTO, 9, "Precision Land"),
        ardupilot=Mode.LAND,
        nav_state=20,
        shell_name="auto:precland",
        switch=13,
        strength=Action.LAND,
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.TAKEOFF,
        build=of_context(Takeoff),
        needs_position=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.HOLD,
        takes=(TakeOff,),
        px4=px4_mode(Px4Main.AUTO, 2, "Takeoff"),
        ardupilot=Mode.GUIDED,
        standard=StandardMode.TAKEOFF,
        nav_state=17,
        shell_name="auto:takeoff",
        switch=10,
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    px4_modes.OFFBOARD(  # its position is not needed for setpoints of attitude or rate
        build=of_context(Offboard), ardupilot=Mode.GUIDED
    ),
    px4_modes.FOLLOW(build=of_context(Follow), on_takeoff=True, ardupilot=DialectMode(23, "Follow")),
    px4_modes.ORBIT(build=of_context(Orbit), on_takeoff=True, ardupilot=DialectMode(7, "Circle")),
    px4_modes.STABILIZED(build=_stabilized, ardupilot=DialectMode(0, "Stabilize"), aux_function=68),
    px4_modes.MANUAL(build=_stabilized, ardupilot=Mode.STABILIZED),
    px4_modes.ACRO(build=of_context(Acro), ardupilot=DialectMode(1, "Acro")),
    ModeSpec(
        mode=Mode.TERMINATION,
        build=of_context(Termination),
        on_ground=True,
        disarmed=Disarmed.HOLD,
        px4=px4_mode(Px4Main.TERMINATION, 0, "Termination", is_selectable=False),
        ardupilot=Mode.LAND,
        nav_state=13,
        strength=Action.TERMINATE,
        carries_out=(Action.TERMINATE,),
    ),
    # PX4 has none of the following.
    ModeSpec(
        mode=Mode.BRAKE,
        build=of_context(Brake),
        needs_position=True,
        px4=Mode.HOLD,
        ardupilot=DialectMode(17, "Brake"),
        nav_state=4,
        aux_function=33,
        exception=HOLD_EXCEPTED,
    ),
    ardupilot_modes.SMART_RETURN(build=_smart_return, ardupilot=DialectMode(21, "Smart RTL")),
    ardupilot_modes.GUIDED(
        build=of_context(Guided), takes=(TakeOff, GoTo, OffboardSetpoint), ardupilot=DialectMode(4, "Guided")
    ),
)
