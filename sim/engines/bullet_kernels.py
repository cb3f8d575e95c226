"""What a vehicle brings to Bullet, and takes from it, each millisecond: force and torque, and the motion they made.

Bullet moves a body by the velocity that it has after a step (semi-implicit Euler), we by the mean of those before and
after. So Bullet's pose is kept half a step ahead of ours, where the mean of two of ours lies; then both are the same.
"""

from functools import cache
from typing import Any, NamedTuple

import warp as wp

from common.geodesy import GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S, vec8
from common.rng import draw_tick
from sim.bodies.body import Body
from sim.bodies.rigid_body import turned_by
from sim.engines.bullet_body import BulletBody
from sim.truth import Truth
from sim.world.world import World, ground_height, surface_height, world_at

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_AHEAD_S = wp.constant(0.5 * TICK_S / SUBSTEPS)


@wp.struct
class BulletRow:
    """One vehicle on its way between Bullet and us, in Bullet's axes: north, west, up and forward, left, up."""

    pos: wp.vec3  # [m]
    q: wp.quat
    vel: wp.vec3  # [m/s]
    omega: wp.vec3  # [rad/s] in the world
    force_flu: wp.vec3  # [N] to Bullet
    torque_flu: wp.vec3  # [N m]


class BulletKernels(NamedTuple):
    """The launches of a tick, in time order; `push` and `take` once a millisecond."""

    put: Any
    begin: Any
    push: Any
    take: Any
    end: Any


@wp.func
def flipped(v: wp.vec3) -> wp.vec3:
    """Ned from nwu, frd from flu, and back."""
    return wp.vec3(v[0], -v[1], -v[2])


@wp.func
def flipped_turn(q: wp.quat) -> wp.quat:
    """Ned from frd, of nwu from flu, and back."""
    return wp.quat(q[0], -q[1], -q[2], q[3])


@wp.func
def row_of(state: Any) -> BulletRow:
    """Where and how Bullet has to have a body."""
    row = BulletRow()
    row.pos = flipped(state.pos_ned + _AHEAD_S * state.vel_ned)
    row.q = flipped_turn(turned_by(state.q_ned_from_frd, _AHEAD_S * state.omega_frd))
    row.vel = flipped(state.vel_ned)
    row.omega = flipped(wp.quat_rotate(state.q_ned_from_frd, state.omega_frd))
    return row


@wp.func
def moved(state: Any, row: BulletRow) -> Any:
    """What Bullet has made of a body: its motion, and what the IMU felt of the tick so far."""
    part_of_tick = 1.0 / float(SUBSTEPS)
    vel_ned = flipped(row.vel)
    felt_ned = (vel_ned - state.vel_ned) / _SUBSTEP_S - wp.vec3(0.0, 0.0, GRAVITY_M_S2)
    middle_q = turned_by(state.q_ned_from_frd, _AHEAD_S * state.omega_frd)  # along which it was pushed
    ahead_q = flipped_turn(row.q)
    omega_frd = wp.quat_rotate_inv(ahead_q, flipped(row.omega))
    state.accel_frd += part_of_tick * wp.quat_rotate_inv(middle_q, felt_ned)
    state.gyro_frd += (0.5 * part_of_tick) * (state.omega_frd + omega_frd)
    state.pos_ned = flipped(row.pos) - _AHEAD_S * vel_ned
    state.vel_ned = vel_ned
    state.q_ned_from_frd = turned_by(ahead_q, -_AHEAD_S * omega_frd)
    state.omega_frd = omega_frd
    return state


@wp.func
def at_tick_start(state: Any, ground_m: float) -> Any:
    """Nothing is felt of the tick yet."""
    state.height_agl_m = -state.pos_ned[2] - ground_m
    state.accel_frd = wp.vec3()
    state.gyro_frd = wp.vec3()
    state.is_on_ground = 0
    return state


