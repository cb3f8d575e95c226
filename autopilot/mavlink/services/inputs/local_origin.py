"""The origin of the local frame: where the vehicle was switched on. It can be read, and it stays."""

from collections.abc import Mapping
from typing import Any

from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.codec import known_type

_GPS_GLOBAL_ORIGIN_ID = known_type("GPS_GLOBAL_ORIGIN").msg_id


class OriginService(Service):
    """Answers who wants to change the origin."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def messages(self) -> Mapping[str, Handler]:
        return {"SET_GPS_GLOBAL_ORIGIN": self.origin_received}

    def origin_received(self, sender: Sender, _: Any) -> None:
        """Sends the origin as it is: it is the position where the vehicle was switched on, and stays so."""
        telemetry = self._endpoint.telemetry
        payload = telemetry.builders[_GPS_GLOBAL_ORIGIN_ID](self._endpoint.vehicle.state)
        if payload is not None:
            self._endpoint.reply(sender, telemetry.types[_GPS_GLOBAL_ORIGIN_ID], payload)
