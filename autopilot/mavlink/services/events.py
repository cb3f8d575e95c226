"""The events protocol: what happened, in a numbered sequence, so that a client can ask again for what it missed.

In: mode and arming changes, failsafe texts, arming checks. Out: EVENT as it happens, CURRENT_EVENT_SEQUENCE at 1 Hz,
and answers to REQUEST_EVENT. A report of the arming checks, as events between two summaries, follows within a second
when their result has changed. Off unless MAV_EVENTS is set: stations show the texts, which come in any case, and the
events.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.services.event_texts import (
    ARMED,
    ARMING_SUMMARY,
    DISARMED,
    FAILSAFES,
    HEALTH_SUMMARY,
    MODE_CHANGED,
    Check,
    check_of,
    summaries,
)
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type

KEPT = 64  # events that can be asked for again
PERIOD_US = 1_000_000
SEQUENCE_RESET = 1  # CURRENT_EVENT_SEQUENCE.flags: the sequence has begun anew
UNAVAILABLE = 0  # RESPONSE_EVENT_ERROR.reason
PROTOCOL = 8  # level of events that are not shown, but read by the client's program
CHECKS_MAX = 12  # per report; a vehicle is seldom wrong in more ways
_ARGUMENTS = 40  # bytes
_SEQUENCES = 1 << 16

_EVENT = known_type("EVENT")
_CURRENT_EVENT_SEQUENCE = known_type("CURRENT_EVENT_SEQUENCE")
_RESPONSE_EVENT_ERROR = known_type("RESPONSE_EVENT_ERROR")


@dataclass(frozen=True, slots=True)
class _Event:
    sequence: int
    payload: bytes


class EventService(Service):
    """Tells what happens."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._params = endpoint.vehicle.params
        self._kept: deque[_Event] = deque(maxlen=KEPT)
        self._sequence = 0  # of the latest event
        self._next_us = 0
        self._is_reset = True  # not told yet
        state = endpoint.vehicle.state
        self._seen = (state.is_armed, state.mode)
        self._reported: object = None  # what the last report was made from

    def messages(self) -> Mapping[str, Handler]:
        return {"REQUEST_EVENT": self.event_requested}

    @property
    def _is_on(self) -> bool:
        return bool(self._params["MAV_EVENTS"])

    def frame(self) -> None:
        """Tells the number of the latest event, so that clients notice what they missed."""
        now_us = self._endpoint.time_us
        if now_us < self._next_us:
            return
        self._next_us = now_us + PERIOD_US
        if self._is_on:
            flags = SEQUENCE_RESET if self._is_reset else 0
            self._is_reset = False
            self._endpoint.broadcast(_CURRENT_EVENT_SEQUENCE, _CURRENT_EVENT_SEQUENCE.pack(self._sequence, flags))
            self._report(is_asked=False)

    # What happens

    def state_changed(self) -> None:
        """Mode or arming may have changed."""
        state = self._endpoint.vehicle.state
        was_armed, mode_before = self._seen
        self._seen = (state.is_armed, state.mode)
        if state.is_armed != was_armed:
            self._tell(ARMED if state.is_armed else DISARMED, Severity.INFO)
        if state.mode is not mode_before:
            custom_mode = self._endpoint.dialect.custom_mode(state.mode)
            self._tell(MODE_CHANGED, Severity.INFO, custom_mode.to_bytes(4, "little"))

    def reported_text(self, severity: Severity, text: str) -> None:
        """A text to everyone: a failsafe's is an event, too."""
        if severity > Severity.WARNING or not self._is_on:
            return
        for start, number in FAILSAFES.items():
            if text.startswith(start):
                self._tell(number, severity)
                return

    def _tell(self, number: int, severity: Severity, arguments: bytes = b"") -> None:
        if not self._is_on:
            return
        self._send(number, severity << 4 | severity, arguments)  # as it is logged, and as it is shown

    def _send(self, number: int, levels: int, arguments: bytes) -> None:
        self._sequence = (self._sequence + 1) % _SEQUENCES
        time_ms = boot_ms(self._endpoint.time_us)
        padded = tuple(arguments.ljust(_ARGUMENTS, b"\0"))
        payload = _EVENT.pack(0, 0, number, time_ms, self._sequence, levels, padded)
        self._kept.append(_Event(self._sequence, payload))
        self._endpoint.broadcast(_EVENT, payload)

    # Arming checks

    def report(self) -> None:
        """Tells the result of the arming checks now, because a client has asked for them."""
        if self._is_on:
            self._report(is_asked=True)

    def _report(self, *, is_asked: bool) -> None:
        """A summary, each check that fails, and the components' health; what clients take for one report."""
        vehicle = self._endpoint.vehicle
        state = vehicle.state
        checks: list[Check] = [] if state.is_armed else [check_of(reason) for reason in vehicle.check_arming()]
        made_from = (state.is_armed, state.is_failsafe, checks)
        if made_from == self._reported and not is_asked:
            return
        self._reported = made_from
        may_run = not state.is_failsafe if state.is_armed else not checks
        before, after = summaries(checks, may_arm=not checks, may_run=may_run)
        self._send(ARMING_SUMMARY, PROTOCOL << 4 | PROTOCOL, before)
        for check in checks[:CHECKS_MAX]:
            self._send(check.number, Severity.ERROR << 4 | Severity.ERROR, check.arguments)
        self._send(HEALTH_SUMMARY, PROTOCOL << 4 | PROTOCOL, after)

    # What clients ask for

    def event_requested(self, sender: Sender, fields: Any) -> None:
        """Sends events again, by their numbers; an error for the first that is not kept any more."""
        if not self._is_on:
            return
        count = (fields.last_sequence - fields.first_sequence) % _SEQUENCES
        is_missing_reported = False
        found = {event.sequence: event for event in self._kept}
        for i in range(min(count, KEPT) + 1):
            sequence = (fields.first_sequence + i) % _SEQUENCES
            event = found.get(sequence)
            if event is not None:
                self._endpoint.reply(sender, _EVENT, event.payload)
            elif not is_missing_reported:
                is_missing_reported = True
                oldest = self._kept[0].sequence if self._kept else self._sequence
                payload = _RESPONSE_EVENT_ERROR.pack(sender.sysid, sender.compid, sequence, oldest, UNAVAILABLE)
                self._endpoint.reply(sender, _RESPONSE_EVENT_ERROR, payload)
