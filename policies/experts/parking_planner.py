"""The parking car's next command, found by driving it ahead in thought: motion primitives, rolled out by its own laws.

A primitive turns so many degrees (in place or on the move) and then drives a stretch, ahead or back, or waits. Every
primitive is driven with the task's own motion, contacts and, where obstacles move, their moves; what crashes is out; of
the others the one wins that is soonest at the target: its time, and the field's way (parking_field.py) from its end.
Asked anew every few hundredths of a second this is a receding-horizon search of hybrid states (x, z, yaw, velocity)
guided by the field: hybrid A* cut off after one expansion. Where a spot asks for a pose, the last metres are an
analytic manoeuvre, itself driven in thought first: to the position where the car can turn on the spot, then turned.
"""

import warp as wp

from policies.experts.parking_field import Target, way_at
from policies.tasks.parking.arena import forward_of, position_of, right_of
from policies.tasks.parking.car import DT
from policies.tasks.parking.drive import Command, Motion, moved, wrapped
from policies.tasks.parking.episode_end import is_in_pose
from policies.tasks.parking.movers import movers_touch, ran, turned_back
from policies.tasks.parking.parking_params import CarParams, Level2Params
from policies.tasks.parking.scene import CLEAR, OBSTACLE, PAD, PORTAL, Scene, contact_of
from policies.tasks.parking.settings import PUSH_OR_TURN, STEER, STEER_AND_SHIFT, Rules

wp.set_module_options({"enable_backward": False})

_STEER, _PUSH_OR_TURN, _STEER_AND_SHIFT = (wp.constant(k) for k in (STEER, PUSH_OR_TURN, STEER_AND_SHIFT))

AHEAD = wp.constant(0)  # kinds of primitives: turn on the spot, then drive ahead
MOVING = wp.constant(1)  # turn while being pushed, then drive ahead
BACK = wp.constant(2)  # turn on the spot, then drive back
WAIT = wp.constant(3)  # do nothing
_KINDS = wp.constant(4)

_STRETCH_M = wp.constant(2.5)  # guess: how far a primitive drives after its turn
_MOST_DECISIONS = wp.constant(120)  # guess: no primitive or manoeuvre takes longer
_STOP_S = wp.constant(0.3)  # guess: after its stretch a primitive must be able to stop
_CRASH = wp.constant(1.0e6)
_BACK_COST_S = wp.constant(0.3)  # guess: ahead is preferred where it makes no difference
_CHANGE_COST_S = wp.constant(0.4)  # guess: more than what the field is wrong by
_WAIT_COST_S = wp.constant(10.0)  # guess: only where nothing else is free of contacts
_SHOT_M = wp.constant(5.0)  # guess: within this the last manoeuvre is tried
_PLAN_TICKS = wp.constant(3)  # a plan is followed for 60 ms; guess: movers get 0.12 m further
_SHOTS = wp.constant(7)  # the direct one, and by way of positions 1, 2 and 3 m before and behind


@wp.struct
class Situation:
    """What a row is in."""

    scene: Scene  # of the storey the car is on
    has_movers: wp.bool  # the scene's obstacles are level 2's, which move
    more: Level2Params  # how they do
    target: Target
    storey: int
    through_portal: wp.bool  # the target is the portal
    needs_pose: wp.bool  # the target asks for a heading, and for standing still


@wp.struct
class Plan:
    """What a row is about to do."""

    turn: float  # right +1, left -1
    turn_count: int  # decisions
    kind: int
    cost_s: float


@wp.struct
class Memory:
    """What a row has set out to do."""

    plan: Plan  # what is left of it
    has_plan: wp.bool
    age: int  # decisions since it was last compared with others
    shot: int  # the manoeuvre that was begun, or -1


@wp.func
def coasting(vel: wp.vec2, params: CarParams) -> wp.vec2:
    """How far a car rolls that is not pushed any more [m]."""
    keep = wp.max(0.0, 1.0 - params.drag_per_s * DT)
    return vel * (DT * keep / wp.max(1.0 - keep, 0.01))


