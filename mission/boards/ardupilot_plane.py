"""What ArduPilot has to know of a plane: the gains, speeds and limits of our own flight controller, in its units.

Both scale their gains by the airspeed and count surfaces by fractions; ArduPilot's are of 45 degrees. It has no brakes:
they are its flaps, which it sets at the approach.
"""

from math import radians, sin, tan

from autopilot.vehicles.plane.ardupilot import APM_PLANE
from autopilot.vehicles.plane.vehicle import PLANE
from common.airframes.plane import PlaneAirframe

_FULL_RAD = radians(45.0)  # ArduPilot's angle of a surface at its end
_FIRST_PULSE, _LAST_PULSE, _MIDDLE_PULSE = 1000.0, 2000.0, 1500.0
_SURFACES, _BRAKE = (1, 2, 4, 5), 6  # servos, counted from 1
_GROUND_STEERING, _AUTOMATIC_FLAPS = 26.0, 3.0  # SERVOn_FUNCTION
_PITCH_MAX_DEG = 15.0  # TECS_PITCH_MAX's default
_OTHER_MEANING = ("WP_RADIUS",)  # ArduPilot's is where it may begin to turn, ours where a place counts as reached
_STEERED_M = 5.0  # height up to which the nose wheel steers: guess
_DISARMED_S = 3.0  # after it has stopped: guess


def plane_params(airframe: PlaneAirframe) -> dict[str, float]:
    """By ArduPilot's names."""
    ours: dict[str, float] = {**{each.name: each.default for each in PLANE.parameters}, **PLANE.defaults(airframe)}
    return {
        **{alias.name: alias.shown(ours[alias.of]) for alias in APM_PLANE.aliases if alias.name not in _OTHER_MEANING},
        **_servos(),
        **_rates(ours),
        **_ground(airframe, ours),
        **_energy(ours),
        "ARSPD_USE": 1.0,
        "SIM_ARSPD_RND": 0.0,  # the tube's noise is ours
        "PTCH_TRIM_DEG": ours["FW_PSP_OFF"],
        "KFF_RDDRMIX": _rudder_per_aileron(airframe),
        "RTL_ALTITUDE": ours["RTL_RETURN_ALT"],
        "RTL_AUTOLAND": 1.0,  # lands by the mission's DO_LAND_START, if there is one
    }


def _servos() -> dict[str, float]:
    params = {f"SERVO{_SURFACES[-1]}_FUNCTION": _GROUND_STEERING, f"SERVO{_BRAKE}_FUNCTION": _AUTOMATIC_FLAPS}
    for k in range(1, _BRAKE + 1):
        params |= {f"SERVO{k}_MIN": _FIRST_PULSE, f"SERVO{k}_MAX": _LAST_PULSE}
        params[f"SERVO{k}_TRIM"] = _MIDDLE_PULSE if k in _SURFACES else _FIRST_PULSE
    return params


def _rates(ours: dict[str, float]) -> dict[str, float]:
    """Roll and pitch, by our loops' gains: commands per rad/s at the airspeed of trim."""
    params = {
        "SCALING_SPEED": ours["FW_AIRSPD_TRIM"],
        "RLL2SRV_TCONST": ours["FW_R_TC"],
        "RLL2SRV_RMAX": ours["FW_R_RMAX"],
        "PTCH2SRV_TCONST": ours["FW_P_TC"],
        "PTCH2SRV_RMAX_UP": ours["FW_P_RMAX_POS"],
        "PTCH2SRV_RMAX_DN": ours["FW_P_RMAX_NEG"],
    }
    for name, of in (("RLL", "FW_RR"), ("PTCH", "FW_PR")):
        for gain in ("FF", "P", "I"):
            params[f"{name}_RATE_{gain}"] = _FULL_RAD * ours[f"{of}_{gain}"]
        params[f"{name}_RATE_D"] = 0.0
    return params


def _ground(airframe: PlaneAirframe, ours: dict[str, float]) -> dict[str, float]:
    """Run, rotation, flare and roll."""
    gear = airframe.gear
    return {
        "GROUND_STEER_ALT": _STEERED_M,
        # the diameter of its tightest turn, as ArduPilot wants it
        "STEER2SRV_P": 2.0 * (gear.nose_x_m + gear.main_x_m) / tan(gear.steering_max_rad),
        "TKOFF_ALT": ours["MIS_TAKEOFF_ALT"],
        "TKOFF_ROTATE_SPD": ours["FW_AIRSPD_MIN"],
        "TKOFF_GND_PITCH": -ours["FW_PSP_OFF"],  # level on its wheels: PTCH_TRIM_DEG is added
        "TECS_LAND_ARSPD": ours["FW_AIRSPD_MIN"],
        "LAND_FLAP_PERCNT": 100.0,
        "LAND_DISARMDELAY": _DISARMED_S,
    }


def _energy(ours: dict[str, float]) -> dict[str, float]:
    climb_m_s = ours["FW_AIRSPD_TRIM"] * sin(radians(_PITCH_MAX_DEG))
    return {
        "TRIM_THROTTLE": 100.0 * ours["FW_THR_TRIM"],
        "TECS_PITCH_MAX": _PITCH_MAX_DEG,
        "TECS_CLMB_MAX": min(ours["FW_T_CLMB_MAX"], climb_m_s),  # what that pitch lets it do
    }


def _rudder_per_aileron(airframe: PlaneAirframe) -> float:
    """That holds the nose against what the ailerons do to it."""
    side, surfaces = airframe.side, airframe.surfaces
    adverse = side.c_yaw_aileron * surfaces.aileron_max_rad
    return max(adverse / (side.c_yaw_rudder * surfaces.rudder_max_rad), 0.0)
