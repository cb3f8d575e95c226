"""What the control law knows of a rover besides its parameters. Built once on the host; read-only in kernels."""

import warp as wp

from common.airframes.rover import RoverAirframe
from common.geodesy import GRAVITY_M_S2

wp.set_module_options({"enable_backward": False})

_MOTOR_GRIP = 0.45  # guess: of the driven tyres' grip on the level, that a motor may brake with without sliding them


@wp.struct
class RoverControlAirframe:
    is_skid: int
    rear_m: float  # rear axle behind the centre of gravity; 0 for skid steer, which turns about its middle
    motor_time_s: float  # of the speed behind the throttle: mass over the motor's force per missing speed
    motor_decel: float  # [m/s²] left to the motor before the brake helps
    brake_decel: float  # [m/s²] of the brake fully applied
    rolling_accel: float  # [m/s²] lost by rolling
    full_voltage_v: float


def motor_time_s(airframe: RoverAirframe) -> float:
    """Lag of the speed behind the throttle: mass, wheels included, over the motor's force per missing speed."""
    drive, wheels = airframe.drive, airframe.wheels
    mass_kg = airframe.body.mass_kg + 4.0 * wheels.inertia_kg_m2 / wheels.radius_m**2
    return mass_kg * drive.max_speed_m_s / drive.stall_force_n


def rover_control_airframe(airframe: RoverAirframe) -> RoverControlAirframe:
    """The row of an airframe file."""
    wheels, mass_kg = airframe.wheels, airframe.body.mass_kg
    driven = 1.0 if airframe.drive.driven == "all" else wheels.front_x_m / airframe.wheel_base_m
    row = RoverControlAirframe()
    row.is_skid = int(airframe.is_skid)
    row.rear_m = 0.0 if airframe.is_skid else wheels.rear_x_m
    row.motor_time_s = motor_time_s(airframe)
    row.motor_decel = _MOTOR_GRIP * airframe.tyres.friction * driven * GRAVITY_M_S2
    row.brake_decel = airframe.brake.max_force_n / mass_kg
    row.rolling_accel = wheels.rolling_resistance * GRAVITY_M_S2
    row.full_voltage_v = airframe.battery.cells * airframe.battery.full_cell_v
    return row
