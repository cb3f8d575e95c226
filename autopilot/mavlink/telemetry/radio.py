"""Telemetry of the pilot's sticks: joystick position and radio channels as the vehicle takes them."""

from autopilot.inputs.sticks import UNUSED
from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import i16

_rc_channels = known_type("RC_CHANNELS").pack
_rc_channels_raw = known_type("RC_CHANNELS_RAW").pack
_manual_control = known_type("MANUAL_CONTROL").pack

RAW_CHANNELS = 8
RSSI_UNKNOWN, RSSI_FULL, RSSI_NONE = 255, 100, 0  # ground stations show it as per cent


def rc_channels(state: VehicleState) -> bytes:
    """No channels until sticks are heard; in ArduPilot's dialect a simulated radio is, from the start."""
    channels = state.sticks.channels
    count = max((i + 1 for i, pulse_us in enumerate(channels) if pulse_us), default=0)
    return _rc_channels(boot_ms(state.time_us), count, *(pulse_us or UNUSED for pulse_us in channels), _rssi(state))


def rc_channels_raw(state: VehicleState) -> bytes:
    channels = state.sticks.channels[:RAW_CHANNELS]
    return _rc_channels_raw(boot_ms(state.time_us), 0, *(pulse_us or UNUSED for pulse_us in channels), _rssi(state))


def manual_control(state: VehicleState) -> bytes | None:
    """The sticks being flown; nothing until they are heard for the first time."""
    sticks = state.sticks
    if sticks.count == 0:
        return None
    x, y, r = (i16(1000.0 * value) for value in (sticks.pitch, sticks.roll, sticks.yaw))
    return _manual_control(0, x, y, i16(500.0 * (sticks.throttle + 1.0)), r, sticks.buttons)


def _rssi(state: VehicleState) -> int:
    if state.sticks.count == 0:
        return RSSI_UNKNOWN
    return RSSI_FULL if state.time_us <= state.sticks.heard_until_us else RSSI_NONE
