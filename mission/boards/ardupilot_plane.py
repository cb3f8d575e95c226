"""What ArduPilot has to know of a plane: the speeds and limits of our own flight controller, and gains of its own.

Its rate loops are led by their feed-forward, which has to be that of the steady rate. It has no brakes: they are its
flaps, which it sets at the approach.
"""

from math import radians, sin, tan

from autopilot.vehicles.plane.ardupilot import APM_PLANE
from autopilot.vehicles.plane.vehicle import PLANE
from common.airframes.plane import PlaneAirframe

_FULL_RAD = radians(45.0)  # ArduPilot's angle of a surface at its end
_FIRST_PULSE, _LAST_PULSE, _MIDDLE_PULSE = 1000.0, 2000.0, 1500.0
_SURFACES, _BRAKE = (1, 2, 4), 5  # servos, counted from 1
_AUTOMATIC_FLAPS = 3.0  # SERVOn_FUNCTION
_PITCH_MAX_DEG = 15.0  # TECS_PITCH_MAX's default
_DENSITY_KG_M3 = 1.225  # ISO 2533
# Where it may begin to turn, and not as ours where a place counts as reached; a way to a line as slow as its bank
_ITS_OWN = ("WP_RADIUS", "NAVL1_PERIOD", "NAVL1_DAMPING")
_P_PER_FF, _I_PER_FF = 0.2, 0.6  # guess; its AutoTune ends between
_SHOWS_TRUE_PITCH = 256.0  # FLIGHT_OPTIONS: without PTCH_TRIM_DEG off it
_STEERED_M = 5.0  # height up to which nose wheel and rudder hold the course: guess
_RUDDER_GAIN = 2.5  # over the diameter of its tightest turn, which would do for the wheel alone: guess
_CLIMB_BANK_DEG = 15.0  # of the first metres of a climb: with less it cannot hold its course in a crosswind
_DISARMED_S = 3.0  # after it has stopped: guess


def plane_params(airframe: PlaneAirframe) -> dict[str, float]:
    """By ArduPilot's names."""
    ours: dict[str, float] = {**{each.name: each.default for each in PLANE.parameters}, **PLANE.defaults(airframe)}
    return {
        **{alias.name: alias.shown(ours[alias.of]) for alias in APM_PLANE.aliases if alias.name not in _ITS_OWN},
        **_servos(),
        **_rates(airframe, ours),
        **_ground(airframe, ours),
        **_energy(ours),
        "ARSPD_USE": 1.0,
        "SIM_ARSPD_RND": 0.0,  # the tube's noise is ours
        "FLIGHT_OPTIONS": _SHOWS_TRUE_PITCH,
        "PTCH_TRIM_DEG": ours["FW_PSP_OFF"],
        "KFF_RDDRMIX": _rudder_per_aileron(airframe),
        "RTL_ALTITUDE": ours["RTL_RETURN_ALT"],
        "RTL_AUTOLAND": 1.0,  # lands by the mission's DO_LAND_START, if there is one
    }


def _servos() -> dict[str, float]:
    params = {f"SERVO{_BRAKE}_FUNCTION": _AUTOMATIC_FLAPS}
    for k in range(1, _BRAKE + 1):
        params |= {f"SERVO{k}_MIN": _FIRST_PULSE, f"SERVO{k}_MAX": _LAST_PULSE}
        params[f"SERVO{k}_TRIM"] = _MIDDLE_PULSE if k in _SURFACES else _FIRST_PULSE
    return params


def _rates(airframe: PlaneAirframe, ours: dict[str, float]) -> dict[str, float]:
    """Roll and pitch, of commands per rad/s at the airspeed of trim."""
    leads = {"RLL": ours["FW_RR_FF"], "PTCH": _elevator_per_rate(airframe, ours["FW_AIRSPD_TRIM"])}
    params = {
        "SCALING_SPEED": ours["FW_AIRSPD_TRIM"],
        "RLL2SRV_TCONST": ours["FW_R_TC"],
        "RLL2SRV_RMAX": ours["FW_R_RMAX"],
        "PTCH2SRV_TCONST": ours["FW_P_TC"],
        "PTCH2SRV_RMAX_UP": ours["FW_P_RMAX_POS"],
        "PTCH2SRV_RMAX_DN": ours["FW_P_RMAX_NEG"],
    }
    for name, lead in leads.items():
        for gain, part in (("FF", 1.0), ("P", _P_PER_FF), ("I", _I_PER_FF), ("D", 0.0)):
            params[f"{name}_RATE_{gain}"] = _FULL_RAD * part * lead
    return params


def _elevator_per_rate(airframe: PlaneAirframe, airspeed_m_s: float) -> float:
    """[s/rad] Of a steady pitch rate: for the angle of attack that bends the path, and against the damping."""
    wing, lift = airframe.wing, airframe.lift
    push_n = 0.5 * _DENSITY_KG_M3 * airspeed_m_s**2 * wing.area_m2
    alpha_s = airframe.body.mass_kg * airspeed_m_s / (push_n * lift.c_l_alpha)
    moment = -lift.c_m_alpha * alpha_s - lift.c_m_q * wing.chord_m / (2.0 * airspeed_m_s)
    return moment / (-lift.c_m_elevator * airframe.surfaces.elevator_max_rad)


def _ground(airframe: PlaneAirframe, ours: dict[str, float]) -> dict[str, float]:
    """Run, rotation, flare and roll."""
    gear = airframe.gear
    if gear is None:
        raise ValueError("ArduPilot's plane takes off from a runway here")
    return {
        "TKOFF_THR_MINACC": 0.0,  # it waits for no throw
        "GROUND_STEER_ALT": _STEERED_M,
        "STEER2SRV_P": _RUDDER_GAIN * 2.0 * (gear.nose_x_m + gear.main_x_m) / tan(gear.steering_max_rad),
        "LEVEL_ROLL_LIMIT": _CLIMB_BANK_DEG,
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
