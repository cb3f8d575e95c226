"""How our flight controller is set to follow, and what a guard has to know of that.

In: who flies, and the parameters of a flight. Out: those that it is set by, and with what the vehicle brakes.
"""

from common.airframe import load_airframe
from common.params import ParameterTable
from mission.flight_config import FlightConfig, flight_parameters
from policies.companion.skills.following import Pilot
from policies.tasks.follow_me.observe import TRACKED
from policies.tasks.follow_me.tracked.keep_off import OWNER_BRAKE_M_S2
from policies.tasks.follow_me.tracked.quick_vehicle import (
    BRAKE_PARAMETERS,
    MEASURED,
    QUICK,
    believed_m_s2,
    brake_m_s2,
)

BY_SIGHT = {"EKF2_EV_CTRL": 4.0}
"""The parameter by which our flight controller uses the velocity that the companion sees while GNSS is away."""


def as_trained(config: FlightConfig, pilot: Pilot) -> FlightConfig:
    """The flight of our own flight controller, as quick as where its pilot is trained, unless it says otherwise.

    Args:
        config: of a vehicle that has these parameters; any other stays as it is.
        pilot: who goes by the senses is trained with a quick vehicle.
    """
    table = flight_parameters(config, load_airframe(config.airframe))
    if pilot.kind != TRACKED or any(name not in table for name in QUICK):
        return config
    return config.model_copy(update={"parameters": QUICK | config.parameters})


def owner_brake(config: FlightConfig, table: ParameterTable, *, is_ours: bool = True) -> float:
    """With which a guard takes our vehicle to brake before people [m/s²].

    Args:
        config: of the flight; where nothing was measured it brakes no harder than any vehicle is taken to.
        table: of the flight controller; of one that does not say how fast it speeds up nothing is known.
        is_ours: all of it is our own, down to the motors.
    """
    if any(name not in table for name in BRAKE_PARAMETERS):
        return OWNER_BRAKE_M_S2
    brake = brake_m_s2(*(table[name] for name in BRAKE_PARAMETERS))
    is_measured = is_ours and config.engine == "native" and config.airframe in MEASURED
    return believed_m_s2(brake, is_measured=is_measured)
