"""A base station beside home, whose corrections a radio on board hands the vehicle: its receiver is exact then (RTK).

In: the time. Out: GPS_RTCM_DATA once a second, with an RTCM 3 message that says where the station is (1005).
"""

from autopilot.mavlink.client_end import ClientEnd
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.rtcm import FRAGMENT_LENGTH, crc24q

PERIOD_US = 1_000_000
COMPONENT = 68  # MAV_COMP_ID_TELEMETRY_RADIO
_STATION_PLACE = 1005  # RTCM's number of the message
_LENGTH = 19  # of its contents
_FRAME_START = 0xD3


class BaseStation:
    """The base station of one flight.

    Args:
        system_id: of the vehicle.
    """

    def __init__(self, system_id: int) -> None:
        self.vehicle_end, self._link = memory_pair(LinkRole.ONBOARD)
        self._client = ClientEnd(self._link, system_id, COMPONENT, vehicle_id=system_id)
        self._due_us = 0

    def frame(self, time_us: int) -> None:
        """Sends what is due; before the flight controller's frame."""
        self._link.receive()
        self._client.keep_alive(time_us)
        if time_us >= self._due_us:
            self._due_us = time_us + PERIOD_US
            message = _message()
            padded = message.ljust(FRAGMENT_LENGTH, b"\0")
            self._client.send("GPS_RTCM_DATA", flags=0, len=len(message), data=tuple(padded))


def _message() -> bytes:
    """Where the station is: our receiver looks at nothing but that it is whole."""
    contents = (_STATION_PLACE << 4).to_bytes(2, "big").ljust(_LENGTH, b"\0")
    frame = bytes([_FRAME_START]) + len(contents).to_bytes(2, "big") + contents
    return frame + crc24q(frame).to_bytes(3, "big")
