"""How a plane moves, as its loops measure it, and what the outer loops ask of the inner ones."""

import warp as wp

from autopilot.ports import AIRSPEED_VALID, Estimate
from autopilot.vehicles.plane.params import PlaneParams
from common.rotation import yaw_from_quat

wp.set_module_options({"enable_backward": False})


@wp.struct
class Measured:
    """The estimate, as a plane's loops see it."""

    pos_ned: wp.vec2  # [m]
    vel_ned: wp.vec2  # [m/s] over ground
    height: float  # [m] over the origin
    climb: float  # [m/s]
    airspeed: float  # [m/s] indicated; that of trim where none is measured
    has_airspeed: int
    accel: float  # [m/s²] along the nose, gravity removed
    roll: float  # [rad]
    pitch: float
    yaw: float
    omega_frd: wp.vec3  # [rad/s]


@wp.struct
class Asked:
    """What the inner loops follow."""

    roll: float  # [rad]
    pitch: float
    throttle: float  # [0..1]


@wp.func
def measured(params: PlaneParams, est: Estimate) -> Measured:
    """The estimate as the loops use it."""
    now = Measured()
    q = est.q_ned_from_frd
    nose = wp.quat_rotate(q, wp.vec3(1.0, 0.0, 0.0))
    right = wp.quat_rotate(q, wp.vec3(0.0, 1.0, 0.0))
    below = wp.quat_rotate(q, wp.vec3(0.0, 0.0, 1.0))
    now.pos_ned = wp.vec2(est.pos_ned[0], est.pos_ned[1])
    now.vel_ned = wp.vec2(est.vel_ned[0], est.vel_ned[1])
    now.height = -est.pos_ned[2]
    now.climb = -est.vel_ned[2]
    now.accel = wp.dot(est.accel_ned, nose)
    now.roll = wp.atan2(right[2], below[2])
    now.pitch = -wp.asin(wp.clamp(nose[2], -1.0, 1.0))
    now.yaw = yaw_from_quat(q)
    now.omega_frd = est.omega_frd
    now.airspeed = params.airspeed_trim
    if (est.flags & AIRSPEED_VALID) != 0:
        now.airspeed = wp.max(est.airspeed, 0.0)
        now.has_airspeed = 1
    return now
