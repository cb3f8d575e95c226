"""Standard modes: which modes there are, which is flown, and how to choose one by its standard number.

In: requests of clients. Out: AVAILABLE_MODES in order, one message per mode; the rest is telemetry.
"""

from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.vehicle_state import Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.dialects import ModeRow
from autopilot.mavlink.service import Command, CommandHandler, RequestHandler, Service, denied
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import whole

_ALL = 0

_available_modes = known_type("AVAILABLE_MODES").pack


class ModeService(Service):
    """Lists the modes."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_SET_STANDARD_MODE: self._set_standard_mode}

    def requests(self) -> Mapping[str, RequestHandler]:
        return {"AVAILABLE_MODES": self._available}

    def _available(self, command: Command) -> Sequence[bytes] | Reply:
        """The modes: all of them, or the one whose number from 1 is in p2."""
        rows = self._endpoint.dialect.modes
        index = whole(command.p2, _ALL)
        if index == _ALL:
            return [self._row(rows, i) for i in range(len(rows))]
        if not 1 <= index <= len(rows):
            return denied(f"there are {len(rows)} modes")
        return [self._row(rows, index - 1)]

    def _row(self, rows: Sequence[ModeRow], i: int) -> bytes:
        row = rows[i]
        properties = mavlink.MAV_MODE_PROPERTY_ADVANCED if row.is_advanced else 0
        if not row.is_selectable:
            properties |= mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
        custom_mode = self._endpoint.dialect.custom_mode(row.mode)
        return _available_modes(len(rows), i + 1, row.standard_mode, custom_mode, properties, row.name)

    def _set_standard_mode(self, command: Command) -> Reply:
        """Changes to a mode by its standard number.

        Params: p1 MAV_STANDARD_MODE.
        Refused: DENIED for a number without a mode here; TEMPORARILY_REJECTED if the mode cannot be entered now.
        """
        number = whole(command.p1, 0)
        row = next((row for row in self._endpoint.dialect.modes if row.standard_mode == number and number), None)
        if row is None:
            return Reply(Verdict.DENIED, f"there is no standard mode {number}")
        return self._endpoint.vehicle.request(ChangeMode(row.mode))
