"""ArduPilot's JSON interface on the wire: its servo packets, and the states that answer them.

Facts: libraries/SITL/SIM_JSON.{h,cpp} and libraries/SITL/examples/JSON/readme.md of ArduPilot. Its parser looks for
keys by `strstr` and reads numbers by `sscanf`: a compact object with fixed order, one per datagram, between newlines.
"""

from math import isfinite, sqrt
from struct import Struct
from typing import Any, NamedTuple

from sim.boards.outside import PeerError
from sim.bodies.plane_air import SEA_LEVEL_DENSITY_KG_M3
from sim.bodies.rigid_body import density_ratio_at
from sim.sensors.range import MAX_DISTANCE_M

_SERVO_16, _MAGIC_16 = Struct("<HHI16H"), 18458
_SERVO_32, _MAGIC_32 = Struct("<HHI32H"), 29569  # SERVO_32_ENABLE
_FORMAT = (
    '\n{"timestamp":%d.%09d,'
    '"imu":{"gyro":[%.9g,%.9g,%.9g],"accel_body":[%.9g,%.9g,%.9g]},'
    '"position":[%.9g,%.9g,%.9g],'
    '"quaternion":[%.9g,%.9g,%.9g,%.9g],'
    '"velocity":[%.9g,%.9g,%.9g]%s}\n'
)
_NS_PER_S = 1_000_000_000


class ServoPacket(NamedTuple):
    """What the autopilot wants of its servos."""

    rate_hz: int
    """A wish for the length of a step; ours is fixed."""
    frame_count: int
    """Of frames: one more each time our answer has been read; the same again: it was lost; less: it has restarted."""
    pulses_us: tuple[int, ...]
    """16 or 32 channels; 0: no pulse."""


def servo_packet(data: bytes) -> ServoPacket | None:
    """The packet in a datagram; None: it is none."""
    for layout, magic in ((_SERVO_16, _MAGIC_16), (_SERVO_32, _MAGIC_32)):
        if len(data) == layout.size:
            found, rate_hz, count, *pulses_us = layout.unpack(data)
            if found == magic:
                return ServoPacket(rate_hz, count, tuple(pulses_us))
    return None


def state_text(
    time_ns: int,
    gyro_frd: Any,
    accel_frd: Any,
    truth: Any,
    extras: str = "",
    start_ne_m: tuple[float, float] = (0.0, 0.0),
) -> bytes:
    """The answer to a servo packet.

    Args:
        time_ns: of the physics [ns], from the autopilot's start on, never back.
        gyro_frd: [rad/s] what the IMU felt since the last one.
        accel_frd: [m/s²] likewise, specific force.
        truth: a row of `Truth`.
        extras: further keys as text that begins with a comma, or nothing.
        start_ne_m: where its home is [m]: positions count from there.

    Raises:
        PeerError: a number is none; ArduPilot would take it, and its estimator would never recover.
    """
    x, y, z, w = truth["q_ned_from_frd"].tolist()
    (north, east, down), vel_ned = truth["pos_ned"].tolist(), truth["vel_ned"].tolist()
    pos_ned = (north - start_ne_m[0], east - start_ne_m[1], down)
    numbers = (*gyro_frd, *accel_frd, *pos_ned, w, x, y, z, *vel_ned)
    if not isfinite(sum(numbers)):
        raise PeerError("the body's state is not a number")
    return (_FORMAT % (*divmod(time_ns, _NS_PER_S), *numbers, extras)).encode()


def range_key(sample: Any) -> str:
    """Of the range finder that looks down, as `extras` of `state_text`; beyond its reach where it sees nothing."""
    distance_m = float(sample["distance_m"]) if sample["is_valid"] else MAX_DISTANCE_M + 1.0
    return f',"rng_1":{distance_m:.4g}'


def airspeed_key(sample: Any, alt_amsl_m: float) -> str:
    """Of the pitot tube, as `extras` of `state_text`: the true airspeed, from which SITL makes the indicated one.

    Nothing without a tube: it takes its speed over the ground then.
    """
    if not sample["time_us"]:
        return ""
    density_kg_m3 = SEA_LEVEL_DENSITY_KG_M3 * density_ratio_at(alt_amsl_m)
    airspeed_m_s = sqrt(2.0 * max(float(sample["pressure_pa"]), 0.0) / density_kg_m3)
    return f',"airspeed":{airspeed_m_s:.5g}'
