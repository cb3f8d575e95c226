"""ESC telemetry: how fast each motor turns, as its speed controller counts it. Read by the host, when it asks.

Errors: electrical revolutions are reported in whole hundreds per minute (bidirectional DShot and KISS telemetry). Left
out: delay and loss of the telemetry line, current and temperature.
"""

import struct
from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np

from common.kernels import MAX_MOTORS

POLE_PAIRS = 7  # of the usual 14-pole outrunner
_STEP_RAD_S = 100.0 / POLE_PAIRS * 2.0 * pi / 60.0


def esc_reader(truths: np.ndarray[Any, Any], i_vehicle: int) -> Callable[[], list[float]]:
    """A function that returns the reported speeds [rad/s] of a vehicle's motors.

    Args:
        truths: live structured view of the Truth rows.
        i_vehicle: which row.
    """
    fields = truths.dtype.fields
    if fields is None:
        raise TypeError("not Truth rows")
    offset = i_vehicle * truths.dtype.itemsize + fields["motor_speed"][1]
    unpack = struct.Struct(f"<{MAX_MOTORS}f").unpack_from
    buffer = truths.view(np.uint8).data
    return lambda: [round(speed / _STEP_RAD_S) * _STEP_RAD_S for speed in unpack(buffer, offset)]