@wp.func
def above_ground(state: Any, ground_m: float) -> Any:
    """What is under ground, which has no thickness, or out of the map, has crashed and lies there."""
    under_m = state.pos_ned[2] + ground_m
    if under_m > 0.0:
        state.impact_speed = wp.max(state.impact_speed, wp.length(state.vel_ned))
        state.is_crashed = 1
        state.pos_ned = state.pos_ned - wp.vec3(0.0, 0.0, under_m)
        state.height_agl_m = 0.0
        state.vel_ned = wp.vec3()
        state.omega_frd = wp.vec3()
    return state


def bullet_kernels(body: Body, part: BulletBody) -> BulletKernels:
    """Those of a class of bodies. One that is held in hands has its tick at the beginning, and Bullet no part in it."""
    put, take = _motion_kernels(body.State)
    begin, end = _tick_kernels(body, part)
    return BulletKernels(put, begin, _push_kernel(body, part), take, end)


@cache
def _motion_kernels(state_type: type) -> tuple[Any, Any]:
    @wp.kernel(enable_backward=False, module="unique")
    def put(states: wp.array(dtype=state_type), rows: wp.array(dtype=BulletRow)) -> None:
        i = wp.tid()
        rows[i] = row_of(states[i])

    @wp.kernel(enable_backward=False, module="unique")
    def take(states: wp.array(dtype=state_type), rows: wp.array(dtype=BulletRow)) -> None:
        i = wp.tid()
        if states[i].is_held == 0:
            states[i] = moved(states[i], rows[i])

    return put, take


@cache
def _push_kernel(body: Body, part: BulletBody) -> Any:
    model_type, state_type, inputs_type, wrench = body.Model, body.State, part.Inputs, part.wrench

    @wp.kernel(enable_backward=False, module="unique")
    def push(
        models: wp.array(dtype=model_type),
        states: wp.array(dtype=state_type),
        all_inputs: wp.array(dtype=inputs_type),
        rows: wp.array(dtype=BulletRow),
    ) -> None:
        i = wp.tid()
        if states[i].is_held == 0:
            pushed, inputs, force_frd, torque_frd = wrench(models[i], states[i], all_inputs[i])
            states[i] = pushed
            all_inputs[i] = inputs
            rows[i].force_flu = flipped(force_frd)
            rows[i].torque_flu = flipped(torque_frd)

    return push


@cache
def _tick_kernels(body: Body, part: BulletBody) -> tuple[Any, Any]:
    model_type, state_type, inputs_type = body.Model, body.State, part.Inputs
    body_tick, truth_of, part_begin, part_end = body.tick, body.truth, part.begin, part.end

    @wp.kernel(enable_backward=False, module="unique")
    def begin(
        models: wp.array(dtype=model_type),
        states: wp.array(dtype=state_type),
        worlds: wp.array(dtype=World),
        i_world: wp.array(dtype=int),
        commands: wp.array(dtype=vec8),
        wind_ned: wp.array(dtype=wp.vec3),
        ticks: wp.array(dtype=wp.int64),
        all_inputs: wp.array(dtype=inputs_type),
    ) -> None:
        i = wp.tid()
        world = world_at(worlds[i_world[i]], draw_tick(ticks[i]))
        state = states[i]
        if state.is_held == 1:
            states[i] = body_tick(models[i], state, commands[i], wind_ned[i], world)
        else:
            state = at_tick_start(state, surface_height(world, state.pos_ned))
            begun, inputs = part_begin(models[i], state, commands[i], wind_ned[i], world)
            states[i] = begun
            all_inputs[i] = inputs

    @wp.kernel(enable_backward=False, module="unique")
    def end(
        models: wp.array(dtype=model_type),
        states: wp.array(dtype=state_type),
        worlds: wp.array(dtype=World),
        i_world: wp.array(dtype=int),
        all_inputs: wp.array(dtype=inputs_type),
        truths: wp.array(dtype=Truth),
    ) -> None:
        i = wp.tid()
        state = states[i]
        if state.is_held == 0:
            ground_m = ground_height(worlds[i_world[i]], state.pos_ned[0], state.pos_ned[1])
            states[i] = part_end(models[i], above_ground(state, ground_m), all_inputs[i])
        truths[i] = truth_of(states[i])

    return begin, end
