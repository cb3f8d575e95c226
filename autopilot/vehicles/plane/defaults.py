"""What the airframe file decides of a plane: parameters with its own default.

The loops of rates get the feed-forward of the steady rate, and a gain that makes the rate follow as fast as the servos
allow; trim is level flight at FW_AIRSPD_TRIM.
"""

from math import degrees

from autopilot.vehicles.plane.trim import level_flight, stall_speed_m_s
from common.airframes.plane import PlaneAirframe, Throw
from common.geodesy import GRAVITY_M_S2

_AUTOSTART = 2_100  # PX4's standard plane
_DENSITY_KG_M3 = 1.225  # ISO 2533
_MIN_OVER_STALL, _TRIM_OVER_STALL, _MAX_OVER_STALL = 1.2, 1.5, 2.2  # of airspeeds; guess
_TURN_SLOPE = 0.6  # tangent of the bank on a circle in a calm: guess
_PERIOD_M_S2 = 2.2  # trim over the period of the way back to a line: a large plane banks no faster; guess
_SLOPE_DEG = 5.0  # PX4's
_SLOPE_OF_GLIDE = 0.8  # of the angle at which it glides; guess: gusts from both sides can be answered
_ROLL_INTEGRAL_RAD_S = 1.5  # at which the integral takes over: sideslip and turns roll it; guess: below FW_R_TC's
_PITCH_BANDWIDTH_RAD_S = 12.0  # of pitch rate; guess: at FW_AIRSPD_MIN 50 deg of phase are left
_HOLD_OF_STIFFNESS = 1.0  # of the torque by which the integral holds a pitch rate; guess, with the one above
_THROW_FELT = 0.5  # part of a throw's acceleration that is one; guess
_THROW_LEAST_M_S2 = 11.0  # above gravity, which is felt along a nose that is held up
_THROWN_WITHIN_S = 30.0  # armed in the hand, else it is disarmed; guess
_ROLL_BANDWIDTH_RAD_S = 8.0  # of roll rate, in part by the wing's own damping; below the servos' 25: guess


def _round(value: float, digits: int = 3) -> float:
    return round(value, digits)


def _rate_gains(airframe: PlaneAirframe, trim_m_s: float) -> dict[str, float]:
    """Gains of roll and pitch rate, by the surfaces' torque, the wing's damping and its stability at trim.

    A tail holds the angle of attack: a pitch rate that lasts is the integral's, which has to work against that.
    """
    wing, lift, side, surfaces, body = (
        airframe.wing, airframe.lift, airframe.side, airframe.surfaces, airframe.body
    )  # fmt: skip
    push_n = 0.5 * _DENSITY_KG_M3 * trim_m_s**2 * wing.area_m2
    roll_power = push_n * wing.span_m * side.c_roll_aileron * surfaces.aileron_max_rad / body.inertia_xx_kg_m2
    roll_damping = -push_n * wing.span_m**2 * side.c_roll_p / (2.0 * trim_m_s) / body.inertia_xx_kg_m2
    pitch_power = -push_n * wing.chord_m * lift.c_m_elevator * surfaces.elevator_max_rad / body.inertia_yy_kg_m2
    pitch_stiffness = -push_n * wing.chord_m * lift.c_m_alpha / body.inertia_yy_kg_m2
    pitch_damping = -push_n * wing.chord_m**2 * lift.c_m_q / (2.0 * trim_m_s) / body.inertia_yy_kg_m2
    return {
        "FW_RR_FF": _round(roll_damping / roll_power),
        "FW_RR_P": _round(max(_ROLL_BANDWIDTH_RAD_S - roll_damping, 1.0) / roll_power),
        "FW_RR_I": _round(_ROLL_INTEGRAL_RAD_S * roll_damping / roll_power),
        "FW_PR_FF": _round(pitch_damping / pitch_power),
        "FW_PR_P": _round(max(_PITCH_BANDWIDTH_RAD_S - pitch_damping, 1.0) / pitch_power),
        "FW_PR_I": _round(_HOLD_OF_STIFFNESS * pitch_stiffness / pitch_power),
    }


