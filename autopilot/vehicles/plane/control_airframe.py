"""What the control law knows of a plane besides its parameters. Built once on the host; read-only in kernels."""

import warp as wp

from common.airframe import Airframe

wp.set_module_options({"enable_backward": False})


@wp.struct
class PlaneControlAirframe:
    full_voltage_v: float


def plane_control_airframe(airframe: Airframe) -> PlaneControlAirframe:
    """The row of an airframe file."""
    row = PlaneControlAirframe()
    row.full_voltage_v = airframe.battery.cells * airframe.battery.full_cell_v
    return row
