"""What the airframe file decides of a rover: parameters with its own default."""

from math import degrees

from common.airframes.rover import RoverAirframe

_ACKERMANN, _DIFFERENTIAL = 5, 6  # CA_AIRFRAME
_AUTOSTART, _AUTOSTART_SKID = 51_000, 50_000  # PX4's generic rovers
_SKID_SLIP = 1.6  # of our skid-steer airframe on firm ground, measured: its wheels scrub


def rover_defaults(airframe: RoverAirframe) -> dict[str, int | float]:
    """Parameters whose default is the airframe's own."""
    battery, body = airframe.battery, airframe.body
    return {
        "BAT1_N_CELLS": battery.cells,
        "BAT1_CAPACITY": battery.capacity_mah,
        "BAT1_V_CHARGED": battery.full_cell_v,
        "BAT1_V_EMPTY": battery.empty_cell_v,
        "EKF2_WHL_POS_X": 0.0 if airframe.is_skid else -airframe.wheels.rear_x_m,
        "EKF2_WHL_TRACK": airframe.wheels.track_m * (_SKID_SLIP if airframe.is_skid else 1.0),
        "EKF2_DRAG_CTRL": 0,  # what slopes and tyres do to the accelerometer is no wind
        "EKF2_MIN_RNG": airframe.wheels.hub_z_m + airframe.wheels.radius_m,
        "EKF2_BCOEF_X": body.mass_kg / body.drag_area_x_m2,
        "EKF2_BCOEF_Y": body.mass_kg / body.drag_area_y_m2,
        "SYS_AUTOSTART": _AUTOSTART_SKID if airframe.is_skid else _AUTOSTART,
        "NAV_ACC_RAD": 0.5,  # PX4's rovers
        "RA_ACC_RAD_GAIN": 1.25,  # the front wheels take their time: at 1 it runs 0.5 m wide of a corner of 90 deg
        "CA_AIRFRAME": _DIFFERENTIAL if airframe.is_skid else _ACKERMANN,
        "CA_R_REV": 3 if airframe.is_skid else 1,
        "RO_MAX_THR_SPEED": airframe.drive.max_speed_m_s,
        "RO_SPEED_LIM": 0.625 * airframe.drive.max_speed_m_s,
        "RO_YAW_RATE_CORR": _SKID_SLIP if airframe.is_skid else 1.0,
        "RA_WHEEL_BASE": airframe.wheel_base_m,
        "RA_MAX_STR_ANG": airframe.steering.max_angle_rad,
        "RA_STR_RATE_LIM": degrees(airframe.steering.rate_rad_s),
        "RD_WHEEL_TRACK": airframe.wheels.track_m,
    }
