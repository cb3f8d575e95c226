"""The parameter protocol: list, read, set.

In: requests of clients, and changes made inside the vehicle. Out: PARAM_VALUE. The list is sent a few values per
frame, per channel, and starts again when it is asked for again.
"""

import zlib
from collections.abc import Iterable, Mapping
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Channel, Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.param_file import ParamEntry

VALUES_PER_FRAME = 20  # 1000 values/s per channel; guess at what a client's receive buffer takes
QUIET_US = 500_000  # between two requests of a script that waits for each answer; guess
NOT_IN_LIST = 65_535  # index of a value nobody asked for
HASH_NAME = "_HASH_CHECK"

_PARAM_VALUE = known_type("PARAM_VALUE")
_PARAM_ERROR = known_type("PARAM_ERROR")


class ParameterService(Service):
    """Serves the vehicle's parameter table."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._view = endpoint.parameters
        self._next_index: dict[Channel, int] = {}  # lists under way
        self._setting = ""  # the answer tells of this change
        self._also_changed: dict[str, None] = {}  # the other names of what clients have set, told later,
        self._quiet_until_us = 0  # once they have asked for nothing for a while
        self._view.on_change(self._changed)

    def messages(self) -> Mapping[str, Handler]:
        return {
            "PARAM_REQUEST_LIST": self.list_requested,
            "PARAM_REQUEST_READ": self.read_requested,
            "PARAM_SET": self.set_requested,
        }

    def list_requested(self, sender: Sender, _: Any) -> None:
        """Sends every parameter, a few per frame; asked again, it starts again."""
        self._next_index[sender.channel] = 0

    def frame(self) -> None:
        """Sends the next values of the lists under way, and other names of what was set.

        Scripts take the next PARAM_VALUE for the answer to what they ask: nothing else comes between.
        """
        if self._also_changed and self._endpoint.time_us >= self._quiet_until_us:
            also_changed, self._also_changed = self._also_changed, {}
            for name in also_changed:
                self._changed(name)
        for channel, first in list(self._next_index.items()):
            last = min(first + VALUES_PER_FRAME, len(self._view))
            for i in range(first, last):
                self._endpoint.reply(Sender(channel, 0, 0), _PARAM_VALUE, self._value(self._view.names[i], i))
            if last == len(self._view):
                del self._next_index[channel]
            else:
                self._next_index[channel] = last

    def read_requested(self, sender: Sender, fields: Any) -> None:
        """Sends one parameter, by name or by index; PARAM_ERROR if there is none."""
        self._quiet_until_us = self._endpoint.time_us + QUIET_US
        name = fields.param_id
        if fields.param_index >= 0:
            if fields.param_index >= len(self._view):
                self._refuse(sender, "", fields.param_index, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
                return
            name = self._view.names[fields.param_index]
        if name == HASH_NAME:
            self._endpoint.reply(sender, _PARAM_VALUE, self._hash_value())
        elif name not in self._view:
            self._refuse(sender, name, -1, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        else:
            self._endpoint.reply(sender, _PARAM_VALUE, self._value(name, self._view.indices[name]))

    def set_requested(self, sender: Sender, fields: Any) -> None:
        """Sets a parameter to the nearest value it can have; tells everybody what it is now, under this name first."""
        self._quiet_until_us = self._endpoint.time_us + QUIET_US
        name = fields.param_id
        if name == HASH_NAME:  # the client has these values already: the list may stop
            self._next_index.pop(sender.channel, None)
            return
        if name not in self._view:
            self._refuse(sender, name, -1, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
            self._endpoint.text_once(Severity.WARNING, f"Parameter {name}: there is none of this name")
            return
        view = self._view
        asked = view.value_in(name, fields.param_value, fields.param_type)
        if asked is None:
            kind = "an integer" if view.is_integer(name) else "a real number"
            self._endpoint.text(Severity.WARNING, f"Parameter {name}: not set, it is {kind}")
        else:
            self._setting = name
            stored = view.set(name, asked)
            self._setting = ""
            if stored != asked:
                low, high = view.bounds(name)
                bounds = f"{low:g} to {high:g}"
                self._endpoint.text(Severity.NOTICE, f"Parameter {name}: {asked:g} asked, {stored:g} set ({bounds})")
        self._endpoint.broadcast(_PARAM_VALUE, self._value(name, view.indices[name]))

    def entries(self) -> list[ParamEntry]:
        """The list as numbers: what the values of PARAM_VALUE say."""
        view = self._view
        return [ParamEntry(name, view.param_type(name), view.value(name), view.default(name)) for name in view.names]

    def set_uploaded(self, values: Iterable[tuple[str, int, float]]) -> None:
        """Sets the parameters of a file: name, MAV_PARAM_TYPE and value; names it does not have are left out."""
        unknown = 0
        for name, _, value in values:
            if name in self._view:
                self._view.set(name, value)
            else:
                unknown += 1
        if unknown:
            self._endpoint.text(Severity.WARNING, f"Parameter file: {unknown} names are not known")

    def _changed(self, name: str) -> None:
        """Tells every client of a change that none of them asked for."""
        if self._setting:
            if name != self._setting:
                self._also_changed[name] = None
        else:
            self._endpoint.broadcast(_PARAM_VALUE, self._value(name, NOT_IN_LIST))

    def _value(self, name: str, index: int) -> bytes:
        view = self._view
        return _PARAM_VALUE.pack(name, view.bits(name), view.param_type(name), len(view), index)

    def _hash_value(self) -> bytes:
        """PX4's checksum over names and values, with which a client finds out whether its copy is still true."""
        view = self._view
        checksum = 0xFFFFFFFF  # zlib inverts at both ends; PX4's sum starts at 0 and is not inverted
        for name in view.names:
            checksum = zlib.crc32(view.bits(name).to_bytes(4, "little"), zlib.crc32(name.encode("ascii"), checksum))
        return _PARAM_VALUE.pack(
            HASH_NAME, checksum ^ 0xFFFFFFFF, mavlink.MAV_PARAM_TYPE_UINT32, len(view), NOT_IN_LIST
        )

    def _refuse(self, sender: Sender, name: str, index: int, error: int) -> None:
        payload = _PARAM_ERROR.pack(sender.sysid, sender.compid, name, index, error)
        self._endpoint.reply(sender, _PARAM_ERROR, payload)
