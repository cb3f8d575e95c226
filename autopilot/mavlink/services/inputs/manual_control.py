"""The pilot's sticks over MAVLink: MANUAL_CONTROL of a joystick, RC_CHANNELS_OVERRIDE in a radio's place.

In: messages, at 5 Hz and more. Out: calls of `vehicle.sticks`. Nothing is acknowledged; sticks that do not count are
answered with a text, at most every 10 s.
"""

from collections.abc import Mapping
from typing import Any

from autopilot.inputs.sticks import CHANNELS
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service

UNCHANGED = 32767  # an axis of MANUAL_CONTROL that is not to be read
FULL = 1000.0
FIRST_CHANNEL = 2  # of the fields of RC_CHANNELS_OVERRIDE, after the two targets
FIRST_CHANNELS = 8  # 0 releases these and 65535 leaves them; from the 9th on 65534 releases and 0 leaves
LEAVE, RELEASE_HIGH = 65535, 65534
_HIGH_CHANNEL = {0: None, LEAVE: None, RELEASE_HIGH: 0}


class ManualService(Service):
    """Passes the sticks on."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._sticks = endpoint.vehicle.sticks

    def messages(self) -> Mapping[str, Handler]:
        return {
            "MANUAL_CONTROL": self.joystick_received,
            "RC_CHANNELS_OVERRIDE": self.override_received,
        }

    def joystick_received(self, sender: Sender, fields: Any) -> None:
        """Taken as the pilot's sticks, if COM_RC_IN_MODE lets a joystick fly and no other sender is in control."""
        if fields.target not in (0, self._endpoint.sysid):
            return
        throttle = _axis if self._sticks.rests_in_middle else _throttle
        axes = (_axis(fields.y), _axis(fields.x), _axis(fields.r), throttle(fields.z))
        who = (sender.sysid, sender.compid)
        self._tell(self._sticks.joystick_moved(who, self._endpoint.time_us, axes, fields.buttons))

    def override_received(self, sender: Sender, fields: Any) -> None:
        """Taken as the channels of a radio receiver, if COM_RC_IN_MODE lets a radio fly; held for RC_OVERRIDE_TIME."""
        channels = fields[FIRST_CHANNEL : FIRST_CHANNEL + CHANNELS]
        pulses_us = [None if value == LEAVE else value for value in channels[:FIRST_CHANNELS]]
        pulses_us += [_HIGH_CHANNEL.get(value, value) for value in channels[FIRST_CHANNELS:]]
        who = (sender.sysid, sender.compid)
        self._tell(self._sticks.channels_overridden(who, self._endpoint.time_us, pulses_us))

    def _tell(self, refusal: str) -> None:
        if refusal:
            self._endpoint.text_once(Severity.WARNING, f"Sticks: {refusal}")


def _axis(value: int) -> float | None:
    """-1..1 of an axis; None: leave it."""
    return None if value == UNCHANGED else min(max(value / FULL, -1.0), 1.0)


def _throttle(value: int) -> float | None:
    """-1..1 of the throttle, which comes as 0..1000; None: leave it."""
    return None if value == UNCHANGED else min(max(2.0 * value / FULL - 1.0, -1.0), 1.0)
