"""The mission protocol: upload, download and clear of three lists (mission, fence, rally points), current item.

In: the messages of any number of clients. Out: counts, items, requests, acknowledgements. An upload is staged and
handed to the vehicle as a whole, so that a failed one leaves the old list as it was. The lists know nothing of each
other: one client may upload a fence while another uploads a mission.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import SetCurrentItem
from autopilot.interface.item_lists import ItemRefusal, ListKind, MissionItem, item_name
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.services.actions.goto_commands import GotoService
from autopilot.mavlink.services.home_item import home_item, with_home, without_home
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.item_messages import element_out_of_range, item_from_fields, scaled_position

RETRY_US = 1_500_000  # the MAVLink mission protocol's default time-out
RETRIES_MAX = 5
DOWNLOADS_MAX = 16  # downloads that are remembered
DOWNLOAD_IDLE_US = 10_000_000  # a download without a request for so long has ended; MAVProxy never acknowledges one

ALL = mavlink.MAV_MISSION_TYPE_ALL
ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
_MISSION_ACK = known_type("MISSION_ACK")
_MISSION_COUNT = known_type("MISSION_COUNT")
_MISSION_CURRENT_ID = known_type("MISSION_CURRENT").msg_id
_MISSION_ITEM = known_type("MISSION_ITEM")
_MISSION_ITEM_INT = known_type("MISSION_ITEM_INT")

_KINDS = frozenset(ListKind)
_NAMES = {ListKind.MISSION: "Mission", ListKind.FENCE: "Fence", ListKind.RALLY: "Rally points"}


@dataclass(slots=True)
class Upload:
    """An upload under way: of a whole list, or of a part of it over a copy of the old one."""

    sender: Sender
    kind: ListKind
    items: list[MissionItem]  # all before `next_seq` are what they shall be
    next_seq: int
    end_seq: int
    retries: int = 0
    retry_at_us: int = 0


@dataclass(slots=True)
class Download:
    """The list as it was when a client asked for it, whatever is uploaded meanwhile."""

    items: Sequence[MissionItem]
    until_us: int


@dataclass(frozen=True, slots=True)
class Finished:
    """The end of an upload, to be told again if the acknowledgement was lost."""

    sender: Sender
    last_seq: int
    result: int


class MissionService(Service):
    """Serves the vehicle's three lists."""

    def __init__(self, endpoint: Endpoint, goto: GotoService) -> None:
        self._endpoint = endpoint
        self._goto = goto
        self._uploads: dict[ListKind, Upload] = {}
        self._finished: dict[ListKind, Finished] = {}
        self._downloads: dict[tuple[Sender, ListKind], Download] = {}
        self._item_request = known_type(endpoint.dialect.item_request)

    def messages(self) -> Mapping[str, Handler]:
        return {
            "MISSION_COUNT": self.count_received,
            "MISSION_ITEM": self.item_received,
            "MISSION_ITEM_INT": self.item_received,
            "MISSION_REQUEST_LIST": self.list_requested,
            "MISSION_REQUEST_INT": self.item_int_requested,
            "MISSION_REQUEST": self.item_float_requested,
            "MISSION_REQUEST_PARTIAL_LIST": self.partial_read_requested,
            "MISSION_WRITE_PARTIAL_LIST": self.partial_write_requested,
            "MISSION_ACK": self.ack_received,
            "MISSION_CLEAR_ALL": self.clear_requested,
            "MISSION_SET_CURRENT": self.set_current_requested,
        }

    # The lists as clients see them: the places where a dialect's numbering differs from ours

    def _first_seq(self, kind: ListKind) -> int:
        """Number of our first item in the list that clients see: 1 where item 0 is home."""
        return self._endpoint.dialect.first_seq if kind is ListKind.MISSION else 0

    def _name(self, kind: ListKind, seq: int) -> str:
        """How texts call the item of a number in the list that clients see."""
        first_seq = self._first_seq(kind)
        return "home" if seq < first_seq else item_name(seq - first_seq)

    def served(self, kind: ListKind) -> Sequence[MissionItem]:
        """The list as clients see it."""
        vehicle = self._endpoint.vehicle
        items = vehicle.lists.items(kind)
        return with_home(items, vehicle.state) if self._first_seq(kind) else items

    def _store(self, kind: ListKind, items: Sequence[MissionItem]) -> ItemRefusal | None:
        """Checks and stores a list that a client has sent; a refusal has the client's numbers."""
        refusal = element_out_of_range(items)
        if refusal is None:
            first_seq = self._first_seq(kind)
            refusal = self._endpoint.vehicle.lists.load(kind, without_home(items) if first_seq else items)
            if refusal is not None and items:
                refusal = replace(refusal, seq=refusal.seq + first_seq)
        return refusal

    # As files

    def served_count(self, kind: ListKind) -> int:
        """How many items clients see."""
        count = len(self._endpoint.vehicle.lists.items(kind))
        return count + self._first_seq(kind) if count else 0

    def current_seq(self, kind: ListKind) -> int:
        """Number of the item that is flown, as clients see it; -1 in other lists than the mission."""
        if kind is not ListKind.MISSION:
            return -1
        return self._endpoint.vehicle.state.mission_current + self._first_seq(kind)

    def take_file(self, kind: ListKind, items: Sequence[MissionItem]) -> str:
        """Replaces a list by that of a file; returns why it was not taken, empty if it was."""
        if kind in self._uploads:
            return "another client is uploading"
        refusal = self._store(kind, items)
        return "" if refusal is None else f"{self._name(kind, refusal.seq)}: {refusal.reason}"

    # Upload

    def count_received(self, sender: Sender, fields: Any) -> None:
        """Begins the upload of a list: its items are asked for one by one; a count of 0 clears the list."""
        kind = self._kind(sender, fields)
        if kind is None or self._is_busy(sender, kind):
            return
        capacity = self._endpoint.vehicle.lists.capacity(kind) + self._first_seq(kind)
        if fields.count > capacity:
            self._refuse(sender, mavlink.MAV_MISSION_NO_SPACE, f"{fields.count} items are more than {capacity}", kind)
        elif fields.count == 0:
            self._uploads.pop(kind, None)
            self._load(sender, kind, [])
        else:
            self._begin(Upload(sender, kind, [], 0, fields.count))

    def partial_write_requested(self, sender: Sender, fields: Any) -> None:
        """Begins the upload of a part of a list that is stored already; the rest stays."""
        kind = self._kind(sender, fields)
        if kind is None or self._is_busy(sender, kind):
            return
        items = list(self.served(kind))
        first, last = fields.start_index, fields.end_index
        if 0 <= first <= last < len(items):
            self._begin(Upload(sender, kind, items, first, last + 1))
        else:
            reason = f"items {first} to {last} are not all in the list"
            self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, reason, kind)

    def _begin(self, upload: Upload) -> None:
        self._finished.pop(upload.kind, None)
        self._uploads[upload.kind] = upload
        self._request_next(upload)

    def item_received(self, sender: Sender, fields: Any) -> None:
        """Takes the next item of an upload; the last one is answered by the result for the whole list."""
        if self._goto.takes_item(fields):
            self._ack(sender, self._goto.item_received(sender, fields), fields.mission_type)
            return
        kind = self._kind(sender, fields)
        if kind is None or self._is_busy(sender, kind):
            return
        upload = self._uploads.get(kind)
        if upload is None:
            self._late_item(sender, kind, fields.seq)
        elif fields.seq > upload.next_seq:
            del self._uploads[kind]
            reason = f"{self._name(kind, fields.seq)} came instead of {self._name(kind, upload.next_seq)}"
            self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, reason, kind)
        elif fields.seq == upload.next_seq:
            upload.items[fields.seq : fields.seq + 1] = [item_from_fields(fields)]
            upload.next_seq += 1
            upload.retries = 0
            if upload.next_seq < upload.end_seq:
                self._request_next(upload)
            else:
                del self._uploads[kind]
                self._finished[kind] = Finished(sender, fields.seq, self._load(sender, kind, upload.items))

    def _late_item(self, sender: Sender, kind: ListKind, seq: int) -> None:
        """An item while no upload runs: perhaps our acknowledgement of the last one was lost."""
        finished = self._finished.get(kind)
        if finished is not None and (finished.sender, finished.last_seq) == (sender, seq):
            self._ack(sender, finished.result, kind)
        else:
            reason = f"{self._name(kind, seq)} came without an upload"
            self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, reason, kind)

    def _request_next(self, upload: Upload) -> None:
        sender = upload.sender
        payload = self._item_request.pack(sender.sysid, sender.compid, upload.next_seq, upload.kind)
        self._endpoint.reply(sender, self._item_request, payload)
        upload.retry_at_us = self._endpoint.time_us + RETRY_US

    def frame(self) -> None:
        """Asks again for items that do not come, and gives up in the end."""
        if not self._uploads:
            return
        now_us = self._endpoint.time_us
        for upload in [upload for upload in self._uploads.values() if upload.retry_at_us <= now_us]:
            if upload.retries < RETRIES_MAX:
                upload.retries += 1
                self._request_next(upload)
            else:
                del self._uploads[upload.kind]
                reason = f"upload given up, {self._name(upload.kind, upload.next_seq)} did not come"
                self._refuse(upload.sender, mavlink.MAV_MISSION_OPERATION_CANCELLED, reason, upload.kind)

    def _load(self, sender: Sender, kind: ListKind, items: Sequence[MissionItem]) -> int:
        """Hands a whole list to the vehicle and answers; returns the MAV_MISSION_RESULT."""
        refusal = self._store(kind, items)
        if refusal is None:
            self._ack(sender, ACCEPTED, kind)
            return int(ACCEPTED)
        self._refuse(sender, refusal.result, f"{self._name(kind, refusal.seq)}: {refusal.reason}", kind)
        return refusal.result

    # Download

    def list_requested(self, sender: Sender, fields: Any) -> None:
        """Begins a download: the answer is the number of items, which are then served in any order."""
        kind = self._kind(sender, fields)
        if kind is None:
            return
        items = self.served(kind)
        downloads = self._downloads
        downloads.pop((sender, kind), None)
        while len(downloads) >= DOWNLOADS_MAX:
            del downloads[next(iter(downloads))]  # the oldest; it is served from the list as it is then
        downloads[sender, kind] = Download(items, self._endpoint.time_us + DOWNLOAD_IDLE_US)
        payload = _MISSION_COUNT.pack(sender.sysid, sender.compid, len(items), kind)
        self._endpoint.reply(sender, _MISSION_COUNT, payload)

    def item_int_requested(self, sender: Sender, fields: Any) -> None:
        """Answers with the item, its position in integers."""
        kind, item = self._requested_item(sender, fields)
        if item is not None:
            x, y = scaled_position(item)
            self._reply_item(sender, _MISSION_ITEM_INT, kind, item, x, y)

    def item_float_requested(self, sender: Sender, fields: Any) -> None:
        """Answers with the item, its position as floating point numbers."""
        kind, item = self._requested_item(sender, fields)
        if item is not None:
            self._reply_item(sender, _MISSION_ITEM, kind, item, item.x, item.y)

    def _requested_item(self, sender: Sender, fields: Any) -> tuple[ListKind, MissionItem | None]:
        kind = self._kind(sender, fields)
        if kind is None:
            return ListKind.MISSION, None
        download = self._downloads.get((sender, kind))
        now_us = self._endpoint.time_us
        if download is not None and download.until_us < now_us:
            del self._downloads[sender, kind]
            download = None
        if download is None:
            items = self.served(kind)
        else:
            items = download.items
            download.until_us = now_us + DOWNLOAD_IDLE_US
        if fields.seq < len(items):
            return kind, items[fields.seq]
        if fields.seq == 0 and self._first_seq(kind):  # of an empty mission, too: how clients ask for home
            return kind, home_item(self._endpoint.vehicle.state)
        self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, f"there is no {self._name(kind, fields.seq)}", kind)
        return kind, None

    def _reply_item(self, sender: Sender, message: Any, kind: ListKind, item: MissionItem, x: float, y: float) -> None:
        current = self._endpoint.vehicle.state.mission_current + self._first_seq(kind)
        is_current = kind is ListKind.MISSION and item.seq == current
        payload = message.pack(
            sender.sysid,
            sender.compid,
            item.seq,
            item.frame,
            item.command,
            int(is_current),
            int(item.autocontinue),
            *item.params,
            x,
            y,
            item.z,
            kind,
        )
        self._endpoint.reply(sender, message, payload)

    def ack_received(self, sender: Sender, fields: Any) -> None:
        """Ends the client's download, or gives up its upload."""
        if fields.mission_type not in _KINDS:
            return
        kind = ListKind(fields.mission_type)
        self._downloads.pop((sender, kind), None)
        upload = self._uploads.get(kind)
        if upload is not None and upload.sender == sender and fields.type != ACCEPTED:
            del self._uploads[kind]

    # The rest

    def clear_requested(self, sender: Sender, fields: Any) -> None:
        """Clears one list, or with type 255 all three; each as a whole, in flight too."""
        if fields.mission_type == ALL:
            kinds = tuple(ListKind)
        else:
            kind = self._kind(sender, fields)
            if kind is None:
                return
            kinds = (kind,)
        if any(self._is_busy(sender, kind, fields.mission_type) for kind in kinds):
            return
        for kind in kinds:
            self._uploads.pop(kind, None)  # who clears has given up its own upload
            refusal = self._store(kind, [])
            if refusal is not None:
                self._refuse(sender, refusal.result, refusal.reason, kind)
                return
        self._ack(sender, ACCEPTED, fields.mission_type)

    def set_current_requested(self, sender: Sender, fields: Any) -> None:
        """Makes an item the current one; the answer is MISSION_CURRENT, whether it changed or not."""
        seq = max(fields.seq - self._first_seq(ListKind.MISSION), 0)
        reply = self._endpoint.vehicle.request(SetCurrentItem(seq))
        if reply.reason:
            self._endpoint.text(Severity.WARNING, f"Mission: {reply.reason}")
        telemetry = self._endpoint.telemetry
        payload = telemetry.builders[_MISSION_CURRENT_ID](self._endpoint.vehicle.state)
        if payload is not None:
            self._endpoint.reply(sender, telemetry.types[_MISSION_CURRENT_ID], payload)

    def partial_read_requested(self, sender: Sender, fields: Any) -> None:
        """Refused: a list is read as a whole, or item by item in any order."""
        reason = "a part of a list cannot be read at once"
        self._refuse(sender, mavlink.MAV_MISSION_UNSUPPORTED, reason, fields.mission_type)

    def _kind(self, sender: Sender, fields: Any) -> ListKind | None:
        """The list a message is about; refuses one that does not exist."""
        if fields.mission_type in _KINDS:
            return ListKind(fields.mission_type)
        self._refuse(sender, mavlink.MAV_MISSION_UNSUPPORTED, "no such list", fields.mission_type)
        return None

    def _is_busy(self, sender: Sender, kind: ListKind, answered_type: int | None = None) -> bool:
        """Whether another client is uploading the list; tells the sender so."""
        upload = self._uploads.get(kind)
        if upload is None or upload.sender == sender:
            return False
        mission_type = kind if answered_type is None else answered_type
        self._refuse(sender, mavlink.MAV_MISSION_DENIED, "another client is uploading", mission_type)
        return True

    def _ack(self, sender: Sender, result: int, mission_type: int) -> None:
        payload = _MISSION_ACK.pack(sender.sysid, sender.compid, result, mission_type)
        self._endpoint.reply(sender, _MISSION_ACK, payload)

    def _refuse(self, sender: Sender, result: int, reason: str, mission_type: int) -> None:
        self._ack(sender, result, mission_type)
        is_known = mission_type in _KINDS
        subject = _NAMES[ListKind(mission_type)] if is_known else f"Mission type {mission_type}"
        self._endpoint.text_once(Severity.WARNING, f"{subject}: {reason}")
