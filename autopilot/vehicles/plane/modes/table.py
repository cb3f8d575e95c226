"""The flight modes of a plane, one row each, in the order in which PX4's clients get them listed."""

from autopilot.interface.client_requests import LandAt, TakeOff
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
    further_mode,
    mode_table,
    px4_mode,
)
from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.mode_parts import ModeParts, mission_mode, of_context
from autopilot.navigator.modes.rtl_destination import Destinations
from autopilot.navigator.modes.termination import Termination
from autopilot.vehicles import px4_modes
from autopilot.vehicles.plane.modes.approach import PlaneLand
from autopilot.vehicles.plane.modes.auto import PlaneCircle, PlaneHold, PlaneReturn
from autopilot.vehicles.plane.modes.departure import PlaneTakeoff
from autopilot.vehicles.plane.modes.offboard import PlaneOffboard
from autopilot.vehicles.plane.modes.sticks import Acro, Altitude, Manual, Position, Stabilized

CIRCLE = further_mode(48, "CIRCLE")


def _return(parts: ModeParts) -> FlightMode:
    destinations = Destinations(parts.context, parts.rally, parts.mission, parts.fence)
    return PlaneReturn(parts.context, destinations, parts.mission)


PLANE_MODES = mode_table(
    px4_modes.POSITION(build=of_context(Position), ardupilot=DialectMode(7, "Cruise")),
    ModeSpec(
        mode=Mode.ALTITUDE,
        build=of_context(Altitude),
        needs_height=True,
        needs_sticks=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.SAME,
        px4=px4_mode(Px4Main.ALTCTL, 0, "Altitude"),
        ardupilot=DialectMode(6, "FBWB"),
        standard=StandardMode.ALTITUDE_HOLD,
        nav_state=1,
        shell_name="altctl",
        switch=1,
        carries_out=(Action.ALTITUDE,),
        rests_in_middle=True,
    ),
    px4_modes.HOLD(build=of_context(PlaneHold), ardupilot=DialectMode(12, "Loiter"), aux_function=56),
    px4_modes.MISSION(build=mission_mode, ardupilot=DialectMode(10, "Auto")),
    px4_modes.RETURN(build=_return, ardupilot=DialectMode(11, "RTL")),
    ModeSpec(
        mode=Mode.LAND,
        build=of_context(PlaneLand),
        needs_position=True,
        takes=(LandAt,),
        px4=px4_mode(Px4Main.AUTO, 6, "Land"),
        ardupilot=Mode.RETURN,
        standard=StandardMode.LAND,
        nav_state=18,
        shell_name="auto:land",
        switch=11,
        strength=Action.LAND,
        carries_out=(Action.LAND,),
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.TAKEOFF,
        build=of_context(PlaneTakeoff),
        needs_position=True,
        may_arm=True,
        on_ground=True,
        disarmed=Disarmed.HOLD,
        takes=(TakeOff,),
        px4=px4_mode(Px4Main.AUTO, 2, "Takeoff"),
        ardupilot=DialectMode(13, "Takeoff"),
        standard=StandardMode.TAKEOFF,
        nav_state=17,
        shell_name="auto:takeoff",
        switch=10,
        aux_function=77,
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    px4_modes.OFFBOARD(build=of_context(PlaneOffboard), ardupilot=DialectMode(15, "Guided")),
    px4_modes.STABILIZED(build=of_context(Stabilized), ardupilot=DialectMode(5, "FBWA")),
    px4_modes.MANUAL(build=of_context(Manual), ardupilot=DialectMode(0, "Manual"), aux_function=51),
    px4_modes.ACRO(build=of_context(Acro), ardupilot=DialectMode(4, "Acro")),
    ModeSpec(
        mode=CIRCLE,
        build=of_context(PlaneCircle),
        px4=Mode.HOLD,
        ardupilot=DialectMode(1, "Circle"),
        nav_state=4,
        aux_function=72,
        exception=HOLD_EXCEPTED,
        override=AUTO_OVERRIDE,
    ),
    ModeSpec(
        mode=Mode.TERMINATION,
        build=of_context(Termination),
        on_ground=True,
        disarmed=Disarmed.HOLD,
        px4=px4_mode(Px4Main.TERMINATION, 0, "Termination", is_selectable=False),
        ardupilot=Mode.HOLD,
        nav_state=13,
        strength=Action.TERMINATE,
        carries_out=(Action.TERMINATE,),
    ),
)
