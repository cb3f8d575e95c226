"""What keeps a link in touch: heartbeats of clients, pings, their clocks, rates of the oldest stations; texts to log.

Texts of the vehicle's other components belong into its log, as PX4 has them: what a companion did, and why.
"""

from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import AUTOPILOT_COMPONENT, CLIENTS_MAX, Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.services.identity import banner
from autopilot.mavlink.wire.codec import known_type

_PING = known_type("PING")
_TIMESYNC = known_type("TIMESYNC")
_TEXT_PERIOD_US, _TEXT_BURST_US = 200_000, 10_000_000  # of texts that are logged: five a second, fifty at a time

# What these say with a heartbeat is no client's first word: they want no greeting.
_DEVICES = {
    mavlink.MAV_TYPE_GIMBAL, mavlink.MAV_TYPE_ADSB, mavlink.MAV_TYPE_CAMERA, mavlink.MAV_TYPE_CHARGING_STATION,
    mavlink.MAV_TYPE_FLARM, mavlink.MAV_TYPE_SERVO, mavlink.MAV_TYPE_ODID, mavlink.MAV_TYPE_BATTERY,
    mavlink.MAV_TYPE_PARACHUTE, mavlink.MAV_TYPE_LOG, mavlink.MAV_TYPE_OSD, mavlink.MAV_TYPE_IMU,
    mavlink.MAV_TYPE_GPS, mavlink.MAV_TYPE_WINCH,
}  # fmt: skip


class LinkService(Service):
    """Greets clients and answers what they measure the link by."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._texts_due_us = 0  # by when those that were logged would be, if they came evenly

    def messages(self) -> Mapping[str, Handler]:
        return {
            "HEARTBEAT": self._heartbeat_received,
            "PING": self._ping_received,
            "TIMESYNC": self._timesync_received,
            "REQUEST_DATA_STREAM": self._data_stream_requested,
            "STATUSTEXT": self._text_received,
        }

    def _heartbeat_received(self, sender: Sender, fields: Any) -> None:
        """Greets a client that is new on its channel; of a ground station: keeps the link alive (NAV_DLL_ACT)."""
        if fields.type == mavlink.MAV_TYPE_GCS and not sender.channel.is_mute:
            self._endpoint.vehicle.station.heard(self._endpoint.time_us)
        client, clients = (sender.sysid, sender.compid), sender.channel.clients
        is_client = fields.type not in _DEVICES and sender.compid != AUTOPILOT_COMPONENT
        if is_client and client not in clients and len(clients) < CLIENTS_MAX:
            clients.add(client)
            self._endpoint.text(Severity.INFO, banner(self._endpoint.dialect), to=sender)

    def _ping_received(self, sender: Sender, fields: Any) -> None:
        """Answers a request; a message with a target is itself an answer."""
        if fields.target_system == 0 and fields.target_component == 0:
            payload = _PING.pack(fields.time_usec, fields.seq, sender.sysid, sender.compid)
            self._endpoint.reply(sender, _PING, payload)

    def _timesync_received(self, sender: Sender, fields: Any) -> None:
        """Answers a request with the time since boot; tc1 other than 0 is itself an answer."""
        if fields.tc1 == 0:
            time_us = self._endpoint.clock.shown_us(self._endpoint.time_us)
            self._endpoint.reply(sender, _TIMESYNC, _TIMESYNC.pack(max(time_us, 1) * 1000, fields.ts1))

    def _text_received(self, sender: Sender, fields: Any) -> None:
        """Logs what another component of the vehicle says, piece by piece; what comes too often is left out."""
        endpoint = self._endpoint
        log, is_ours = endpoint.vehicle.host.log_stream, sender.sysid == endpoint.sysid
        if log is None or not is_ours or self._texts_due_us > endpoint.time_us + _TEXT_BURST_US:
            return
        self._texts_due_us = max(self._texts_due_us, endpoint.time_us) + _TEXT_PERIOD_US
        log.statustext(Severity(min(fields.severity, Severity.DEBUG)), fields.text)

    def _data_stream_requested(self, sender: Sender, fields: Any) -> None:
        """Sets the rate of a group of messages on this link (the old way)."""
        rate_hz = float(fields.req_message_rate) if fields.start_stop else 0.0
        sender.channel.schedule.set_group(fields.req_stream_id, rate_hz)
