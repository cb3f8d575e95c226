"""Who the vehicle is: versions, capabilities and the banner.

The dialect's autopilot is what we are compatible with, not what we are: the project's name is in the banner, in the
custom version and in the hardware id.
"""

from functools import cache
from importlib.metadata import PackageNotFoundError, version

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.wire.codec import known_type

PROJECT = "Honeyguide"

# What is really served.
CAPABILITIES = (
    mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
)

_AUTOPILOT_VERSION = known_type("AUTOPILOT_VERSION")


@cache
def project_version() -> str:
    """The version of the installed distribution, 0.0.0 in a checkout that is not installed.

    It is read once: looking it up takes a hundred times as long as answering a request for it.
    """
    try:
        return version("honeyguide")
    except PackageNotFoundError:
        return "0.0.0"


def banner(dialect: Dialect) -> str:
    """The line that greets a ground station."""
    return f"{PROJECT} {project_version()} ({dialect.name} compatible)"


def autopilot_version(dialect: Dialect, sysid: int) -> bytes:
    """Payload of AUTOPILOT_VERSION; the uid differs from vehicle to vehicle as a board's serial number would."""
    uid2 = PROJECT.encode("ascii") + bytes([sysid])
    return _AUTOPILOT_VERSION.pack(
        capabilities=CAPABILITIES | dialect.capabilities,
        flight_sw_version=dialect.flight_sw_version,
        middleware_sw_version=dialect.flight_sw_version,
        flight_custom_version=tuple(dialect.custom_version(PROJECT, project_version())),
        uid=int.from_bytes(uid2[-8:], "big"),
        uid2=tuple(uid2.ljust(18, b"\0")),
    )
