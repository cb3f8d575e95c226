"""What the numbers of events mean: their texts as MAVLink's events metadata, and the reasons against arming as events.

An event carries numbers only; a client shows the text it finds in the metadata. A reason against arming is a text here,
so it is looked up among the known ones, its numbers become the event's arguments.
"""

import re
import struct
import zlib
from dataclasses import dataclass
from typing import Any

from autopilot.commander.failsafe import RULES
from autopilot.mavlink.channel import AUTOPILOT_COMPONENT
from autopilot.mavlink.dialects import Dialect

NAMESPACE = "honeyguide"
THE_MODE_CHOSEN = 1  # the only mode group: the checks are those of the mode that is chosen

_COMPONENTS = (
    "none", "system", "imu", "absolute_pressure", "magnetometer", "attitude_estimate", "local_position_estimate",
    "gps", "battery", "remote_control",
)  # fmt: skip
"""Health components; the position in this list is the number of their bit."""

# A reason's text with its numbers as arguments, and the component it is about.
_REASONS = (
    ("a calibration is running", "system"),
    ("no data from the sensors yet", "system"),
    ("vehicle is moving", "system"),
    ("vehicle is not upright", "system"),
    ("not on the ground", "system"),
    ("IMU: no data", "imu"),
    ("gyro bias is high", "imu"),
    ("accelerometer bias is high", "imu"),
    ("barometer: no data", "absolute_pressure"),
    ("magnetometer: no data", "magnetometer"),
    ("strong magnetic interference", "magnetometer"),
    ("compass contradicts the heading of the last flight: calibrate it", "magnetometer"),
    ("estimator: attitude not aligned", "attitude_estimate"),
    ("estimator: heading not aligned", "attitude_estimate"),
    ("estimator: heading not aligned: take off in a mode that needs no position", "attitude_estimate"),
    ("estimator: no valid height", "local_position_estimate"),
    ("estimator: no valid position", "local_position_estimate"),
    ("estimator: no valid velocity", "local_position_estimate"),
    ("estimator: horizontal accuracy {3:.1} m, {4:.1} m needed", "local_position_estimate"),
    ("estimator: vertical accuracy {3:.1} m, {4:.1} m needed", "local_position_estimate"),
    ("no valid position", "local_position_estimate"),
    ("no home position", "local_position_estimate"),
    ("GNSS: no data", "gps"),
    ("GNSS: no 3-D fix", "gps"),
    ("GNSS: {3:.0} satellites, {4:.0} needed", "gps"),
    ("battery: no data", "battery"),
    ("battery: {3:.0}% left, {4:.0}% needed", "battery"),
    ("needs a pilot's sticks", "remote_control"),
)
_ANY_REASON = "another check fails: its text tells which"
_NUMBER = r"(-?\d+(?:\.\d+)?|nan|inf)"


def event_id(name: str) -> int:
    """An event's number: the component in the upper byte, a hash of the name below, the same in every version."""
    return AUTOPILOT_COMPONENT << 24 | zlib.crc32(name.encode("ascii")) & 0xFFFFFF


ARMED = event_id("armed")
DISARMED = event_id("disarmed")
MODE_CHANGED = event_id("mode_changed")  # argument: custom_mode, 32 bits
ARMING_SUMMARY = event_id("arming_check_summary")
HEALTH_SUMMARY = event_id("health_summary")
# Failsafe texts begin with their rule's text; the first rule that fits.
FAILSAFES = {rule.text: event_id(rule.text.lower().replace(" ", "_")) for rule in RULES}


@dataclass(frozen=True, slots=True)
class Check:
    """A reason against arming as an event."""

    number: int
    component: int  # place in the list of components
    arguments: bytes


@dataclass(frozen=True, slots=True)
class _Reason:
    number: int
    name: str
    text: str
    component: int
    pattern: re.Pattern[str]

    @property
    def argument_count(self) -> int:
        return self.pattern.groups


def _reason(text: str, component: str) -> _Reason:
    name = "check_" + re.sub(r"[^a-z]+", "_", re.sub(r"\{.*?\}", "", text.lower())).strip("_")
    parts = re.split(r"\{.*?\}", text)
    pattern = re.compile(_NUMBER.join(map(re.escape, parts)))
    return _Reason(event_id(name), name, text, _COMPONENTS.index(component), pattern)


_KNOWN = tuple(_reason(text, component) for text, component in _REASONS)
_OTHER = _reason(_ANY_REASON, "system")