@wp.func
def cruise_m_s(rules: Rules, params: CarParams) -> float:
    """Mean speed of a car that is pushed at every decision."""
    keep = wp.max(0.0, 1.0 - params.drag_per_s * DT)
    push = params.push_n / params.mass_kg * DT
    fraction = wp.where(rules.is_held or rules.actions == _STEER, 1.0, 1.0 / float(rules.tick_count))
    return wp.max(fraction * push * keep / wp.max(1.0 - keep, 0.01), 0.01)


@wp.func
def plan_command(plan: Plan, decision: int, rules: Rules) -> Command:
    """What a plan does at its k-th decision."""
    command = Command()
    is_turning = decision < plan.turn_count
    command.turn = wp.where(is_turning, plan.turn, 0.0)
    if is_turning:
        command.push = wp.where(plan.kind == MOVING, 1.0, 0.0)
    else:
        command.push = wp.where(plan.kind == BACK, -1.0, wp.where(plan.kind == WAIT, 0.0, 1.0))
    if rules.actions == _STEER:
        command.push = 1.0
        command.always = 1.0
    return command


@wp.func
def is_kind_possible(kind: int, turn_count: int, rules: Rules) -> bool:
    """Whether the task's actions can do it, and it is worth a try."""
    if rules.actions == _STEER:
        return kind == MOVING
    if rules.actions == _PUSH_OR_TURN:
        return kind == AHEAD
    if kind == BACK:
        return rules.actions == _STEER_AND_SHIFT
    return turn_count > 0 or kind != MOVING


@wp.func
def moved_on(scene: Scene, now: Situation) -> Scene:
    """The scene one tick later. That two movers have touched already is taken from where they are."""
    out = scene
    if now.has_movers:
        first = ran(scene.obstacles[0], now.storey, now.more)
        second = ran(scene.obstacles[1], now.storey, now.more)
        if movers_touch(first, second, now.more):
            if not movers_touch(scene.obstacles[0], scene.obstacles[1], now.more):
                first = turned_back(first)
                second = turned_back(second)
        out.obstacles[0] = first
        out.obstacles[1] = second
    return out


@wp.func
def is_crash(contact: int, through_portal: bool) -> bool:
    """Whether a contact is one that the plan does not want."""
    if contact == PORTAL:
        return not through_portal
    return contact > CLEAR and contact <= OBSTACLE


@wp.func
def is_arrival(contact: int, motion: Motion, now: Situation, params: CarParams) -> bool:
    """Whether a contact, or a position, is what the plan is after."""
    if now.through_portal:
        return contact == PORTAL
    if now.needs_pose:
        gap = motion.pos + coasting(motion.vel, params) - position_of(now.target.pose)
        return wp.length(gap) < 0.5 * params.reach_m
    return contact == PAD


@wp.func
def time_left(
    way: wp.array3d(dtype=float), i: int, motion: Motion, now: Situation, rules: Rules, params: CarParams
) -> float:
    """From here on: the field's way, and the turn into its direction [s]."""
    field = way_at(way, i, now.storey, motion.pos + coasting(motion.vel, params))
    seconds = field[0] / cruise_m_s(rules, params)
    downhill = wp.vec2(-field[1], -field[2])
    if wp.length(downhill) > 0.1:
        bearing = wp.atan2(downhill[0], downhill[1])
        turn = wp.abs(wrapped(bearing - motion.yaw))
        turn_s = turn / wp.radians(params.turn_deg) * float(rules.tick_count) * DT
        if rules.actions == _STEER_AND_SHIFT:
            turn_s = wp.min(turn_s, (wp.pi - turn) / wp.max(turn, 0.01) * turn_s + 1.0)
        seconds += turn_s
    return seconds


