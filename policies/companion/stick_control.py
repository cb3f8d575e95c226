"""A rover driven by sticks: MANUAL_CONTROL in mode Position, for autopilots whose Offboard does not reverse.

Stock PX4 is one. In: a speed along the nose and a yaw rate. Out: the sticks that mean them by the vehicle's own
parameters, which are asked for. They are sent all the time: sticks that fall silent are a failsafe.
"""

import struct
from math import copysign, degrees
from typing import Any

from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT
from autopilot.mavlink.wire.number_bounds import PARAMETER_MAX, is_known
from policies.companion.engagement import Wish
from policies.companion.skills.skill import Velocity
from policies.companion.telemetry import NEVER_US
from policies.companion.vehicle_link import VehicleLink

SPEED, YAW_RATE, SPEED_DEAD, YAW_DEAD = "RO_SPEED_LIM", "RO_YAW_RATE_LIM", "MAN_DEADZONE", "RO_YAW_STICK_DZ"
ASK_US = 500_000
CENTRED_US = 500_000  # in the middle before Hold is asked for: sticks that move take over from it (COM_RC_OVERRIDE)
UNKNOWN = "what the vehicle's sticks mean is not known"
_FULL = 1000.0


class StickControl:
    """The sticks of one vehicle.

    Args:
        vehicle: that is driven.
    """

    def __init__(self, vehicle: VehicleLink) -> None:
        self._vehicle = vehicle
        self._numbers: dict[str, float | None] = dict.fromkeys((SPEED, YAW_RATE, SPEED_DEAD, YAW_DEAD))
        self._asked_us = NEVER_US
        self._hold_due_us: int | None = None
        vehicle.listen("PARAM_VALUE", self._parameter_reported)

    @property
    def trouble(self) -> str:
        """Why nothing can be driven by sticks; "" if it can."""
        numbers = self._numbers
        has_all = all(number is not None for number in numbers.values())
        return "" if has_all and (numbers[SPEED] or 0.0) > 0.0 and (numbers[YAW_RATE] or 0.0) > 0.0 else UNKNOWN

    def frame(self, time_us: int) -> None:
        """Asks for what is due, and for what is not known yet."""
        if not self._vehicle.is_flown:
            self._hold_due_us = None  # somebody else has chosen a mode meanwhile
        if self._hold_due_us is not None and time_us >= self._hold_due_us:
            self._hold_due_us = None
            self._vehicle.ask_for(Wish.HOLD)
        if self.trouble and self._vehicle.own.heartbeat_us != NEVER_US and time_us - self._asked_us > ASK_US:
            self._asked_us = time_us
            for name, number in self._numbers.items():
                if number is None:
                    self._vehicle.ask("PARAM_REQUEST_READ", param_id=name, param_index=-1)

    def hold(self, time_us: int) -> None:
        """Asks for Hold once the sticks have been in the middle for a while."""
        if self._hold_due_us is None:
            self._hold_due_us = time_us + CENTRED_US

    def send(self, setpoint: Velocity) -> None:
        """Sends the sticks of a speed along the nose and a yaw rate."""
        (speed, _, _), yaw_rate = setpoint
        if self.trouble:
            return
        way = -1.0 if speed < 0.0 else 1.0  # backwards the wheel turns the vehicle the other way
        throttle = self._deflection(speed, SPEED, SPEED_DEAD)
        steering = self._deflection(way * degrees(yaw_rate), YAW_RATE, YAW_DEAD)
        self._vehicle.send(
            "MANUAL_CONTROL",
            target=self._vehicle.system_id,
            x=0,
            y=round(_FULL * steering),
            z=round(0.5 * _FULL * (throttle + 1.0)),
            r=0,
            buttons=0,
        )

    def _deflection(self, value: float, limit: str, dead: str) -> float:
        """-1..1 of a stick for a value, past its dead zone."""
        fraction = min(max(value / (self._numbers[limit] or 1.0), -1.0), 1.0)
        zone = self._numbers[dead] or 0.0
        return copysign(zone + abs(fraction) * (1.0 - zone), fraction) if fraction else 0.0

    def _parameter_reported(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        is_vehicle = (sysid, compid) == (self._vehicle.system_id, AUTOPILOT_COMPONENT)
        if not is_vehicle or fields.param_id not in self._numbers:
            return
        (number,) = struct.unpack("<f", fields.param_value.to_bytes(4, "little"))  # all four are REAL32
        if is_known(PARAMETER_MAX, number):
            self._numbers[fields.param_id] = number
