"""Telemetry of the board and its speed controllers: what ArduPilot's stations ask of the hardware.

A simulated board has a regulator and a memory that nothing loads: their figures are constants, so that the same flight
sends the same bytes. The speed controllers' are measured.
"""

from math import pi

from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import UINT16_MAX, i16, u16
from common.kernels import FRAME_US

BOARD_MILLIVOLT = 5_000
FREE_BYTES = 131_072
_PER_MESSAGE = 4  # speed controllers
_RPM = 60.0 / (2.0 * pi)  # per rad/s

_power_status = known_type("POWER_STATUS").pack
_meminfo = known_type("MEMINFO").pack
_hwstatus = known_type("HWSTATUS").pack
_mcu_status = known_type("MCU_STATUS").pack
_esc_1_to_4 = known_type("ESC_TELEMETRY_1_TO_4").pack
_esc_5_to_8 = known_type("ESC_TELEMETRY_5_TO_8").pack


def power_status(_: VehicleState) -> bytes:
    """The board's supply: 5 V, no servo rail, no flags."""
    return _power_status(BOARD_MILLIVOLT, 0, 0)


def meminfo(_: VehicleState) -> bytes:
    """Free memory: a constant, since a process takes what it needs."""
    return _meminfo(0, min(FREE_BYTES, UINT16_MAX), FREE_BYTES)


def hwstatus(_: VehicleState) -> bytes:
    """The board's supply, and errors on its bus (the old message)."""
    return _hwstatus(BOARD_MILLIVOLT, 0)


def mcu_status(state: VehicleState) -> bytes:
    """The processor's supply, and the temperature on the board as the barometer measures it."""
    temperature = i16(state.samples.baro.temperature_c * 100.0)
    return _mcu_status(0, temperature, BOARD_MILLIVOLT, BOARD_MILLIVOLT, BOARD_MILLIVOLT)


def esc_telemetry_1_to_4(state: VehicleState) -> bytes | None:
    """How fast motors 1 to 4 turn, and the voltage of the pack; currents and temperatures are not measured."""
    return _esc_telemetry(state, 0)


def esc_telemetry_5_to_8(state: VehicleState) -> bytes | None:
    """The same of motors 5 to 8, where there are that many."""
    return _esc_telemetry(state, _PER_MESSAGE)


def _esc_telemetry(state: VehicleState, first: int) -> bytes | None:
    if state.read_motor_speeds is None or state.motor_count <= first:
        return None
    speeds = list(state.read_motor_speeds()[first : min(state.motor_count, first + _PER_MESSAGE)])
    count, spare = len(speeds), (0,) * (_PER_MESSAGE - len(speeds))
    zeros = (0,) * _PER_MESSAGE
    pack = _esc_1_to_4 if first == 0 else _esc_5_to_8
    return pack(
        zeros,
        (u16(state.samples.battery.voltage_v * 100.0),) * count + spare,
        zeros,
        zeros,
        tuple(u16(speed * _RPM) for speed in speeds) + spare,
        (state.time_us // FRAME_US & UINT16_MAX,) * count + spare,
    )