@wp.func
def rolled_out(
    plan: Plan, way: wp.array3d(dtype=float), i: int, start: Motion, now: Situation, rules: Rules, params: CarParams
) -> float:
    """What a primitive costs [s]: its time and what is left after it; a crash costs most, a late one a little less."""
    motion = start
    scene = now.scene
    decision_s = float(rules.tick_count) * DT
    stretch = int(wp.ceil(_STRETCH_M / (cruise_m_s(rules, params) * decision_s)))
    stop = int(wp.ceil(_STOP_S / decision_s))
    count = wp.min(plan.turn_count + stretch, _MOST_DECISIONS)
    seconds = float(0.0)
    cost = float(-1.0)
    for decision in range(count + stop):
        command = plan_command(plan, decision, rules)
        if decision == count and cost < 0.0:
            cost = seconds + time_left(way, i, motion, now, rules, params)
        if decision >= count and rules.actions != _STEER:
            command.push = 0.0
            command.turn = 0.0
        for tick in range(rules.tick_count):
            motion = moved(motion, command, rules.is_held or tick == 0, params)
            seconds += DT
            scene = moved_on(scene, now)
            contact = contact_of(motion.pose, scene, params)
            if is_crash(contact, now.through_portal):
                return _CRASH - seconds
            if decision < count and is_arrival(contact, motion, now, params):
                return seconds
    return cost


@wp.func
def one_push_m(rules: Rules, params: CarParams) -> float:
    """How far a car at rest gets by the push of one decision."""
    pushes = wp.where(rules.is_held, float(rules.tick_count), 1.0)
    return wp.length(coasting(wp.vec2(pushes * params.push_n / params.mass_kg * DT, 0.0), params))


@wp.func
def shot_command(motion: Motion, now: Situation, offset_m: float, rules: Rules, params: CarParams) -> Command:
    """The analytic manoeuvre: straight to a position on the spot's axis, there into its direction, along it to the end.

    Args:
        motion: the car.
        now: what it is in.
        offset_m: of that position ahead of the end; 0: the car turns at the end itself.
        rules: what its actions do.
        params: of the car.
    """
    command = Command()
    target = now.target.pose
    end = position_of(target) - motion.pos - coasting(motion.vel, params)
    error = wrapped(wp.atan2(target[2], target[3]) - motion.yaw)
    one_push = one_push_m(rules, params)
    slack = wp.clamp(0.55 * one_push, 0.4 * params.reach_m, 0.85 * params.reach_m)
    is_in_direction = wp.abs(error) <= 0.6 * wp.radians(params.turn_deg)
    along = wp.dot(end, forward_of(target))
    if wp.length(end) < slack and (is_in_direction or offset_m == 0.0):
        if not is_in_direction or rules.actions == _PUSH_OR_TURN:
            command.turn = wp.sign(error)
        return command
    is_on_axis = offset_m != 0.0 and wp.abs(wp.dot(end, right_of(target))) < 0.5 * params.reach_m
    if is_on_axis and is_in_direction and along * offset_m < 0.0:
        command.push = wp.sign(along)
        return command
    gap = end + forward_of(target) * offset_m
    distance = wp.length(gap)
    if distance < slack:
        command.turn = wp.sign(error)
        return command
    error = wrapped(wp.atan2(gap[0], gap[1]) - motion.yaw)
    command.push = 1.0
    if rules.actions == _STEER_AND_SHIFT and wp.abs(error) > 0.5 * wp.pi:
        error = wrapped(error + wp.pi)
        command.push = -1.0
    if wp.abs(error) > wp.max(0.6 * wp.radians(params.turn_deg), 0.2 * params.reach_m / distance):
        command.turn = wp.sign(error)
        command.push = 0.0
    return command


@wp.func
def is_shot_free(start: Motion, now: Situation, offset_m: float, rules: Rules, params: CarParams) -> bool:
    """Whether the manoeuvre ends in the pose without a contact."""
    motion = start
    scene = now.scene
    for _decision in range(2 * _MOST_DECISIONS):
        command = shot_command(motion, now, offset_m, rules, params)
        for tick in range(rules.tick_count):
            motion = moved(motion, command, rules.is_held or tick == 0, params)
            scene = moved_on(scene, now)
            contact = contact_of(motion.pose, scene, params)
            if is_crash(contact, False):
                return False
            if contact == PAD and is_in_pose(motion, now.scene.goal, params):
                return True
    return False


