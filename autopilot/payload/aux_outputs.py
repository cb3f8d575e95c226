"""The flight controller's own auxiliary outputs: servos, relays and actuators set by a client or a mission.

In: commands. Out: pulse widths of the outputs 9 to 16 and the states of the relays, kept in the vehicle's state; a
command may have an output switched to and fro some times.
"""

from dataclasses import dataclass
from math import isfinite

from autopilot.interface.vehicle_state import ACCEPTED, Reply, VehicleState, Verdict
from autopilot.payload.payloads import Params

SET_RELAY, REPEAT_RELAY, SET_SERVO, REPEAT_SERVO, SET_ACTUATOR = 181, 182, 183, 184, 187  # MAV_CMD
FIRST_CHANNEL, CHANNELS = 9, 8  # outputs 1 to 8 are the motors'
RELAYS = 6
_PULSE_MIN_US, _PULSE_MID_US, _PULSE_MAX_US = 500, 1500, 2500
_ACTUATOR_SWING_US = 500.0  # of the full range of an actuator, to either side
_REPEATS_MAX = 1000  # guess
_PERIOD_MIN_S, _PERIOD_MAX_S = 0.04, 3600.0  # two frames; guess
NEVER_US = 1 << 62


@dataclass(slots=True)
class _Repeat:
    """An output on its way to and fro."""

    is_relay: bool
    number: int
    pulse_us: int  # of a servo away from the middle
    half_us: int
    due_us: int
    switches_left: int


class AuxOutputs:
    """Servos, relays and actuators: a `Payload`."""

    def __init__(self, state: VehicleState) -> None:
        self._state = state
        self._repeats: dict[tuple[bool, int], _Repeat] = {}  # by kind and number: one per output
        self.due_us = NEVER_US  # when `frame` has something to do

    def takes(self, command: int) -> bool:
        return command in (SET_RELAY, REPEAT_RELAY, SET_SERVO, REPEAT_SERVO, SET_ACTUATOR)

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:
        if command == SET_RELAY:
            return self._set_relay(params[0], params[1])
        if command == REPEAT_RELAY:
            return self._repeat(params[0], 0.0, params[1], params[2], is_relay=True)
        if command == SET_SERVO:
            return self._set_servo(params[0], params[1])
        if command == REPEAT_SERVO:
            return self._repeat(params[0], params[1], params[2], params[3], is_relay=False)
        return self._set_actuators((*params, x, y), z)

    def _set_relay(self, relay: float, value: float) -> Reply:
        if relay not in range(RELAYS):
            return _denied(f"there is no relay {relay:g}, only 0 to {RELAYS - 1}")
        if value not in (0.0, 1.0):
            return _denied("a relay is either 0 or 1")
        self._repeats.pop((True, int(relay)), None)
        bit = 1 << int(relay)
        self._state.relays = self._state.relays | bit if value else self._state.relays & ~bit
        return ACCEPTED

    def _set_servo(self, channel: float, pulse_us: float) -> Reply:
        i_output = channel - FIRST_CHANNEL
        if i_output not in range(CHANNELS):
            return _denied(f"output {channel:g} is not one of {FIRST_CHANNEL} to {FIRST_CHANNEL + CHANNELS - 1}")
        if not _PULSE_MIN_US <= pulse_us <= _PULSE_MAX_US:
            return _denied(f"a pulse of {pulse_us:g} us is not between {_PULSE_MIN_US} and {_PULSE_MAX_US}")
        self._repeats.pop((False, int(i_output)), None)
        self._set_pulse(int(i_output), round(pulse_us))
        return ACCEPTED

    def _repeat(self, output: float, pulse_us: float, count: float, period_s: float, *, is_relay: bool) -> Reply:
        """Switches an output to and fro; the first time at once, and in the end it is as it was or in the middle."""
        if not 1 <= count <= _REPEATS_MAX or not _PERIOD_MIN_S <= period_s <= _PERIOD_MAX_S:
            return _denied(f"needs 1 to {_REPEATS_MAX} times with {_PERIOD_MIN_S:g} to {_PERIOD_MAX_S:g} s each")
        was_on = bool(is_relay and output in range(RELAYS) and self._state.relays >> int(output) & 1)
        reply = self._set_relay(output, float(not was_on)) if is_relay else self._set_servo(output, pulse_us)
        if reply.verdict is Verdict.ACCEPTED:
            number = int(output) if is_relay else int(output) - FIRST_CHANNEL
            half_us = int(period_s * 0.5e6)
            due_us = self._state.time_us + half_us
            self._repeats[is_relay, number] = _Repeat(
                is_relay, number, 0 if is_relay else round(pulse_us), half_us, due_us, 2 * int(count) - 1
            )
            self.due_us = min(self.due_us, due_us)
        return reply

    def frame(self) -> None:
        """Switches what is due; called when it is."""
        now_us = self._state.time_us
        for key, repeat in list(self._repeats.items()):
            if now_us < repeat.due_us:
                continue
            repeat.due_us += repeat.half_us
            repeat.switches_left -= 1
            if repeat.is_relay:
                self._state.relays ^= 1 << repeat.number
            else:
                is_away = repeat.switches_left % 2 == 1
                self._set_pulse(repeat.number, repeat.pulse_us if is_away else _PULSE_MID_US)
            if repeat.switches_left == 0:
                del self._repeats[key]
        self.due_us = min((repeat.due_us for repeat in self._repeats.values()), default=NEVER_US)

    def _set_actuators(self, values: tuple[float, ...], group: float) -> Reply:
        if isfinite(group) and group != 0.0:
            return _denied(f"there is no group {group:g} of actuators, only 0")
        if any(abs(value) > 1.0 for value in values):
            return _denied("the value of an actuator is between -1 and 1")
        for i, value in enumerate(values):
            if isfinite(value):  # NaN leaves an actuator as it is
                self._set_pulse(i, _PULSE_MID_US + round(_ACTUATOR_SWING_US * value))
        return ACCEPTED

    def _set_pulse(self, i_output: int, pulse_us: int) -> None:
        pulses = list(self._state.aux_pulses_us)
        pulses[i_output] = pulse_us
        self._state.aux_pulses_us = tuple(pulses)


def _denied(reason: str) -> Reply:
    return Reply(Verdict.DENIED, reason)
