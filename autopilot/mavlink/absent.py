"""Services this vehicle does not have, and the answer that tells a client so at once."""

from collections.abc import Mapping
from typing import Any

from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.codec import known_type
from autopilot.mavlink.service import Handler, Service

_LOG_ENTRY = known_type("LOG_ENTRY")
_LOG_DATA = known_type("LOG_DATA")
_GPS_GLOBAL_ORIGIN_ID = known_type("GPS_GLOBAL_ORIGIN").msg_id


class AbsentServices(Service):
    """Answers for log download and a change of the local origin."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def messages(self) -> Mapping[str, Handler]:
        return {
            "LOG_REQUEST_LIST": self.logs_requested,
            "LOG_REQUEST_DATA": self.log_data_requested,
            "SET_GPS_GLOBAL_ORIGIN": self.origin_received,
        }

    def logs_requested(self, sender: Sender, _: Any) -> None:
        """An empty list."""
        self._endpoint.reply(sender, _LOG_ENTRY, _LOG_ENTRY.pack(0, 0, 0, 0, 0))

    def log_data_requested(self, sender: Sender, fields: Any) -> None:
        """No data, which ends the transfer."""
        self._endpoint.reply(sender, _LOG_DATA, _LOG_DATA.pack(fields.id, fields.ofs, 0))

    def origin_received(self, sender: Sender, _: Any) -> None:
        """The origin as it is: it is the place where the vehicle was switched on, and stays so."""
        telemetry = self._endpoint.telemetry
        payload = telemetry.builders[_GPS_GLOBAL_ORIGIN_ID](self._endpoint.vehicle.state)
        if payload is not None:
            self._endpoint.reply(sender, telemetry.types[_GPS_GLOBAL_ORIGIN_ID], payload)
