"""Our frames as Foxglove's, which are right-handed with z up.

| frame | axes | origin |
|---|---|---|
| `map` | x east, y north, z up (ENU) | the vehicle's home; our `ned` |
| `vehicle` | x ahead, y left, z up (FLU) | the vehicle as it truly is; our `frd` |
| `vehicle_estimate` | the same | the vehicle as it believes to be |
| `vehicle_level` | x ahead, y left, z up, level | the vehicle as it believes to be; our `hfrd` |
| `camera` | x right, y down, z ahead | the lens; our `rdf`, which is Foxglove's frame of a camera as well |

A point: (north, east, down) is (east, north, -down), (ahead, right, down) is (ahead, -right, -down). A rotation is
turned on both sides: `q_enu_from_flu = q_enu_from_ned * q_ned_from_frd * q_frd_from_flu`, the first half a turn
about the horizontal axis to the north-east and the last is half a turn about x. Quaternions are (x, y, z, w) on both
sides.
"""

from collections.abc import Sequence
from math import sqrt
from typing import Any

import numpy as np

from common.attitude import Quat

MAP, VEHICLE, ESTIMATE, LEVEL, CAMERA = "map", "vehicle", "vehicle_estimate", "vehicle_level", "camera"
Vector = tuple[float, float, float]
_HALF = sqrt(0.5)


def enu_from_ned(v_ned: Sequence[float]) -> Vector:
    """The vector in ENU."""
    north, east, down = v_ned
    return float(east), float(north), -float(down)


def flu_from_frd(v_frd: Sequence[float]) -> Vector:
    """The vector in FLU."""
    ahead, right, down = v_frd
    return float(ahead), -float(right), -float(down)


def enu_points(points_ned: Any) -> Any:
    """Points in ENU, shape (n, 3)."""
    return np.asarray(points_ned)[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0], np.float32)


def flu_points(points_frd: Any) -> Any:
    """Points in FLU, shape (n, 3)."""
    return np.asarray(points_frd) * np.array([1.0, -1.0, -1.0], np.float32)


def q_enu_from_flu(q_ned_from_frd: Sequence[float]) -> Quat:
    """The attitude between Foxglove's frames: the product in the module's text, multiplied out."""
    x, y, z, w = (float(part) for part in q_ned_from_frd)
    return _HALF * (x + y), _HALF * (x - y), _HALF * (w - z), _HALF * (w + z)


def q_flu_from_rdf(q_frd_from_rdf: Sequence[float]) -> Quat:
    """How a lens is mounted: half a turn about x before the mount."""
    x, y, z, w = (float(part) for part in q_frd_from_rdf)
    return w, -z, y, -x
