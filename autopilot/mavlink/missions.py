"""The mission protocol: upload, download, clear, current item.

In: the messages of any number of clients. Out: counts, items, requests, acknowledgements. An upload is staged and
handed to the vehicle as a whole, so that a failed one leaves the old mission as it was. Only flight plans are stored;
fence and rally lists are always empty.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isinf, nan
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.codec import known_type
from autopilot.mavlink.convert import INT32_MAX, LATLON_FRAMES, MISSION_FRAME, bounded_int
from autopilot.mavlink.service import Handler, Service
from autopilot.navigator.items import MAX_ITEMS
from autopilot.vehicle import ItemRefusal, MissionItem, Severity

RETRY_US = 1_500_000  # the MAVLink mission protocol's default time-out
RETRIES_MAX = 5
DOWNLOADS_MAX = 16  # clients whose download is remembered

PLAN, FENCE, RALLY, ALL = 0, 1, 2, 255  # MAV_MISSION_TYPE
LOCAL_SCALE = 1.0e4  # local positions travel as 0.1 mm
EMPTY_TYPES = (FENCE, RALLY)

ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
_MISSION_ACK = known_type("MISSION_ACK")
_MISSION_COUNT = known_type("MISSION_COUNT")
_MISSION_CURRENT_ID = known_type("MISSION_CURRENT").msg_id
_MISSION_ITEM = known_type("MISSION_ITEM")
_MISSION_ITEM_INT = known_type("MISSION_ITEM_INT")
_MISSION_REQUEST_INT = known_type("MISSION_REQUEST_INT")

_TYPE_NAMES = {PLAN: "Mission", FENCE: "Fence", RALLY: "Rally points"}


@dataclass(slots=True)
class Upload:
    """An upload under way."""

    sender: Sender
    count: int
    items: list[MissionItem] = field(default_factory=list)
    retries: int = 0
    retry_at_us: int = 0


class MissionService(Service):
    """Serves the vehicle's mission."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._upload: Upload | None = None
        self._last_upload: tuple[Sender, int, int] | None = None  # sender, last seq, result
        self._downloads: dict[Sender, tuple[MissionItem, ...]] = {}

    def messages(self) -> Mapping[str, Handler]:
        return {
            "MISSION_COUNT": self.count_received,
            "MISSION_ITEM": self.item_received,
            "MISSION_ITEM_INT": self.item_received,
            "MISSION_REQUEST_LIST": self.list_requested,
            "MISSION_REQUEST_INT": self.item_int_requested,
            "MISSION_REQUEST": self.item_float_requested,
            "MISSION_REQUEST_PARTIAL_LIST": self.partial_list_requested,
            "MISSION_WRITE_PARTIAL_LIST": self.partial_list_requested,
            "MISSION_ACK": self.ack_received,
            "MISSION_CLEAR_ALL": self.clear_requested,
            "MISSION_SET_CURRENT": self.set_current_requested,
        }

    # Upload

    def count_received(self, sender: Sender, fields: Any) -> None:
        """A client wants to upload."""
        if fields.mission_type != PLAN:
            self._answer_empty_type(sender, fields.mission_type, is_clear=fields.count == 0)
        elif self._upload is not None and self._upload.sender != sender:
            self._refuse(sender, mavlink.MAV_MISSION_DENIED, "another client is uploading")
        elif fields.count > MAX_ITEMS:
            self._refuse(sender, mavlink.MAV_MISSION_NO_SPACE, f"{fields.count} items are more than {MAX_ITEMS}")
        elif fields.count == 0:
            self._upload = None
            self._load(sender, [])
        else:
            self._last_upload = None
            self._upload = Upload(sender, fields.count)
            self._request_next(self._upload)

    def item_received(self, sender: Sender, fields: Any) -> None:
        """MISSION_ITEM or MISSION_ITEM_INT."""
        upload = self._upload
        if fields.mission_type != PLAN:
            self._answer_empty_type(sender, fields.mission_type, is_clear=False)
        elif upload is None:
            self._late_item(sender, fields.seq)
        elif upload.sender != sender:
            self._refuse(sender, mavlink.MAV_MISSION_DENIED, "another client is uploading")
        elif fields.seq > len(upload.items):
            self._upload = None
            reason = f"item {fields.seq} came instead of {len(upload.items)}"
            self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, reason)
        elif fields.seq == len(upload.items):
            upload.items.append(item_from_fields(fields))
            upload.retries = 0
            if len(upload.items) < upload.count:
                self._request_next(upload)
            else:
                self._upload = None
                result = self._load(sender, upload.items)
                self._last_upload = (sender, fields.seq, result)

    def _late_item(self, sender: Sender, seq: int) -> None:
        """An item while no upload runs: perhaps our acknowledgement of the last one was lost."""
        if self._last_upload is not None and self._last_upload[:2] == (sender, seq):
            self._ack(sender, self._last_upload[2])
        else:
            self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, f"item {seq} came without an upload")

    def _request_next(self, upload: Upload) -> None:
        sender = upload.sender
        payload = _MISSION_REQUEST_INT.pack(sender.sysid, sender.compid, len(upload.items), PLAN)
        self._endpoint.reply(sender, _MISSION_REQUEST_INT, payload)
        upload.retry_at_us = self._endpoint.time_us + RETRY_US

    def frame(self) -> None:
        """Asks again for an item that does not come, and gives up in the end."""
        upload = self._upload
        if upload is None or self._endpoint.time_us < upload.retry_at_us:
            return
        if upload.retries < RETRIES_MAX:
            upload.retries += 1
            self._request_next(upload)
        else:
            self._upload = None
            reason = f"upload given up, item {len(upload.items)} did not come"
            self._refuse(upload.sender, mavlink.MAV_MISSION_OPERATION_CANCELLED, reason)

    def _load(self, sender: Sender, items: list[MissionItem]) -> int:
        """Hands a whole mission to the vehicle and answers; returns the MAV_MISSION_RESULT."""
        refusal = infinite_element(items) or self._endpoint.vehicle.load_mission(items)
        if refusal is None:
            self._ack(sender, ACCEPTED)
            return int(ACCEPTED)
        self._refuse(sender, refusal.result, f"item {refusal.seq}: {refusal.reason}")
        return refusal.result

    # Download

    def list_requested(self, sender: Sender, fields: Any) -> None:
        """A client wants to download; it is served from the mission as it is now, whatever is uploaded meanwhile."""
        items = tuple(self._endpoint.vehicle.mission_items()) if fields.mission_type == PLAN else ()
        if fields.mission_type not in _TYPE_NAMES:
            self._refuse(sender, mavlink.MAV_MISSION_UNSUPPORTED, "no such list", fields.mission_type)
            return
        if fields.mission_type == PLAN:
            if len(self._downloads) >= DOWNLOADS_MAX:
                self._downloads.clear()
            self._downloads[sender] = items
        payload = _MISSION_COUNT.pack(sender.sysid, sender.compid, len(items), fields.mission_type)
        self._endpoint.reply(sender, _MISSION_COUNT, payload)

    def item_int_requested(self, sender: Sender, fields: Any) -> None:
        item = self._requested_item(sender, fields)
        if item is not None:
            x, y = scaled_position(item)
            self._reply_item(sender, _MISSION_ITEM_INT, item, x, y)

    def item_float_requested(self, sender: Sender, fields: Any) -> None:
        item = self._requested_item(sender, fields)
        if item is not None:
            self._reply_item(sender, _MISSION_ITEM, item, item.x, item.y)

    def _requested_item(self, sender: Sender, fields: Any) -> MissionItem | None:
        items = self._downloads.get(sender)
        if items is None:
            items = tuple(self._endpoint.vehicle.mission_items())
        seq: int = fields.seq
        if fields.mission_type == PLAN and seq < len(items):
            return items[seq]
        reason = f"there is no item {seq}"
        self._refuse(sender, mavlink.MAV_MISSION_INVALID_SEQUENCE, reason, fields.mission_type)
        return None

    def _reply_item(self, sender: Sender, kind: Any, item: MissionItem, x: float, y: float) -> None:
        is_current = int(item.seq == self._endpoint.vehicle.state.mission_current)
        payload = kind.pack(
            sender.sysid,
            sender.compid,
            item.seq,
            item.frame,
            item.command,
            is_current,
            int(item.autocontinue),
            *item.params,
            x,
            y,
            item.z,
            PLAN,
        )
        self._endpoint.reply(sender, kind, payload)

    def ack_received(self, sender: Sender, fields: Any) -> None:
        """The client has its download, or gives up its upload."""
        self._downloads.pop(sender, None)
        if self._upload is not None and self._upload.sender == sender and fields.type != ACCEPTED:
            self._upload = None

    # The rest

    def clear_requested(self, sender: Sender, fields: Any) -> None:
        if fields.mission_type in EMPTY_TYPES:
            self._answer_empty_type(sender, fields.mission_type, is_clear=True)
        elif fields.mission_type not in (PLAN, ALL):
            self._refuse(sender, mavlink.MAV_MISSION_UNSUPPORTED, "no such list", fields.mission_type)
        elif self._upload is not None and self._upload.sender != sender:
            self._refuse(sender, mavlink.MAV_MISSION_DENIED, "another client is uploading", fields.mission_type)
        else:
            self._upload = None  # who clears has given up its own upload
            refusal = self._endpoint.vehicle.load_mission([])
            if refusal is None:
                self._ack(sender, ACCEPTED, fields.mission_type)
            else:
                self._refuse(sender, refusal.result, refusal.reason, fields.mission_type)

    def set_current_requested(self, sender: Sender, fields: Any) -> None:
        """The answer is MISSION_CURRENT, whether it changed or not."""
        reply = self._endpoint.vehicle.set_current_item(fields.seq)
        if reply.reason:
            self._endpoint.text(Severity.WARNING, f"Mission: {reply.reason}")
        telemetry = self._endpoint.telemetry
        payload = telemetry.builders[_MISSION_CURRENT_ID](self._endpoint.vehicle.state)
        if payload is not None:
            self._endpoint.reply(sender, telemetry.types[_MISSION_CURRENT_ID], payload)

    def partial_list_requested(self, sender: Sender, fields: Any) -> None:
        """Parts of a list cannot be read or written."""
        self._refuse(sender, mavlink.MAV_MISSION_UNSUPPORTED, "partial lists are not supported", fields.mission_type)

    def _answer_empty_type(self, sender: Sender, mission_type: int, *, is_clear: bool) -> None:
        if is_clear and mission_type in EMPTY_TYPES:
            self._ack(sender, ACCEPTED, mission_type)
        else:
            self._refuse(sender, mavlink.MAV_MISSION_UNSUPPORTED, "not supported", mission_type)

    def _ack(self, sender: Sender, result: int, mission_type: int = PLAN) -> None:
        payload = _MISSION_ACK.pack(sender.sysid, sender.compid, result, mission_type)
        self._endpoint.reply(sender, _MISSION_ACK, payload)

    def _refuse(self, sender: Sender, result: int, reason: str, mission_type: int = PLAN) -> None:
        self._ack(sender, result, mission_type)
        subject = _TYPE_NAMES.get(mission_type, f"Mission type {mission_type}")
        self._endpoint.text_once(Severity.WARNING, f"{subject}: {reason}")


