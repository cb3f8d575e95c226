"""How a rover moves, as its loops measure it, and what the outer loops ask of the inner ones."""

import warp as wp

from autopilot.ports import Estimate
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from common.rotation import yaw_from_quat

wp.set_module_options({"enable_backward": False})


@wp.struct
class Measured:
    """The estimate, along the nose and across it."""

    pos_ned: wp.vec2  # [m] of the centre of gravity
    axle_ned: wp.vec2  # [m] of the rear axle, which goes where the nose points
    nose_ned: wp.vec3
    ahead_ned: wp.vec2  # the nose over ground, of length 1
    yaw: float  # [rad]
    speed: float  # [m/s] along the nose
    side_speed: float  # [m/s] of the rear axle, to the right
    ground_speed: float  # [m/s] in any horizontal direction
    yaw_rate: float  # [rad/s]
    pos_std: float  # [m] horizontal


@wp.struct
class Asked:
    """What the inner loops follow."""

    speed: float  # [m/s] along the nose
    course: float  # [rad] of the nose
    course_rate: float  # [rad/s] at which it turns
    yaw_rate: float  # [rad/s]
    is_stop: int  # stand still
    is_rate: int  # follow `yaw_rate` and not `course`


@wp.func
def measured(airframe: RoverControlAirframe, est: Estimate, yaw_rate: float) -> Measured:
    """The estimate as the loops use it; `yaw_rate` is filtered [rad/s]."""
    now = Measured()
    now.nose_ned = wp.quat_rotate(est.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
    now.yaw = yaw_from_quat(est.q_ned_from_frd)
    now.ahead_ned = wp.vec2(wp.cos(now.yaw), wp.sin(now.yaw))
    now.pos_ned = wp.vec2(est.pos_ned[0], est.pos_ned[1])
    now.axle_ned = now.pos_ned - airframe.rear_m * now.ahead_ned
    now.speed = wp.dot(est.vel_ned, now.nose_ned)
    now.side_speed = now.ahead_ned[0] * est.vel_ned[1] - now.ahead_ned[1] * est.vel_ned[0] - airframe.rear_m * yaw_rate
    now.ground_speed = wp.length(wp.vec2(est.vel_ned[0], est.vel_ned[1]))
    now.yaw_rate = yaw_rate
    now.pos_std = est.pos_h_std
    return now


@wp.func
def right_of(ahead: wp.vec2, offset: wp.vec2) -> float:
    """How far an offset leads to the right of a direction of length 1."""
    return ahead[0] * offset[1] - ahead[1] * offset[0]
