"""The flight controller's own auxiliary outputs: servos, relays and actuators set by a client or a mission.

In: commands. Out: pulse widths of the outputs 9 to 16 and the states of the relays, kept in the vehicle's state.
"""

from math import isfinite

from autopilot.payload import Params
from autopilot.vehicle import ACCEPTED, Reply, VehicleState, Verdict

SET_RELAY, SET_SERVO, SET_ACTUATOR = 181, 183, 187  # MAV_CMD
FIRST_CHANNEL, CHANNELS = 9, 8  # outputs 1 to 8 are the rotors'
RELAYS = 6
_PULSE_MIN_US, _PULSE_MID_US, _PULSE_MAX_US = 500, 1500, 2500
_ACTUATOR_SWING_US = 500.0  # of the full range of an actuator, to either side


class AuxOutputs:
    """Servos, relays and actuators: a `Payload`."""

    def __init__(self, state: VehicleState) -> None:
        self._state = state

    def takes(self, command: int) -> bool:
        return command in (SET_RELAY, SET_SERVO, SET_ACTUATOR)

    def run(self, command: int, params: Params, x: float, y: float, z: float) -> Reply:
        if command == SET_RELAY:
            return self._set_relay(params[0], params[1])
        if command == SET_SERVO:
            return self._set_servo(params[0], params[1])
        return self._set_actuators((*params, x, y), z)

    def _set_relay(self, relay: float, value: float) -> Reply:
        if relay not in range(RELAYS):
            return _denied(f"there is no relay {relay:g}, only 0 to {RELAYS - 1}")
        if value not in (0.0, 1.0):
            return _denied("a relay is either 0 or 1")
        bit = 1 << int(relay)
        self._state.relays = self._state.relays | bit if value else self._state.relays & ~bit
        return ACCEPTED

    def _set_servo(self, channel: float, pulse_us: float) -> Reply:
        i_output = channel - FIRST_CHANNEL
        if i_output not in range(CHANNELS):
            return _denied(f"output {channel:g} is not one of {FIRST_CHANNEL} to {FIRST_CHANNEL + CHANNELS - 1}")
        if not _PULSE_MIN_US <= pulse_us <= _PULSE_MAX_US:
            return _denied(f"a pulse of {pulse_us:g} us is not between {_PULSE_MIN_US} and {_PULSE_MAX_US}")
        self._set_pulse(int(i_output), round(pulse_us))
        return ACCEPTED

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
