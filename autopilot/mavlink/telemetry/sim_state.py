"""Telemetry of the simulator's truth, for whoever compares: from the host, past the flight controller.

No part of the flight controller reads `Host.read_truth`; a vehicle that flies for real has none, and sends none of
these messages.
"""

from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import degrees_e7, i16, i32, wxyz_from_quat
from common.attitude import roll_pitch_yaw_of
from common.geodesy import GRAVITY_M_S2, geodetic_from_ned

_hil_state_quaternion = known_type("HIL_STATE_QUATERNION").pack
_simstate = known_type("SIMSTATE").pack
_sim_state = known_type("SIM_STATE").pack


def hil_state_quaternion(host: Host, state: VehicleState) -> bytes | None:
    """The simulator's truth, for comparison; the flight controller does not know it."""
    if host.read_truth is None:
        return None
    truth = host.read_truth()
    north, east, down = truth.pos_ned
    lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, state.origin)
    return _hil_state_quaternion(
        state.time_us,
        wxyz_from_quat(truth.q_ned_from_frd),
        *truth.omega_frd,
        degrees_e7(lat_deg),
        degrees_e7(lon_deg),
        i32(alt_m * 1000.0),
        *(i16(axis * 100.0) for axis in truth.vel_ned),
        0,
        0,
        *(i16(axis * 1000.0 / GRAVITY_M_S2) for axis in truth.accel_frd),
    )


def simstate(host: Host, state: VehicleState) -> bytes | None:
    """The simulator's true attitude, specific force, body rates and place, as ArduPilot's simulator tells them."""
    if host.read_truth is None:
        return None
    truth = host.read_truth()
    north, east, down = truth.pos_ned
    lat_deg, lon_deg, _ = geodetic_from_ned(north, east, down, state.origin)
    return _simstate(
        *roll_pitch_yaw_of(truth.q_ned_from_frd),
        *truth.accel_frd,
        *truth.omega_frd,
        degrees_e7(lat_deg),
        degrees_e7(lon_deg),
    )


def sim_state(host: Host, state: VehicleState) -> bytes | None:
    """The same with altitude and velocity; the deviations are 0, as the truth's are."""
    if host.read_truth is None:
        return None
    truth = host.read_truth()
    north, east, down = truth.pos_ned
    lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(north, east, down, state.origin)
    return _sim_state(
        *wxyz_from_quat(truth.q_ned_from_frd),
        *roll_pitch_yaw_of(truth.q_ned_from_frd),
        *truth.accel_frd,
        *truth.omega_frd,
        lat_deg,
        lon_deg,
        alt_amsl_m,
        0.0,
        0.0,
        *truth.vel_ned,
        degrees_e7(lat_deg),
        degrees_e7(lon_deg),
    )
