"""Services this vehicle does not have, and the answer that tells a client so at once."""

from collections.abc import Mapping
from typing import Any

from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.codec import known_type
from autopilot.mavlink.service import Handler, Service

FTP_NAK = 129  # opcode
FTP_UNKNOWN_COMMAND = 7
FTP_FILE_NOT_FOUND = 10
FTP_OPEN_FILE_READ_ONLY = 4  # opcodes of requests
FTP_BURST_READ_FILE = 15
FTP_PAYLOAD_LENGTH = 251

_FILE_TRANSFER_PROTOCOL = known_type("FILE_TRANSFER_PROTOCOL")
_LOG_ENTRY = known_type("LOG_ENTRY")
_LOG_DATA = known_type("LOG_DATA")
_GPS_GLOBAL_ORIGIN_ID = known_type("GPS_GLOBAL_ORIGIN").msg_id


class AbsentServices(Service):
    """Answers for file transfer, log download and a change of the local origin."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def messages(self) -> Mapping[str, Handler]:
        return {
            "FILE_TRANSFER_PROTOCOL": self.file_requested,
            "LOG_REQUEST_LIST": self.logs_requested,
            "LOG_REQUEST_DATA": self.log_data_requested,
            "SET_GPS_GLOBAL_ORIGIN": self.origin_received,
        }

    def file_requested(self, sender: Sender, fields: Any) -> None:
        """A refusal: there are no files."""
        request = bytes(fields.payload)
        seq = int.from_bytes(request[0:2], "little") + 1 & 0xFFFF
        opcode = request[3]
        if opcode >= FTP_NAK - 1:  # a reply, not a request
            return
        is_file = opcode in (FTP_OPEN_FILE_READ_ONLY, FTP_BURST_READ_FILE)
        error = FTP_FILE_NOT_FOUND if is_file else FTP_UNKNOWN_COMMAND
        header = seq.to_bytes(2, "little") + bytes([request[2], FTP_NAK, 1, opcode, 0, 0, 0, 0, 0, 0, error])
        payload = tuple(header.ljust(FTP_PAYLOAD_LENGTH, b"\0"))
        packed = _FILE_TRANSFER_PROTOCOL.pack(0, sender.sysid, sender.compid, payload)
        self._endpoint.reply(sender, _FILE_TRANSFER_PROTOCOL, packed)

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
