"""The log protocol: which logs there are, and their bytes, for several clients at once.

In: LOG_REQUEST_* and LOG_ERASE. Out: LOG_ENTRY and LOG_DATA, some per frame. A number means the same log until the
client asks for the list again; logs that come new get numbers of their own at the end.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.platform import LogFile
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.codec import known_type

BIN_BYTES = 90
BINS_PER_FRAME = 40  # of all transfers together: 180 KB/s
ENTRIES_PER_FRAME = 20
CLIENTS_MAX = 16

_LOG_ENTRY = known_type("LOG_ENTRY")
_LOG_DATA = known_type("LOG_DATA")


@dataclass(slots=True)
class _Transfer:
    """What a client still gets of a log."""

    log_id: int
    name: str
    offset: int
    end: int  # offset behind the last byte asked for


class LogTransferService(Service):
    """Lists logs and sends them."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        is_ardupilot = endpoint.dialect.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        self._first_id = 1 if is_ardupilot else 0  # clients tell the two apart by the smallest number
        self._listed: dict[Sender, Sequence[LogFile]] = {}
        self._lists: dict[Sender, Iterator[bytes]] = {}
        self._transfers: dict[Sender, _Transfer] = {}

    def messages(self) -> Mapping[str, Handler]:
        return {
            "LOG_REQUEST_LIST": self.list_requested,
            "LOG_REQUEST_DATA": self.data_requested,
            "LOG_REQUEST_END": self.end_requested,
            "LOG_ERASE": self.erase_requested,
        }

    def list_requested(self, sender: Sender, fields: Any) -> None:
        """Sends the entries from start to end; one with num_logs 0 if there are no logs."""
        logs = self._renew(sender)
        self._lists[sender] = self._entries(logs, fields.start, fields.end)

    def _renew(self, sender: Sender) -> Sequence[LogFile]:
        """Takes the list from which this client's numbers are; the client heard first gives way if there are many."""
        if sender not in self._listed and len(self._listed) >= CLIENTS_MAX:
            self._forget(next(iter(self._listed)))
        stored = self._endpoint.vehicle.host.logs
        logs = self._listed[sender] = () if stored is None else stored.logs()
        return logs

    def _entries(self, logs: Sequence[LogFile], start: int, end: int) -> Iterator[bytes]:
        last = self._first_id + len(logs) - 1
        if not logs:
            yield _LOG_ENTRY.pack(0, 0, 0, 0, 0)
        for log_id, log in enumerate(logs, self._first_id):
            if start <= log_id <= end:
                yield _LOG_ENTRY.pack(log_id, len(logs), last, log.time_s, log.size)

    def data_requested(self, sender: Sender, fields: Any) -> None:
        """Sends count bytes of a log from ofs on, in pieces of 90; a shorter piece, also of 0, is its end."""
        logs = self._listed[sender] if sender in self._listed else self._renew(sender)
        i = fields.id - self._first_id
        if not 0 <= i < len(logs):
            self._endpoint.reply(sender, _LOG_DATA, _LOG_DATA.pack(fields.id, fields.ofs, 0))
            return
        self._transfers[sender] = _Transfer(fields.id, logs[i].name, fields.ofs, fields.ofs + fields.count)

    def end_requested(self, sender: Sender, _: Any) -> None:
        """Stops what is being sent to this client."""
        self._forget(sender)

    def erase_requested(self, sender: Sender, _: Any) -> None:
        """Removes all logs but the one being written."""
        stored = self._endpoint.vehicle.host.logs
        count = 0 if stored is None else stored.erase()
        self._forget(sender)
        self._endpoint.text(Severity.NOTICE, f"{count} logs erased" if count != 1 else "1 log erased")

    def _forget(self, sender: Sender) -> None:
        self._listed.pop(sender, None)
        self._lists.pop(sender, None)
        self._transfers.pop(sender, None)

    def frame(self) -> None:
        """Sends the next entries and bins."""
        if not self._lists and not self._transfers:
            return
        for sender, entries in list(self._lists.items()):
            for _ in range(ENTRIES_PER_FRAME):
                payload = next(entries, None)
                if payload is None:
                    del self._lists[sender]
                    break
                self._endpoint.reply(sender, _LOG_ENTRY, payload)
        for sender, transfer in list(self._transfers.items()):
            self._send_bins(sender, transfer, max(BINS_PER_FRAME // len(self._transfers), 1))

    def _send_bins(self, sender: Sender, transfer: _Transfer, count: int) -> None:
        stored = self._endpoint.vehicle.host.logs
        wanted = min(count * BIN_BYTES, transfer.end - transfer.offset)
        data = b"" if stored is None else stored.read(transfer.name, transfer.offset, wanted)
        pieces = [data[at : at + BIN_BYTES] for at in range(0, len(data), BIN_BYTES)]
        is_end = len(data) < wanted
        if is_end and len(data) % BIN_BYTES == 0:
            pieces.append(b"")
        for piece in pieces:
            content = tuple(piece.ljust(BIN_BYTES, b"\0"))
            payload = _LOG_DATA.pack(transfer.log_id, transfer.offset, len(piece), content)
            self._endpoint.reply(sender, _LOG_DATA, payload)
            transfer.offset += len(piece)
        if is_end or transfer.offset >= transfer.end:
            del self._transfers[sender]
