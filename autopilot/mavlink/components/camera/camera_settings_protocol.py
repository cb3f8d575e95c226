"""PARAM_EXT: the camera's settings, with values of 128 bytes; each change is acknowledged."""

import struct
from collections.abc import Callable, Mapping
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.channel import Sender
from autopilot.mavlink.service import Handler
from autopilot.mavlink.wire.codec import MessageType, known_type
from autopilot.payload.camera.camera_settings import REAL32, UINT8, UINT32, Settings

_PARAM_EXT_VALUE = known_type("PARAM_EXT_VALUE")
_PARAM_EXT_ACK = known_type("PARAM_EXT_ACK")
_LAYOUTS = {UINT8: struct.Struct("<B"), UINT32: struct.Struct("<I"), REAL32: struct.Struct("<f")}
_VALUE_BYTES = 128

Replies = Callable[[Sender, MessageType, bytes], None]


class SettingsService:
    """Reads and sets the settings of one camera.

    Args:
        settings: of the camera.
        reply: sends a message of the camera to whoever asked.
    """

    def __init__(self, settings: Settings, reply: Replies) -> None:
        self._settings = settings
        self._reply = reply

    def messages(self) -> Mapping[str, Handler]:
        return {
            "PARAM_EXT_REQUEST_LIST": self.list_requested,
            "PARAM_EXT_REQUEST_READ": self.read_requested,
            "PARAM_EXT_SET": self.set_requested,
        }

    def list_requested(self, sender: Sender, _: Any) -> None:
        """Sends every setting of the camera."""
        for name in self._settings.names:
            self._send(sender, name)

    def read_requested(self, sender: Sender, fields: Any) -> None:
        """Sends one setting, by name or index; nothing if there is none such."""
        names = self._settings.names
        name = fields.param_id
        if 0 <= fields.param_index < len(names):
            name = names[fields.param_index]
        if self._settings.declared(name) is not None:
            self._send(sender, name)

    def set_requested(self, sender: Sender, fields: Any) -> None:
        """Changes a setting, and acknowledges with the value it has now."""
        name = fields.param_id
        setting = self._settings.declared(name)
        if setting is None or fields.param_type != setting.kind:
            result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED if setting else mavlink.PARAM_ACK_FAILED
            payload = _PARAM_EXT_ACK.pack(name, fields.param_value, fields.param_type, result)
            self._reply(sender, _PARAM_EXT_ACK, payload)
            return
        layout = _LAYOUTS[setting.kind]
        (value,) = layout.unpack(fields.param_value.ljust(_VALUE_BYTES, b"\0")[: layout.size])
        is_taken = self._settings.set(name, float(value))
        result = mavlink.PARAM_ACK_ACCEPTED if is_taken else mavlink.PARAM_ACK_VALUE_UNSUPPORTED
        self._reply(sender, _PARAM_EXT_ACK, _PARAM_EXT_ACK.pack(name, self._bytes(name), setting.kind, result))

    def _send(self, sender: Sender, name: str) -> None:
        names, setting = self._settings.names, self._settings.declared(name)
        if setting is not None:
            payload = _PARAM_EXT_VALUE.pack(name, self._bytes(name), setting.kind, len(names), names.index(name))
            self._reply(sender, _PARAM_EXT_VALUE, payload)

    def _bytes(self, name: str) -> bytes:
        setting = self._settings.declared(name)
        kind = UINT32 if setting is None else setting.kind
        value = self._settings[name]
        return _LAYOUTS[kind].pack(value if kind == REAL32 else int(value)).ljust(_VALUE_BYTES, b"\0")
