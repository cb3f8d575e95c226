"""What the airframe file decides of a multirotor: parameters with its own default, and the thrust that carries it."""

from math import sqrt

from common.airframes.multirotor import MultirotorAirframe
from common.geodesy import GRAVITY_M_S2

_AUTOSTART = {4: 4001, 6: 6001, 8: 8001}  # PX4's generic airframes by their number of rotors


def hover_thrust(airframe: MultirotorAirframe) -> float:
    """Share [0..1] of the maximum collective thrust that carries the vehicle, at full battery and sea level."""
    model = airframe.rotor_model
    thrust_max_n = len(airframe.rotors) * model.thrust_n_s2 * model.max_speed_rad_s**2
    return airframe.body.mass_kg * GRAVITY_M_S2 / thrust_max_n


def airframe_defaults(airframe: MultirotorAirframe) -> dict[str, int | float]:
    """Parameters whose default is the airframe's own: battery, landing gear, and drag for the wind estimate."""
    body, rotor, battery = airframe.body, airframe.rotor_model, airframe.battery
    count = len(airframe.rotors)
    hover_speed_rad_s = sqrt(body.mass_kg * GRAVITY_M_S2 / (count * rotor.thrust_n_s2))
    return {
        "SYS_AUTOSTART": _AUTOSTART.get(count, 4001),
        "BAT1_N_CELLS": battery.cells,
        "BAT1_CAPACITY": battery.capacity_mah,
        "BAT1_V_CHARGED": battery.full_cell_v,
        "BAT1_V_EMPTY": battery.empty_cell_v,
        "EKF2_MIN_RNG": airframe.contact.leg_z_m,
        "EKF2_MCOEF": count * rotor.drag_n_s2_m * hover_speed_rad_s / body.mass_kg,
        "MPC_THR_HOVER": body.mass_kg * GRAVITY_M_S2 / (count * rotor.thrust_n_s2 * rotor.max_speed_rad_s**2),
        "EKF2_BCOEF_X": body.mass_kg / body.drag_area_x_m2,
        "EKF2_BCOEF_Y": body.mass_kg / body.drag_area_y_m2,
    }
