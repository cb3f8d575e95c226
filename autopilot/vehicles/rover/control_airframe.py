"""What the control law knows of a rover besides its parameters. Built once on the host; read-only in kernels."""

import warp as wp

from common.airframes.rover import RoverAirframe

wp.set_module_options({"enable_backward": False})


@wp.struct
class RoverControlAirframe:
    is_skid: int
    motor_time_s: float  # of the speed behind the throttle: mass over the motor's force per missing speed
    brake_decel: float  # [m/s²] of the brake fully applied
    full_voltage_v: float


def rover_control_airframe(airframe: RoverAirframe) -> RoverControlAirframe:
    """The row of an airframe file."""
    drive, mass_kg = airframe.drive, airframe.body.mass_kg
    row = RoverControlAirframe()
    row.is_skid = int(airframe.is_skid)
    row.motor_time_s = mass_kg * drive.max_speed_m_s / drive.stall_force_n
    row.brake_decel = airframe.brake.max_force_n / mass_kg
    row.full_voltage_v = airframe.battery.cells * airframe.battery.full_cell_v
    return row