def infinite_element(items: Sequence[MissionItem]) -> ItemRefusal | None:
    """The first item with an infinite number, which means nothing in any command."""
    for item in items:
        for i, value in enumerate((*item.params, item.x, item.y, item.z)):
            if isinf(value):
                result = mavlink.MAV_MISSION_INVALID_PARAM1 + i
                return ItemRefusal(item.seq, result, f"parameter {i + 1} is infinite")
    return None


def item_from_fields(fields: Any) -> MissionItem:
    """The item in a MISSION_ITEM or MISSION_ITEM_INT."""
    x, y = fields.x, fields.y
    if isinstance(x, int):  # MISSION_ITEM_INT
        x, y = _unscaled(x, fields.frame), _unscaled(y, fields.frame)
    return MissionItem(
        fields.seq,
        fields.frame,
        fields.command,
        (fields.param1, fields.param2, fields.param3, fields.param4),
        x,
        y,
        fields.z,
        fields.autocontinue != 0,
    )


def _scale(frame: int) -> float:
    """Steps per degree or metre of the integer positions of a frame."""
    if frame == MISSION_FRAME:
        return 1.0
    return 1.0e7 if frame in LATLON_FRAMES else LOCAL_SCALE


def _unscaled(value: int, frame: int) -> float:
    """Degrees, metres, or the plain number; NaN where it was left unset."""
    return nan if value == INT32_MAX else value / _scale(frame)


def scaled_position(item: MissionItem) -> tuple[int, int]:
    """The integers x and y of MISSION_ITEM_INT."""
    scale = _scale(item.frame)
    return (
        bounded_int(item.x * scale, -INT32_MAX - 1, INT32_MAX, INT32_MAX),
        bounded_int(item.y * scale, -INT32_MAX - 1, INT32_MAX, INT32_MAX),
    )
