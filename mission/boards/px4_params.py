"""What PX4 has to know of our vehicle: the nearest of its airframes, and parameters, from the airframe file.

Our own rover's and plane's control laws have PX4's parameters, in name and meaning: what they are set to by the
airframe, PX4 is set to as well. Where its unit differs, or where it has what ours has not, that is said here.
"""

from collections.abc import Mapping

from autopilot.params import parameter_table
from autopilot.vehicles.rover.control_airframe import motor_time_s, rover_control_airframe
from common.airframe import Airframe
from common.airframes.multirotor import MultirotorAirframe
from common.airframes.plane import PlaneAirframe
from common.airframes.rover import RoverAirframe
from mission.boards.vehicle_params import check_id_free, hover_fraction, thrust_curve, value_text
from sim.bodies.vehicles import class_of

MOTOR, SERVO, NOSE_WHEEL = 101, 201, 440  # of PWM_MAIN_FUNCn
_ROVER_NAMES = ("RO_", "RA_", "RD_", "PP_", "NAV_ACC_RAD", "CA_R_REV")
_PLANE_NAMES = ("FW_", "TRIM_PITCH", "NPFG_", "RWTO_PSP", "NAV_ACC_RAD", "NAV_LOITER_RAD", "MIS_TAKEOFF_ALT")
_OUTPUTS = 9  # as many as its airframes set
_CRUISE_M_S = 2.0  # guess: of the gain of the yaw rate
_SLOWED_INTEGRAL = 0.1  # guess: behind the limit of its throttle's rate it winds up
_LAG = 3.0  # of the speed behind its setpoint, over the motor's: guess, with what limits the throttle's rate
_AILERON, _ELEVATOR, _RUDDER = 15, 3, 4  # CA_SV_CSn_TYPE: one channel for both ailerons


def px4_model(airframe: Airframe) -> str:
    """PX4_SIM_MODEL: of an airframe that brings the modules of the vehicle's class."""
    if isinstance(airframe, RoverAirframe):
        return "gz_rover_differential" if airframe.is_skid else "gz_rover_ackermann"
    return "jsbsim_rascal" if isinstance(airframe, PlaneAirframe) else "none_iris"


def px4_environment(airframe: Airframe, parameters: Mapping[str, float]) -> dict[str, str]:
    """What its start script reads; `parameters` are those that the user has given."""
    check_id_free(parameters)
    values = px4_params(airframe) | dict(parameters)
    # Not the simulator that some of the airframes are for
    chosen = {"PX4_SIM_MODEL": px4_model(airframe), "PX4_SIMULATOR": "mavlink"}
    return chosen | {f"PX4_PARAM_{name}": value_text(value) for name, value in values.items()}


def px4_params(airframe: Airframe) -> dict[str, float]:
    """By PX4's names."""
    if isinstance(airframe, MultirotorAirframe):
        return _copter(airframe)
    if isinstance(airframe, RoverAirframe):
        return _rover(airframe)
    return _plane(airframe) if isinstance(airframe, PlaneAirframe) else {}


def _copter(airframe: MultirotorAirframe) -> dict[str, float]:
    params: dict[str, float] = {
        "CA_ROTOR_COUNT": float(len(airframe.rotors)),
        "THR_MDL_FAC": thrust_curve(airframe),
        "MPC_THR_HOVER": hover_fraction(airframe),
    }
    for k, rotor in enumerate(airframe.rotors):
        params[f"CA_ROTOR{k}_PX"], params[f"CA_ROTOR{k}_PY"] = rotor.x_m, rotor.y_m
        params[f"CA_ROTOR{k}_KM"] = 0.05 * rotor.spin  # PX4's default size
    return params | _outputs([MOTOR + k for k in range(len(airframe.rotors))])


def _rover(airframe: RoverAirframe) -> dict[str, float]:
    params = _ours(airframe, _ROVER_NAMES)
    top_m_s = params["RO_MAX_THR_SPEED"]
    # It adds throttle for an error of speed, where ours adds speed, and for one of the yaw rate what steers
    params["RO_SPEED_P"] /= top_m_s
    params["RO_SPEED_I"] *= _SLOWED_INTEGRAL / top_m_s
    steer = 0.5 * airframe.wheels.track_m / top_m_s if airframe.is_skid else airframe.wheel_base_m / _CRUISE_M_S
    for name in ("RO_YAW_RATE_P", "RO_YAW_RATE_I"):
        params[name] *= steer
    # It brakes by the motor alone, along v²/2a + v·lag = distance, where lag is 2 a over the jerk
    decel = min(params["RO_DECEL_LIM"], rover_control_airframe(airframe).motor_decel)
    jerk = 2.0 * decel / (_LAG * motor_time_s(airframe))
    params |= {"RO_DECEL_LIM": round(decel, 2), "RO_JERK_LIM": round(min(params["RO_JERK_LIM"], jerk), 1)}
    functions = [MOTOR + 1, MOTOR] if airframe.is_skid else [SERVO, MOTOR]  # its first motor is the right one
    return params | {"SIM_GZ_EN": 0.0} | _outputs(functions)


def _plane(airframe: PlaneAirframe) -> dict[str, float]:
    surfaces: dict[str, float] = {"CA_SV_CS_COUNT": 3.0, "CA_ROTOR_COUNT": 1.0, "PWM_MAIN_REV": 0.0}
    for k, (kind, axis) in enumerate(((_AILERON, "R"), (_ELEVATOR, "P"), (_RUDDER, "Y"))):
        surfaces[f"CA_SV_CS{k}_TYPE"] = float(kind)
        surfaces |= {f"CA_SV_CS{k}_TRQ_{each}": float(each == axis) for each in "RPY"}
    runway = {"RWTO_TKOFF": 1.0, "SYS_HAS_NUM_ASPD": 1.0}
    runway["NAV_DLL_ACT"] = 0.0  # of its airframe, which would not arm without a ground station
    functions = [SERVO, SERVO + 1, MOTOR, SERVO + 2, NOSE_WHEEL]
    ours = _ours(airframe, _PLANE_NAMES)
    del ours["FW_WR_P"], ours["FW_WR_D"]
    ours["FW_W_EN"] = 0.0  # landed, its nose wheel would turn to the heading with which the approach began
    ours["FW_T_HRATE_FF"] = 1.0  # else it glides metres above its slope
    return ours | surfaces | runway | _outputs(functions)


def _ours(airframe: Airframe, prefixes: tuple[str, ...]) -> dict[str, float]:
    """The parameters of our own flight controller that begin so."""
    table = parameter_table(airframe, vehicle=class_of(airframe).vehicle)
    return {name: float(table[name]) for name in table if name.startswith(prefixes)}


def _outputs(functions: list[int]) -> dict[str, float]:
    """What moves our actuators, in their order; the outputs of its own airframe behind them are taken away."""
    of_all = functions + [0] * (_OUTPUTS - len(functions))
    return {f"PWM_MAIN_FUNC{k + 1}": float(function) for k, function in enumerate(of_all)}
