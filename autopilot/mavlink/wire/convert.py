"""Numbers as MAVLink carries them, from ours and back.

The only place where the quaternion order changes: we keep (x, y, z, w), MAVLink sends (w, x, y, z). Integer fields
saturate, and a number that is not finite becomes the given default, so that telemetry of a lost vehicle still flows.
"""

from collections.abc import Sequence
from math import isfinite, isnan, nan, pi

from common.attitude import Quat

INT16_MAX = 32_767
INT32_MAX = 2_147_483_647
UINT16_MAX = 65_535
UINT32_MAX = 4_294_967_295

# MAV_FRAME values by what they mean
GLOBAL_FRAMES = frozenset({0, 5})  # AMSL altitude
RELATIVE_FRAMES = frozenset({3, 6})  # altitude above home
TERRAIN_FRAMES = frozenset({10, 11})  # altitude above ground
LATLON_FRAMES = GLOBAL_FRAMES | RELATIVE_FRAMES | TERRAIN_FRAMES
MISSION_FRAME = 2  # not a position


def wxyz_from_quat(q_xyzw: Sequence[float]) -> Quat:
    """MAVLink's order from ours."""
    x, y, z, w = q_xyzw
    return (w, x, y, z)


def quat_from_wxyz(q_wxyz: Sequence[float]) -> Quat:
    """Our order from MAVLink's."""
    w, x, y, z = q_wxyz
    return (x, y, z, w)


def bounded_int(value: float, low: int, high: int, default: int = 0) -> int:
    """The nearest integer inside [low, high]; `default` if `value` is not finite."""
    if low <= value <= high:
        return round(value)
    if not isfinite(value):
        return default
    return low if value < low else high


def i16(value: float, default: int = 0) -> int:
    return bounded_int(value, -INT16_MAX - 1, INT16_MAX, default)


def u16(value: float, default: int = 0) -> int:
    return bounded_int(value, 0, UINT16_MAX, default)


def i32(value: float, default: int = 0) -> int:
    return bounded_int(value, -INT32_MAX - 1, INT32_MAX, default)


def u32(value: float, default: int = 0) -> int:
    return bounded_int(value, 0, UINT32_MAX, default)


def degrees_e7(angle_deg: float) -> int:
    """Degrees as 1e7 integers; INT32_MAX (unset) if not finite."""
    return bounded_int(angle_deg * 1.0e7, -INT32_MAX - 1, INT32_MAX, INT32_MAX)


def degrees_from_e7(angle_e7: int) -> float:
    """Degrees from 1e7 integers; NaN where the sender left it unset (INT32_MAX)."""
    return nan if angle_e7 == INT32_MAX else angle_e7 / 1.0e7


def heading_centideg(yaw_rad: float) -> int:
    """Heading in hundredths of a degree, 0..35999; 65535 if unknown."""
    return round(yaw_rad * (18_000.0 / pi)) % 36_000 if isfinite(yaw_rad) else UINT16_MAX


def whole(value: float, default: int) -> int:
    """The integer a float parameter of a command stands for; `default` if it is NaN, infinite or not whole."""
    return int(value) if isfinite(value) and value == int(value) else default


def is_position(lat_deg: float, lon_deg: float) -> bool:
    """Whether latitude and longitude exist on earth, or are both left free (NaN)."""
    if isnan(lat_deg) and isnan(lon_deg):
        return True
    return -90.0 <= lat_deg <= 90.0 and -180.0 <= lon_deg <= 180.0