@wp.func
def shot_offset(k: int) -> float:
    """The manoeuvres in the order in which they are tried [m]."""
    side = wp.where(k % 2 == 0, 1.0, -1.0)
    return wp.where(k == 0, 0.0, -side * float((k + 1) // 2))


@wp.func
def best_plan(
    memory: Memory,
    angles_rad: wp.array(dtype=float),
    way: wp.array3d(dtype=float),
    i: int,
    motion: Motion,
    now: Situation,
    rules: Rules,
    params: CarParams,
) -> Plan:
    """The cheapest primitive; a turn, or a way back, that was begun goes on unless another is cheaper by far."""
    best = memory.plan
    best.cost_s = 2.0 * _CRASH
    if memory.has_plan:
        best.cost_s = rolled_out(best, way, i, motion, now, rules, params) - _CHANGE_COST_S
    for j in range(angles_rad.shape[0]):
        for kind in range(_KINDS):
            plan = Plan()
            plan.turn = wp.sign(angles_rad[j])
            plan.turn_count = int(wp.round(wp.abs(angles_rad[j]) / wp.radians(params.turn_deg)))
            plan.kind = kind
            if is_kind_possible(kind, plan.turn_count, rules) and (kind != WAIT or j == 0):
                plan.cost_s = rolled_out(plan, way, i, motion, now, rules, params)
                if kind == BACK:
                    plan.cost_s += _BACK_COST_S
                if kind == WAIT:
                    plan.cost_s += _WAIT_COST_S
                if plan.cost_s < best.cost_s:
                    best = plan
    return best


@wp.func
def is_shot_possible(k: int, motion: Motion, now: Situation, rules: Rules, params: CarParams) -> bool:
    """Whether the task's actions can do the k-th manoeuvre from here, without a contact."""
    offset_m = shot_offset(k)
    if offset_m > 0.0 and rules.actions != _STEER_AND_SHIFT:
        return False
    return is_shot_free(motion, now, offset_m, rules, params)


@wp.func
def chosen_shot(begun: int, motion: Motion, now: Situation, rules: Rules, params: CarParams) -> int:
    """The manoeuvre that was begun, as long as it is free; else the first that is; or -1."""
    if not now.needs_pose or wp.length(position_of(now.target.pose) - motion.pos) > _SHOT_M:
        return -1
    if begun >= 0 and is_shot_possible(begun, motion, now, rules, params):
        return begun
    for k in range(_SHOTS):
        if is_shot_possible(k, motion, now, rules, params):
            return k
    return -1


@wp.func
def next_command(
    angles_rad: wp.array(dtype=float),
    way: wp.array3d(dtype=float),
    memories: wp.array(dtype=Memory),
    i: int,
    motion: Motion,
    now: Situation,
    rules: Rules,
    params: CarParams,
) -> Command:
    """What to do now."""
    memory = memories[i]
    memory.shot = chosen_shot(memory.shot, motion, now, rules, params)
    command = Command()
    if memory.shot >= 0:
        memory.age = 0
        memory.has_plan = False
        command = shot_command(motion, now, shot_offset(memory.shot), rules, params)
    else:
        if memory.age == 0:
            memory.plan = best_plan(memory, angles_rad, way, i, motion, now, rules, params)
            memory.has_plan = memory.plan.turn_count > 1 or memory.plan.kind == BACK
        command = plan_command(memory.plan, 0, rules)
        memory.plan.turn_count = wp.max(memory.plan.turn_count - 1, 0)
        memory.age += 1
        if memory.age * rules.tick_count >= _PLAN_TICKS:
            memory.age = 0
    memories[i] = memory
    return command


@wp.func
def write_command(branches: wp.array2d(dtype=int), i: int, command: Command, rules: Rules) -> None:
    """The command as the task's choices."""
    branches[i, 0] = wp.where(command.turn > 0.0, 1, wp.where(command.turn < 0.0, 2, 0))
    if rules.actions != _STEER and rules.actions != _PUSH_OR_TURN:
        branches[i, 1] = wp.where(command.push > 0.0, 1, wp.where(command.push < 0.0, 2, 0))
