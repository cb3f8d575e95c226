"""From an action to motion: what each choice of a branch means, and one tick of the car under it."""

import warp as wp

from policies.tasks.episode import StepBuffers
from policies.tasks.layout import Branch
from policies.tasks.parking.arena import pose_at
from policies.tasks.parking.car import DT, damped_push
from policies.tasks.parking.parking_params import CarParams
from policies.tasks.parking.settings import PUSH_OR_TURN, STEER, STEER_AND_SHIFT, Rules

wp.set_module_options({"enable_backward": False})

_STEER = wp.constant(STEER)
_PUSH_OR_TURN = wp.constant(PUSH_OR_TURN)
_STEER_AND_SHIFT = wp.constant(STEER_AND_SHIFT)

BRANCHES = {
    "steer": (Branch("steer", ("none", "right", "left")),),
    "push-or-turn": (Branch("drive", ("push", "right", "left")),),
    "steer-and-drive": (Branch("steer", ("none", "right", "left")), Branch("drive", ("none", "forward"))),
    "steer-and-shift": (Branch("steer", ("none", "right", "left")), Branch("drive", ("none", "forward", "back"))),
}


@wp.struct
class Command:
    """What an applied action does in one tick."""

    turn: float  # right +1, left -1
    push: float  # forward +1, back -1
    always: float  # push of ticks in which no action is applied


@wp.struct
class Motion:
    """A car in the plane."""

    pos: wp.vec2  # [m] x and z of its origin
    vel: wp.vec2  # [m/s]
    yaw: float  # [rad]
    pose: wp.vec4


@wp.func
def command_of(buffers: StepBuffers, i: int, rules: Rules) -> Command:
    """The chosen action. A turn of `push-or-turn` leaves the push out."""
    command = Command()
    first = buffers.branches[i, 0]
    command.turn = wp.where(first == 1, 1.0, wp.where(first == 2, -1.0, 0.0))
    if rules.actions == _STEER:
        command.push = 1.0
        command.always = 1.0
    elif rules.actions == _PUSH_OR_TURN:
        command.push = wp.where(first == 0, 1.0, 0.0)
    else:
        second = buffers.branches[i, 1]
        command.push = wp.where(second == 1, 1.0, 0.0)
        if rules.actions == _STEER_AND_SHIFT and second == 2:
            command.push = -1.0
    return command


@wp.func
def moved(motion: Motion, command: Command, is_applied: bool, params: CarParams) -> Motion:
    """The car one tick later: turned at once, pushed along its new nose, damped, moved."""
    out = motion
    push = command.always
    if is_applied:
        push = command.push
        if command.turn != 0.0:
            out.yaw = wrapped(motion.yaw + command.turn * wp.radians(params.turn_deg))
            out.pose = pose_at(motion.pos, out.yaw)
    nose = wp.vec2(out.pose[2], out.pose[3])
    out.vel = damped_push(motion.vel, nose * (push * params.push_n / params.mass_kg), params.drag_per_s)
    out.pos = motion.pos + out.vel * DT
    out.pose = wp.vec4(out.pos[0], out.pos[1], out.pose[2], out.pose[3])
    return out


@wp.func
def wrapped(angle_rad: float) -> float:
    """The same angle in [-pi, pi], for a turn of less than a round."""
    return wp.where(
        angle_rad > wp.pi, angle_rad - 2.0 * wp.pi, wp.where(angle_rad < -wp.pi, angle_rad + 2.0 * wp.pi, angle_rad)
    )