def check_of(reason: str) -> Check:
    """The event of a reason against arming; one that is not in the list is told as such."""
    for known in _KNOWN:
        found = known.pattern.fullmatch(reason)
        if found is not None:
            numbers = [float(number) for number in found.groups()]
            return _check(known, struct.pack(f"<{len(numbers)}f", *numbers))
    return _check(_OTHER, b"")


def _check(reason: _Reason, numbers: bytes) -> Check:
    return Check(reason.number, reason.component, struct.pack("<IB", THE_MODE_CHOSEN, reason.component) + numbers)


def summaries(checks: list[Check], *, may_arm: bool, may_run: bool) -> tuple[bytes, bytes]:
    """Arguments of the events before and after the checks: of arming, and of the components' health."""
    failing = 0
    for check in checks:
        failing |= 1 << check.component
    present = (1 << len(_COMPONENTS)) - 2
    arming = struct.pack("<BQQII", 0, failing, 0, may_arm * THE_MODE_CHOSEN, may_run * THE_MODE_CHOSEN)
    return arming, struct.pack("<BQQQ", 0, present, failing, 0)


# Metadata


def events_metadata(dialect: Dialect) -> dict[str, Any]:
    """The file that tells clients the texts, COMP_METADATA_TYPE_EVENTS."""
    modes = {str(dialect.custom_mode(row.mode)): {"name": row.name, "description": row.name} for row in dialect.modes}
    groups = {
        "default": _events(
            (ARMED, "armed", "Armed", ()),
            (DISARMED, "disarmed", "Disarmed", ()),
            (MODE_CHANGED, "mode_changed", "Mode: {1}", (("mode_t", "mode"),)),
            *((number, text.lower().replace(" ", "_"), text, ()) for text, number in FAILSAFES.items()),
        ),
        "arming_check": _events(*map(_check_event, (*_KNOWN, _OTHER)))
        | _summary(ARMING_SUMMARY, "arming_check_summary", _masks("error", "warning") + _groups("can_arm", "can_run")),
        "health": _summary(HEALTH_SUMMARY, "health_summary", _masks("is_present", "error", "warning")),
    }
    autopilot = {
        "namespace": NAMESPACE,
        "enums": {
            "mode_t": {"type": "uint32_t", "description": "Flight mode", "entries": modes},
            "navigation_mode_group_t": _bits("uint32_t", "Modes with the same checks", ["chosen"]),
            "health_component_t": _bits("uint64_t", "Parts that can be unwell", _COMPONENTS),
        },
        "event_groups": {name: {"events": events} for name, events in groups.items()},
        "navigation_mode_groups": {"groups": {"0": [int(number) for number in modes]}},
        "supported_protocols": ["health_and_arming_check"],
    }
    return {"version": 1, "components": {str(AUTOPILOT_COMPONENT): autopilot}}


_Argument = tuple[str, str]  # type, name


def _events(*events: tuple[int, str, str, tuple[_Argument, ...]]) -> dict[str, Any]:
    """Number, name, text and arguments of each event, by the lower bytes of their numbers."""
    return {
        str(number & 0xFFFFFF): {
            "name": name,
            "message": text,
            "arguments": [{"type": kind, "name": argument} for kind, argument in arguments],
        }
        for number, name, text, arguments in events
    }


def _check_event(reason: _Reason) -> tuple[int, str, str, tuple[_Argument, ...]]:
    numbers = tuple(("float", f"number_{i + 1}") for i in range(reason.argument_count))
    arguments = (("navigation_mode_group_t", "modes"), ("uint8_t", "health_component_index"), *numbers)
    return reason.number, reason.name, reason.text[0].upper() + reason.text[1:], arguments


def _summary(number: int, name: str, arguments: tuple[_Argument, ...]) -> dict[str, Any]:
    events = _events((number, name, "", (("uint8_t", "chunk_idx"), *arguments)))
    events[str(number & 0xFFFFFF)]["type"] = "summary"
    return events


def _masks(*names: str) -> tuple[_Argument, ...]:
    return tuple(("health_component_t", name) for name in names)


def _groups(*names: str) -> tuple[_Argument, ...]:
    return tuple(("navigation_mode_group_t", name) for name in names)


def _bits(kind: str, description: str, names: tuple[str, ...] | list[str]) -> dict[str, Any]:
    entries = {
        str(1 << i): {"name": name, "description": name.replace("_", " ").capitalize()} for i, name in enumerate(names)
    }
    return {"type": kind, "description": description, "is_bitfield": True, "entries": entries}
