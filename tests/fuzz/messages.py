"""Random MAVLink: valid messages of every kind, and frames that are cut, flipped or nothing at all.

What is made follows the handlers the server has, so that a new service is part of it the day it is registered.
"""

from math import inf, nan

import numpy as np
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.wire.codec import frame_bytes, known_type, message_type
from autopilot.mavlink.wire.message_definitions import DEFINITIONS

ELSEWHERE = 77  # a system that is not there

# These move the vehicle, switch it off or break it, as they should; they are addressed to another vehicle.
MOVING_MESSAGES = frozenset({
    "SET_MODE", "MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "MANUAL_SETPOINT", "COMMAND_CANCEL",
})  # fmt: skip
MOVING_COMMANDS = frozenset({
    *range(16, 100),  # NAV_*: go somewhere now
    mavlink.MAV_CMD_DO_SET_MODE, 262,  # 262: DO_SET_STANDARD_MODE
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION, mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, mavlink.MAV_CMD_DO_SET_ACTUATOR,
    mavlink.MAV_CMD_DO_GO_AROUND, mavlink.MAV_CMD_DO_REPOSITION, mavlink.MAV_CMD_DO_PAUSE_CONTINUE,
    mavlink.MAV_CMD_DO_FENCE_ENABLE, mavlink.MAV_CMD_DO_PARACHUTE, mavlink.MAV_CMD_DO_MOTOR_TEST,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, mavlink.MAV_CMD_PREFLIGHT_CALIBRATION,
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, mavlink.MAV_CMD_PREFLIGHT_STORAGE, mavlink.MAV_CMD_OVERRIDE_GOTO,
    mavlink.MAV_CMD_MISSION_START, mavlink.MAV_CMD_ACTUATOR_TEST, mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
    mavlink.MAV_CMD_INJECT_FAILURE, 43000, 43001, 43002, 43003,  # GUIDED_CHANGE_*
})  # fmt: skip

# After these there is no flight left to send anything to: a bold sequence sends few of them.
ENDING_COMMANDS = frozenset({
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION, mavlink.MAV_CMD_DO_PARACHUTE, mavlink.MAV_CMD_DO_MOTOR_TEST,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_INJECT_FAILURE, mavlink.MAV_CMD_ACTUATOR_TEST,
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
})  # fmt: skip
_ENDING_SHARE = 0.02
_BOLD_PARAMETER_SHARE = 0.02  # of those that are set, with a value that they may take

_FLOATS = np.array([nan, inf, -inf, -1.0, 0.0, 1.0, 2.0, 4.0, 8.5, 47.4, 500.0, -1e6, 3.4e38, 1e-45])
_BOLD_FLOATS = np.array([
    *_FLOATS, -3.4e38, 3.4028234e38, -3.4028234e38, 1e30, -1e30, 1e19, 1e10, -1e10, 1e9, 1e6, 1e3, -1e3, -1e-45, 1e-39,
    0.3, -0.3, 3.0, 10.0, -10.0, 30.0, 180.0, -90.0,
])  # fmt: skip
_BITS = {"PARAM_SET": "param_value", "PARAM_VALUE": "param_value"}  # carried as an integer's bit pattern
_NAN_BITS, _INF_BITS = 0x7FC00000, 0x7F800000


class Messages:
    """Frames of one random sequence.

    Args:
        rng: where chance comes from.
        messages: names of the messages the server has handlers for.
        commands: numbers of the commands it has handlers for.
        parameters: names of its parameters.
        source: (sysid, compid) of who sends them.
        is_bold: addresses the vehicle itself with all that moves it, and sends more extreme numbers.
    """

    def __init__(self, rng, messages, commands, parameters, source, *, is_bold=False):
        self._rng = rng
        self._handled = [known_type(name) for name in sorted(messages)]
        self._others = [message_type(msg_id) for msg_id in sorted(DEFINITIONS)]
        self._commands = sorted(commands)
        self._parameters = sorted(parameters)
        self._source = source
        self._is_bold = is_bold
        self._floats = _BOLD_FLOATS if is_bold else _FLOATS
        self._seq = 0
        self.counts = {}

    def valid(self):
        """A frame whose checksum is right."""
        kinds = self._others if self._rng.random() < 0.2 else self._handled
        kind = kinds[self._rng.integers(len(kinds))]
        self.counts[kind.name] = self.counts.get(kind.name, 0) + 1
        return self._frame(kind, kind.pack(**self._fields(kind)))

    def _frame(self, kind, payload):
        self._seq = self._seq + 1 & 0xFF
        return frame_bytes(kind, payload, self._seq, *self._source)

    def _fields(self, kind):
        rng = self._rng
        fields = kind.unpack(rng.bytes(kind.size))._asdict()
        if rng.random() < 0.7:  # small numbers are the ones that mean something
            for name, value in fields.items():
                if isinstance(value, int):
                    fields[name] = value & int(rng.choice((0x1, 0x3, 0xF, 0x7F)))
        for name, value in fields.items():
            if isinstance(value, float) and rng.random() < 0.7:
                fields[name] = float(rng.choice(self._floats))
            elif self._is_bold and isinstance(value, tuple) and isinstance(value[0], float):
                fields[name] = rng.choice(self._floats, len(value)).tolist()
        if kind.name in _BITS:
            self._harmless_parameter(fields)
        may_move = kind.name in MOVING_MESSAGES
        if "command" in fields and kind.name.startswith("COMMAND_"):
            if rng.random() < 0.8:
                fields["command"] = int(rng.choice(self._commands))
            may_move = may_move or fields["command"] in MOVING_COMMANDS
        if self._is_bold:
            may_move = fields.get("command") in ENDING_COMMANDS and rng.random() > _ENDING_SHARE
        self._address(fields, may_move)
        return fields

    def _harmless_parameter(self, fields):
        """A real parameter gets no value that it could take: that would change how the vehicle flies."""
        if self._rng.random() < 0.5:
            fields["param_id"] = str(self._rng.choice(self._parameters))
            if self._is_bold and self._rng.random() < _BOLD_PARAMETER_SHARE:
                return
        if fields["param_id"].strip() in self._parameters:
            fields["param_value"] = int(self._rng.choice((_NAN_BITS, _INF_BITS)))

    def _address(self, fields, may_move):
        """Where it goes: what may move, to nobody here."""
        for name in ("target_system", "target"):
            if name in fields:
                fields[name] = ELSEWHERE if may_move else int(self._rng.choice((0, 1, 1, 1, 1, 255, ELSEWHERE)))
        if "target_component" in fields:
            fields["target_component"] = int(self._rng.choice((0, 1, 1, 1, 100, 154, 190)))

    def broken(self):
        """Bytes that are a frame no more: cut, flipped, or never one."""
        rng = self._rng
        what = rng.integers(3)
        if what == 0:
            return rng.bytes(int(rng.integers(1, 300)))
        frame = self.valid()
        if what == 1:
            return frame[: int(rng.integers(1, len(frame)))]
        flipped = bytearray(frame)
        for at in rng.integers(8 * len(frame), size=int(rng.integers(1, 8))):
            flipped[at >> 3] ^= 1 << (at & 7)
        return bytes(flipped)
