"""The flight modes of a rover, one row each, in the order in which PX4's clients get them listed."""

from autopilot.interface.mode_spec import DialectMode, FlightMode, mode_table
from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.mode_parts import ModeParts, mission_mode, of_context
from autopilot.navigator.modes.rtl_destination import Destinations
from autopilot.vehicles import px4_modes
from autopilot.vehicles.rover.modes.ardupilot_rows import ARDUPILOT_MODES
from autopilot.vehicles.rover.modes.auto import RoverHold, RoverReturn
from autopilot.vehicles.rover.modes.circle import RoverOrbit
from autopilot.vehicles.rover.modes.follow import RoverFollow
from autopilot.vehicles.rover.modes.offboard import RoverOffboard
from autopilot.vehicles.rover.modes.sticks import Acro, Manual, Position, Stabilized


def _return(parts: ModeParts) -> FlightMode:
    destinations = Destinations(parts.context, parts.rally, parts.mission, parts.fence)
    return RoverReturn(parts.context, destinations, parts.fence)


ROVER_MODES = mode_table(
    px4_modes.POSITION(build=of_context(Position), ardupilot=DialectMode(3, "Steering"), aux_function=53),
    px4_modes.HOLD(build=of_context(RoverHold), ardupilot=DialectMode(4, "Hold"), aux_function=54),
    px4_modes.MISSION(build=mission_mode, ardupilot=DialectMode(10, "Auto")),
    px4_modes.RETURN(build=_return, on_ground=True, ardupilot=DialectMode(11, "RTL")),
    px4_modes.OFFBOARD(build=of_context(RoverOffboard), ardupilot=Mode.GUIDED),
    px4_modes.FOLLOW(build=of_context(RoverFollow), on_ground=True, ardupilot=DialectMode(6, "Follow")),
    px4_modes.ORBIT(build=of_context(RoverOrbit), on_ground=True, ardupilot=DialectMode(9, "Circle")),
    px4_modes.STABILIZED(build=of_context(Stabilized), ardupilot=Mode.POSITION, rests_in_middle=True),
    px4_modes.MANUAL(
        build=of_context(Manual), ardupilot=DialectMode(0, "Manual"), aux_function=51, rests_in_middle=True
    ),
    px4_modes.ACRO(build=of_context(Acro), ardupilot=DialectMode(1, "Acro"), rests_in_middle=True),
    *ARDUPILOT_MODES,
)