def plane_defaults(airframe: PlaneAirframe) -> dict[str, int | float]:
    """Parameters whose default is the airframe's own."""
    battery, body = airframe.battery, airframe.body
    stall = stall_speed_m_s(airframe)
    trim = _round(_TRIM_OVER_STALL * stall, 1)
    level = level_flight(airframe, trim)
    return {
        "BAT1_N_CELLS": battery.cells,
        "BAT1_CAPACITY": battery.capacity_mah,
        "BAT1_V_CHARGED": battery.full_cell_v,
        "BAT1_V_EMPTY": battery.empty_cell_v,
        "EKF2_DRAG_CTRL": 0,  # the pitot tube tells of the air
        "EKF2_MIN_RNG": _round(airframe.standing_height_m),
        "EKF2_BCOEF_X": _round(body.mass_kg / body.drag_area_x_m2),
        "EKF2_BCOEF_Y": _round(body.mass_kg / body.drag_area_y_m2),
        "SYS_AUTOSTART": _AUTOSTART,
        "MIS_TAKEOFF_ALT": 30.0,
        "RTL_RETURN_ALT": 60.0,
        "RTL_DESCEND_ALT": 40.0,
        "COM_DISARM_LAND": 2.0,
        "FD_FAIL_R": 75.0,  # PX4's 60 is what a gust makes of FW_R_LIM; guess
        "NAV_ACC_RAD": 10.0,
        "NAV_LOITER_RAD": max(80.0, _round(trim**2 / (GRAVITY_M_S2 * _TURN_SLOPE), -1)),
        "NPFG_PERIOD": max(10.0, _round(trim / _PERIOD_M_S2)),
        "ASPD_FS_INNOV": _round(min(max(trim - stall, 3.0), 5.0), 1),  # PX4's 5, for what flies fast enough
        "FW_AIRSPD_STALL": _round(stall, 1),
        "FW_AIRSPD_MIN": _round(_MIN_OVER_STALL * stall, 1),
        "FW_AIRSPD_TRIM": trim,
        "FW_AIRSPD_MAX": _round(_MAX_OVER_STALL * stall, 1),
        "FW_PSP_OFF": _round(degrees(level.alpha_rad), 1),
        "HG_FW_PSP_LIFT": _round(degrees(_weight_coefficient(airframe, trim) / airframe.lift.c_l_alpha), 1),
        "TRIM_PITCH": _round(level.elevator),
        "FW_THR_TRIM": _round(level.throttle, 2),
        # PX4's 2.5, or less for a glider, which would float at that
        "FW_LND_FL_PMIN": max(-5.0, min(2.5, _round(degrees(level.alpha_rad), 1))),
        "FW_LND_ANG": _round(min(_SLOPE_DEG, _slope_least_deg(airframe, _MIN_OVER_STALL * stall)), 1),
        "FW_T_CLMB_MAX": _round(level.climb_max_m_s, 1),
        "FW_T_SINK_MIN": _round(level.sink_min_m_s, 2),
        **_rate_gains(airframe, trim),
        **({} if airframe.throw is None else _launch(airframe.throw)),
    }


def _weight_coefficient(airframe: PlaneAirframe, airspeed_m_s: float) -> float:
    """Coefficient of lift in level flight."""
    push_n = 0.5 * _DENSITY_KG_M3 * airspeed_m_s**2 * airframe.wing.area_m2
    return airframe.body.mass_kg * GRAVITY_M_S2 / push_n


def _slope_least_deg(airframe: PlaneAirframe, airspeed_m_s: float) -> float:
    """A glide slope that needs some throttle: a steeper one, without flaps, would make a good glider too fast."""
    return degrees(_SLOPE_OF_GLIDE * level_flight(airframe, airspeed_m_s).sink_min_m_s / airspeed_m_s)


def _launch(throw: Throw) -> dict[str, int | float]:
    return {
        "FW_LAUN_DETCN_ON": 1,
        "FW_LAUN_AC_THLD": max(_round(_THROW_FELT * throw.acceleration_m_s2, 1), _THROW_LEAST_M_S2),
        "FW_LAUN_MOT_DEL": throw.stroke_s,  # out of the hand
        "COM_DISARM_PRFLT": _THROWN_WITHIN_S,
    }
