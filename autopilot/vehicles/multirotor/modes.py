"""The flight modes of a multirotor, one row each, in the order in which PX4's clients get them listed."""

from autopilot.interface.client_requests import (
    GoTo,
    LandAt,
    LandingTargetReport,
    OffboardSetpoint,
    OrbitRequest,
    TakeOff,
    TargetReport,
)
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
from autopilot.vehicles.multirotor.orbit import Orbit
from autopilot.vehicles.multirotor.stick_modes import Acro, Altitude, Position, Stabilized


def _mission(parts: ModeParts) -> FlightMode:
    return parts.mission


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
    ModeSpec(
        mode=Mode.POSITION,
        build=of_context(Position),
        needs_position=True,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.POSCTL, 0, "Position"),
        ardupilot=DialectMode(16, "PosHold"),
        standard=StandardMode.POSITION_HOLD,
        nav_state=2,
        shell_name="posctl",
        switch=2,
        aux_function=69,
        is_climb_rate=True,
    ),
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
        is_climb_rate=True,
    ),
    ModeSpec(
        mode=Mode.HOLD,
        build=_hold,
        needs_position=True,
        may_arm=True,
        on_ground=True,
        takes=(GoTo,),
        px4=px4_mode(Px4Main.AUTO, 3, "Hold"),
        ardupilot=DialectMode(5, "Loiter"),
        nav_state=4,
        shell_name="auto:loiter",
        switch=4,
        aux_function=56,
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
        ardupilot=DialectMode(3, "Auto"),
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
        px4=px4_mode(Px4Main.AUTO, 5, "Return"),
        ardupilot=DialectMode(6, "RTL"),
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
    ModeSpec(
        mode=Mode.OFFBOARD,
        build=of_context(Offboard),
        needs_position=True,  # though not for setpoints of attitude or rate
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.HOLD,
        takes=(OffboardSetpoint,),
        px4=px4_mode(Px4Main.OFFBOARD, 0, "Offboard"),
        ardupilot=Mode.GUIDED,
        is_advanced=True,
        nav_state=14,
        switch=7,
        exception=OFFBOARD_EXCEPTED,
        override=OFFBOARD_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.FOLLOW,
        build=of_context(Follow),
        needs_position=True,
        on_takeoff=True,
        takes=(TargetReport,),
        px4=px4_mode(Px4Main.AUTO, 8, "Follow Me"),
        ardupilot=DialectMode(23, "Follow"),
        nav_state=19,
        shell_name="auto:follow",
        switch=12,
        aux_function=57,
        exception=HOLD_EXCEPTED,
    ),
    ModeSpec(
        mode=Mode.ORBIT,
        build=of_context(Orbit),
        needs_position=True,
        on_takeoff=True,
        takes=(OrbitRequest,),
        px4=px4_mode(Px4Main.POSCTL, 1, "Orbit", is_selectable=False),
        ardupilot=DialectMode(7, "Circle"),
        standard=StandardMode.ORBIT,
        nav_state=21,
        aux_function=72,
        exception=HOLD_EXCEPTED,
    ),
    ModeSpec(
        mode=Mode.STABILIZED,
        build=_stabilized,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.STABILIZED, 0, "Stabilized"),
        ardupilot=DialectMode(0, "Stabilize"),
        is_advanced=True,
        nav_state=15,
        switch=8,
        aux_function=68,
    ),
    ModeSpec(
        mode=Mode.MANUAL,
        build=_stabilized,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.MANUAL, 0, "Manual"),
        ardupilot=Mode.STABILIZED,
        is_advanced=True,
        nav_state=0,
        shell_name="manual",
        switch=0,
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
    ),
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
    ModeSpec(
        mode=Mode.SMART_RETURN,
        build=_smart_return,
        needs_position=True,
        needs_home=True,
        px4=Mode.RETURN,
        ardupilot=DialectMode(21, "Smart RTL"),
        nav_state=5,
        aux_function=42,
        strength=Action.RETURN,
        carries_out=(Action.SMART_RETURN,),
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.GUIDED,
        build=of_context(Guided),
        needs_position=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        takes=(TakeOff, GoTo, OffboardSetpoint),
        px4=Mode.OFFBOARD,
        ardupilot=DialectMode(4, "Guided"),
        is_advanced=True,
        nav_state=14,
        aux_function=55,
        exception=OFFBOARD_EXCEPTED,
        override=OFFBOARD_OVERRIDE,
    ),
)
