"""Position loop: a proportional correction of the trajectory's velocity, 50 Hz."""

import warp as wp

from autopilot.control.pid import clamp_horizontal
from autopilot.ports import Estimate
from autopilot.vehicles.multirotor.attitude import rate_lags_s
from autopilot.vehicles.multirotor.params import ControlParams
from autopilot.vehicles.multirotor.trajectory import TrajectoryState, flown_velocity, follows_position, within_speeds

wp.set_module_options({"enable_backward": False})

_CORRECTION_XY_M_S = wp.constant(3.0)  # guess: a large error is closed at this speed
_CORRECTION_Z_M_S = wp.constant(2.0)  # guess


@wp.func
def velocity_setpoint(params: ControlParams, trajectory: TrajectoryState, est: Estimate) -> wp.vec3:
    """Velocity [m/s], ned: the trajectory's plus the correction of its position error where position is controlled.

    A trajectory out of reach stands still, so that what remains points towards it. Level, the position is compared with
    where the vehicle can be by now, as late as its velocity.
    """
    vel_ned = flown_velocity(trajectory)
    lags_ned = wp.cw_mul(rate_lags_s(params), vel_ned)
    gain = wp.vec3(params.pos_p_xy, params.pos_p_xy, params.pos_p_z)
    correction = wp.vec3(0.0, 0.0, 0.0)
    for k in range(3):
        if follows_position(trajectory, k):
            correction[k] = gain[k] * (trajectory.pos_ned[k] - lags_ned[k] - est.pos_ned[k])
    correction = clamp_horizontal(correction, _CORRECTION_XY_M_S)
    correction[2] = wp.clamp(correction[2], -_CORRECTION_Z_M_S, _CORRECTION_Z_M_S)
    return within_speeds(params, vel_ned + correction)
