"""Level flight of an airframe, from its coefficients: what the law's defaults are made from.

Small angles, thrust along the path, at the density of sea level, where indicated airspeeds are true ones.
"""

from dataclasses import dataclass
from math import pi, sqrt

from common.airframes.plane import PlaneAirframe
from common.geodesy import GRAVITY_M_S2

_DENSITY_KG_M3 = 1.225  # ISO 2533


@dataclass(frozen=True, slots=True)
class LevelFlight:
    """At one airspeed."""

    alpha_rad: float
    elevator: float  # [-1..1] command, positive pitches up
    throttle: float  # [0..1] with a full battery
    climb_max_m_s: float  # at full throttle
    sink_min_m_s: float  # with a propeller that windmills


def stall_speed_m_s(airframe: PlaneAirframe) -> float:
    """The slowest level flight: the elevator can do no more, or the flow begins to separate."""
    wing = airframe.wing
    low, high = 1.0, 100.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        level = level_flight(airframe, middle)
        is_flown = level.elevator < 1.0 and level.alpha_rad < wing.stall_angle_rad - 2.0 / wing.stall_sharpness
        low, high = (low, middle) if is_flown else (middle, high)
    return high


def level_flight(airframe: PlaneAirframe, airspeed_m_s: float) -> LevelFlight:
    """Where lift is weight and thrust is drag."""
    lift, push_n = airframe.lift, _push_n(airframe, airspeed_m_s)
    c_l = _weight_n(airframe) / push_n
    # Lift and pitch, both linear in angle of attack and elevator.
    determinant = lift.c_l_alpha * lift.c_m_elevator - lift.c_l_elevator * lift.c_m_alpha
    alpha = ((c_l - lift.c_l_0) * lift.c_m_elevator + lift.c_l_elevator * lift.c_m_0) / determinant
    deflection = (-lift.c_l_alpha * lift.c_m_0 - lift.c_m_alpha * (c_l - lift.c_l_0)) / determinant
    attached = lift.c_l_0 + lift.c_l_alpha * alpha
    induced = attached**2 / (pi * airframe.wing.efficiency * airframe.aspect_ratio)
    drag_n = push_n * (lift.c_d_p + induced + lift.c_d_elevator * abs(deflection))
    full_n = thrust_n(airframe, 1.0, airspeed_m_s)
    return LevelFlight(
        alpha,
        -deflection / airframe.surfaces.elevator_max_rad,
        _throttle_for(airframe, drag_n, airspeed_m_s),
        (full_n - drag_n) * airspeed_m_s / _weight_n(airframe),
        (drag_n - min(thrust_n(airframe, 0.0, airspeed_m_s), 0.0)) * airspeed_m_s / _weight_n(airframe),
    )


def thrust_n(airframe: PlaneAirframe, throttle: float, airspeed_m_s: float) -> float:
    """Of the propeller with a full battery, once its speed has settled."""
    data, d, density = airframe.propeller, airframe.propeller.diameter_m, _DENSITY_KG_M3
    voltage_v = throttle * airframe.battery.cells * airframe.battery.full_cell_v
    k = data.motor_constant_v_s
    square = data.c_q_0 * density * d**5 / (4.0 * pi**2)
    linear = data.c_q_1 * density * d**4 * airspeed_m_s / (2.0 * pi) + k * k / data.motor_resistance_ohm
    constant = data.c_q_2 * density * d**3 * airspeed_m_s**2
    constant += k * (data.idle_current_a - voltage_v / data.motor_resistance_ohm)
    driven = (sqrt(max(linear**2 - 4.0 * square * constant, 0.0)) - linear) / (2.0 * square)
    free = 2.0 * pi * airspeed_m_s / (d * data.free_advance)
    n, through = max(driven, free) / (2.0 * pi), airspeed_m_s / d
    return density * d**4 * (data.c_t_2 * through**2 + data.c_t_1 * n * through + data.c_t_0 * n**2)


def _throttle_for(airframe: PlaneAirframe, thrust: float, airspeed_m_s: float) -> float:
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if thrust_n(airframe, middle, airspeed_m_s) < thrust else (low, middle)
    return 0.5 * (low + high)


def _push_n(airframe: PlaneAirframe, airspeed_m_s: float) -> float:
    return 0.5 * _DENSITY_KG_M3 * airspeed_m_s**2 * airframe.wing.area_m2


def _weight_n(airframe: PlaneAirframe) -> float:
    return airframe.body.mass_kg * GRAVITY_M_S2
