"""Betaflight's simulator link on the wire: states and sticks that it takes, motors that it gives; and its clock.

Facts: src/platform/SIMULATOR of Betaflight 4.6 (fdm_packet, rc_packet, servo_packet_raw). All is little-endian and
fixed in size; what has another size is not read. Its motors come in two packets; we take the raw one, whose order is
Betaflight's own in every version, at a port that no other autopilot uses.
"""

from collections.abc import Sequence
from math import isfinite
from struct import Struct
from typing import Any

from sim.boards.outside import PeerError

STATE = Struct("<18d")
STICKS = Struct("<d16H")
MOTORS = Struct("<Hxx16f")
MOTOR_COUNT = 4
MOTOR_OF_ROTOR = (1, 2, 3, 0)
"""Its motors (rear right, front right, rear left, front left) in our order: front right, rear left, front left, rear
right."""
_PULSE_LOW_US, _PULSE_SPAN_US = 1000.0, 1000.0


def motor_commands(data: bytes) -> list[float] | None:
    """The commands [0..1] of our motors in a datagram; None: it holds none.

    Raises:
        PeerError: it flies another number of motors.
    """
    if len(data) != MOTORS.size:
        return None
    count, *pulses_us = MOTORS.unpack(data)
    if count != MOTOR_COUNT:
        raise PeerError(f"Betaflight flies {count} motors, and the vehicle has {MOTOR_COUNT}: its mixer is another")
    chosen = [pulses_us[k] for k in MOTOR_OF_ROTOR]
    if not isfinite(sum(chosen)):
        return None
    return [min(max((pulse - _PULSE_LOW_US) / _PULSE_SPAN_US, 0.0), 1.0) for pulse in chosen]


def state_packet(stamp_s: float, gyro_frd: Any, accel_frd: Any, q_ned_from_frd: Any, pressure_pa: float) -> bytes:
    """What it knows of the vehicle: sensors, and an attitude that it takes as it is.

    Args:
        stamp_s: [s] what makes its clock run, see `PeerClock`.
        gyro_frd: [rad/s].
        accel_frd: [m/s²] specific force.
        q_ned_from_frd: x, y, z, w.
        pressure_pa: of the barometer.

    Raises:
        PeerError: a number is none.
    """
    right, forward, down = accel_frd[1], accel_frd[0], accel_frd[2]
    x, y, z, w = q_ned_from_frd
    # Acceleration as it is turned over there: -(forward, left, up). Position and velocity are of its GPS, which is off.
    numbers = (*gyro_frd, -forward, right, down, w, x, y, z, *(0.0,) * 6, pressure_pa)
    if not isfinite(sum(numbers)):
        raise PeerError("the body's state is not a number")
    return STATE.pack(stamp_s, *numbers)


def sticks_packet(stamp_s: float, channels_us: Sequence[int]) -> bytes:
    """The channels of its receiver, of which there are 16."""
    return STICKS.pack(stamp_s, *channels_us)


class PeerClock:
    """Stamps of states, by which its clock runs as we say.

    From each state to the next its clock runs at the rate that it has got of the last two: the difference of their
    stamps over that of their arrivals. So stamps that grow by a fraction of what the wall's clock does set that rate.
    """

    STEP_MAX_S = 1e-3  # two that arrive together, though they were sent apart, make it run the faster the larger it is
    STEP_MIN_S = 1e-9  # a stamp that stands changes nothing

    def __init__(self) -> None:
        self._stamp_s = 1.0
        self._sent_s = 0.0

    def stamp_s(self, rate: float, now_s: float) -> float:
        """The stamp of a state that is sent now, from whose arrival on its clock runs at this rate."""
        step_s = min(max(rate * (now_s - self._sent_s), self.STEP_MIN_S), self.STEP_MAX_S)
        self._sent_s = now_s
        self._stamp_s += step_s
        return self._stamp_s
