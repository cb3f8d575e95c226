"""Bank and pitch to body rates, and rates to surfaces, 250 Hz: PX4's fixed-wing loops.

A surface's torque grows with the square of the airspeed and the damping with the airspeed: what is asked of it is
scaled back, by the airspeed at which the gains hold (FW_AIRSPD_TRIM).
"""

import warp as wp

from autopilot.vehicles.plane.motion import Asked, Measured
from autopilot.vehicles.plane.params import PlaneParams
from common.geodesy import GRAVITY_M_S2

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_SLOWEST_M_S = wp.constant(3.0)
_STEEPEST_RAD = wp.constant(1.3)  # bank that a turn is coordinated for


@wp.func
def body_rates(params: PlaneParams, here: Measured, asked: Asked) -> wp.vec3:
    """[rad/s] Rates that lead to a bank and a pitch, in a coordinated turn."""
    roll_rate = (asked.roll - here.roll) / params.roll_time
    pitch_rate = (asked.pitch - here.pitch) / params.pitch_time
    bank = wp.clamp(here.roll, -_STEEPEST_RAD, _STEEPEST_RAD)
    turn_rate = _GRAVITY * wp.tan(bank) * wp.cos(here.pitch) / wp.max(here.airspeed, params.airspeed_min)
    sine, cosine = wp.sin(here.roll), wp.cos(here.roll)
    level = wp.cos(here.pitch)
    p = roll_rate - wp.sin(here.pitch) * turn_rate
    q = cosine * pitch_rate + level * sine * turn_rate
    r = -sine * pitch_rate + level * cosine * turn_rate
    return wp.vec3(
        wp.clamp(p, -params.roll_rate_max, params.roll_rate_max),
        wp.clamp(q, -params.pitch_down_rate_max, params.pitch_up_rate_max),
        wp.clamp(r, -params.yaw_rate_max, params.yaw_rate_max),
    )


@wp.func
def surfaces(
    params: PlaneParams, here: Measured, rate_sp: wp.vec3, integral: wp.vec3, is_held: int, dt: float
) -> tuple[wp.vec3, wp.vec3]:
    """Roll, pitch and yaw [-1..1], and the integrals.

    Args:
        params: gains.
        here: how it moves.
        rate_sp: [rad/s]
        integral: before.
        is_held: 1: the integrals stay zero.
        dt: [s]
    """
    scale = params.airspeed_trim / wp.clamp(here.airspeed, params.airspeed_min, params.airspeed_max)
    error = rate_sp - here.omega_frd
    ff = wp.vec3(params.roll_ff, params.pitch_ff, params.yaw_ff)
    gain = wp.vec3(params.roll_p, params.pitch_p, params.yaw_p)
    slow = wp.vec3(params.roll_i, params.pitch_i, params.yaw_i)
    most = wp.vec3(params.roll_imax, params.pitch_imax, params.yaw_imax)
    trim = wp.vec3(0.0, params.pitch_trim, 0.0)
    out = wp.vec3()
    kept = integral
    for k in range(3):
        wanted = scale * (ff[k] * rate_sp[k] + scale * (gain[k] * error[k] + kept[k] + trim[k]))
        out[k] = wp.clamp(wanted, -1.0, 1.0)
        if is_held == 1:
            kept[k] = 0.0
        elif (wanted - out[k]) * error[k] <= 0.0:
            kept[k] = wp.clamp(kept[k] + slow[k] * error[k] * dt, -most[k], most[k])
    return out, kept
