"""SETUP_SIGNING: a client on this machine gives the vehicle its key, or takes it away."""

from collections.abc import Mapping
from typing import Any

from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service


class SigningService(Service):
    """Sets the key; on a link from elsewhere it could be overheard, and set by anybody."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def messages(self) -> Mapping[str, Handler]:
        return {"SETUP_SIGNING": self.setup_received}

    def setup_received(self, sender: Sender, fields: Any) -> None:
        """Takes the key for MAVLink 2 signing, or turns it off if the key is zero; only over a link of this machine."""
        if not sender.channel.link.is_trusted:
            self._endpoint.text_once(Severity.WARNING, "Signing: keys are taken from this machine only")
            return
        self._endpoint.set_signing_key(bytes(fields.secret_key), fields.initial_timestamp)
        self._endpoint.text(Severity.INFO, "Signing: on" if self._endpoint.signer.has_key else "Signing: off")
