"""ReachTarget's two kernels: they read a row, drive ten physics steps, judge, observe, and begin the next episode.

Frames are Unity's (x right, y up, z forward; yaw clockwise from +z seen from above). A decision is 0.2 s.
"""

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import (
    FELL,
    HIT_OTHER,
    RUNNING,
    SUCCESS,
    TIMEOUT,
    StepBuffers,
    begin_episode,
    close_step,
    open_frame,
)
from policies.tasks.reach_target.car_model import (
    SUBSTEPS,
    Motion,
    car_of,
    controls_of,
    driven,
    is_chassis_hit,
)
from policies.tasks.reach_target.reach_target_params import ReachParams
from policies.tasks.task import SPLITS

wp.set_module_options({"enable_backward": False})

STEPS = 10  # physics steps in a decision: the published decision period
OBSERVATIONS = ("world", "world-heading", "car", "ego")
REWARDS = ("sparse", "shaped", "shaped-each-step", "potential")
SUCCESSES = ("reach", "reach-goes-on", "pose")
RANGE_M = 50.0  # scale of the ego observation's distances: half the platform
NEAR_M = 5.0  # scale of its distance close by
SPEED_M_S = 10.0

_WORLD = wp.constant(OBSERVATIONS.index("world"))
_WORLD_HEADING = wp.constant(OBSERVATIONS.index("world-heading"))
_CAR = wp.constant(OBSERVATIONS.index("car"))
_SHAPED = wp.constant(REWARDS.index("shaped"))
_SHAPED_EACH_STEP = wp.constant(REWARDS.index("shaped-each-step"))
_POTENTIAL = wp.constant(REWARDS.index("potential"))
_GOES_ON = wp.constant(SUCCESSES.index("reach-goes-on"))
_POSE = wp.constant(SUCCESSES.index("pose"))
_STEPS = wp.constant(STEPS)
_SUBSTEPS = wp.constant(SUBSTEPS)
_RANGE = wp.constant(RANGE_M)
_NEAR = wp.constant(NEAR_M)
_SPEED = wp.constant(SPEED_M_S)
_RAD = wp.constant(0.017453292519943295)
_PI = wp.constant(3.141592653589793)
_TINY = wp.constant(1e-6)

_YAW_STREAM = wp.constant(1)
_TARGET_STREAM = wp.constant(64)  # and one more for each target that follows in the same episode
_TRAIN = wp.constant(SPLITS.index("train"))
_VALIDATION = wp.constant(SPLITS.index("validation"))
_TEST = wp.constant(SPLITS.index("test"))
_SPLIT_SEED = wp.constant(20260)  # fixes which squares of the ground belong to which split
_SPLIT_SQUARE_M = wp.constant(2.0)
_SPLIT_PERIOD = wp.constant(10)  # one square in so many is a test square, and one a validation square
_SPLIT_TRIES = wp.constant(256)  # 0.9^256 = 2e-12: the chance that a test target lies in another's square
_PLATFORMS = wp.constant(16)  # stacked in the published scene,
_PLATFORM_DROP_M = wp.constant(20.0)  # so far apart


@wp.struct
class ReachRules:
    """The chosen options."""

    observation: int
    reward: int
    success: int
    is_start_anywhere: int
    is_split: int
    split: int  # a place in SPLITS
    is_stacked: int
    does_contact_end: int


@wp.struct
class ReachState:
    """Where things are; one row per environment."""

    pos: wp.array(dtype=wp.vec3)  # [m] centre of the chassis
    q: wp.array(dtype=wp.quat)  # world from car
    vel: wp.array(dtype=wp.vec3)  # [m/s] world
    omega_car: wp.array(dtype=wp.vec3)  # [rad/s] car
    spin: wp.array(dtype=wp.vec4)  # [rad/s] of the wheels
    steer: wp.array(dtype=float)  # as it was last applied, [-1, 1]
    target: wp.array(dtype=wp.vec3)  # [m]
    target_yaw: wp.array(dtype=float)  # [rad]
    reaches: wp.array(dtype=int)  # targets reached in the running episode
    params: wp.array(dtype=ReachParams)


@wp.func
def motion_of(state: ReachState, i: int) -> Motion:
    """The car of a row."""
    motion = Motion()
    motion.pos = state.pos[i]
    motion.q = state.q[i]
    motion.vel = state.vel[i]
    motion.omega_car = state.omega_car[i]
    motion.spin = state.spin[i]
    return motion


@wp.func
def keep_motion(state: ReachState, i: int, motion: Motion) -> None:
    """Writes the car of a row."""
    state.pos[i] = motion.pos
    state.q[i] = motion.q
    state.vel[i] = motion.vel
    state.omega_car[i] = motion.omega_car
    state.spin[i] = motion.spin


@wp.func
def yaw_of(q: wp.quat) -> float:
    """Heading, clockwise from +z [rad]."""
    ahead = wp.quat_rotate(q, wp.vec3(0.0, 0.0, 1.0))
    return wp.atan2(ahead[0], ahead[2])


@wp.func
def quat_of_yaw(yaw: float) -> wp.quat:
    """Level, with that heading."""
    return wp.quat(0.0, wp.sin(0.5 * yaw), 0.0, wp.cos(0.5 * yaw))


@wp.func
def wrapped(angle: float) -> float:
    """The angle in [-pi, pi)."""
    return angle - 2.0 * _PI * wp.floor((angle + _PI) / (2.0 * _PI))


@wp.func
def speed_towards(motion: Motion, target: wp.vec3) -> float:
    """Speed in the direction of the target [m/s]."""
    away = target - motion.pos
    return wp.dot(away, motion.vel) / wp.max(wp.length(away), _TINY)


@wp.func
def potential(rules: ReachRules, n: ReachParams, motion: Motion, target: wp.vec3, target_yaw: float) -> float:
    """Minus the way to go over 50 m: the planar distance; for a pose, also what has to be turned close to it."""
    x = target[0] - motion.pos[0]
    z = target[2] - motion.pos[2]
    way = wp.sqrt(x * x + z * z)
    if rules.success == _POSE:
        turn = wp.abs(wrapped(target_yaw - yaw_of(motion.q)))
        way += 2.0 * turn * n.wheelbase_m / (1.0 + 0.1 * way)
    return -n.potential_scale * way / _RANGE


@wp.func
def is_reached(rules: ReachRules, n: ReachParams, motion: Motion, target: wp.vec3, target_yaw: float) -> bool:
    """Whether the car is where it should be: centres close in 3-D; or position, heading and speed."""
    away = target - motion.pos
    if rules.success != _POSE:
        return wp.length(away) < n.reach_m
    is_near = away[0] * away[0] + away[2] * away[2] < n.goal_position_m * n.goal_position_m
    is_slow = wp.length(motion.vel) < n.goal_speed_m_s
    if is_near and is_slow:
        return wp.abs(wrapped(target_yaw - yaw_of(motion.q))) < n.goal_heading_deg * _RAD
    return False


@wp.func
def split_of_square(x: float, z: float) -> int:
    """What the ground there belongs to, a place in SPLITS."""
    a = int(wp.floor(x / _SPLIT_SQUARE_M))
    b = int(wp.floor(z / _SPLIT_SQUARE_M))
    number = wp.randi(draw_key(_SPLIT_SEED, a, b, 0), 0, _SPLIT_PERIOD)
    if number == 0:
        return _TEST
    if number == 1:
        return _VALIDATION
    return _TRAIN


@wp.func
def draw_target(buffers: StepBuffers, state: ReachState, rules: ReachRules, i: int, episode: int, count: int) -> None:
    """Places the target of an episode, number `count`."""
    rng = draw_key(buffers.seed[i], i, episode, _TARGET_STREAM + count)
    half = state.params[i].half_spawn_m
    x = wp.randf(rng, -half, half)
    z = wp.randf(rng, -half, half)
    yaw = wp.randf(rng, -_PI, _PI)
    if rules.is_split != 0:
        for _try in range(_SPLIT_TRIES):
            if split_of_square(x, z) == rules.split:
                break
            x = wp.randf(rng, -half, half)
            z = wp.randf(rng, -half, half)
    state.target[i] = wp.vec3(x, state.params[i].target_height_m, z)
    state.target_yaw[i] = yaw


@wp.func
def place_car(buffers: StepBuffers, state: ReachState, rules: ReachRules, i: int, episode: int) -> None:
    """Sets the car down: in the middle as published, with a whole number of degrees, or anywhere; at rest."""
    n = state.params[i]
    rng = draw_key(buffers.seed[i], i, episode, _YAW_STREAM)
    motion = Motion()
    yaw = float(wp.randi(rng, -180, 180)) * _RAD
    x = float(0.0)
    z = float(0.0)
    if rules.is_start_anywhere != 0:
        x = wp.randf(rng, -n.half_spawn_m, n.half_spawn_m)
        z = wp.randf(rng, -n.half_spawn_m, n.half_spawn_m)
        yaw = wp.randf(rng, -_PI, _PI)
    motion.pos = wp.vec3(x, n.start_height_m, z)
    motion.q = quat_of_yaw(yaw)
    keep_motion(state, i, motion)
    state.steer[i] = 0.0


@wp.func
def way_to_edge(at: float, step: float, half: float) -> float:
    """Distance along a direction to the edge of the platform, one axis of it [m]."""
    return (half - at * wp.sign(step)) / wp.max(wp.abs(step), _TINY)


@wp.func
def put3(buffers: StepBuffers, i: int, at: int, value: wp.vec3) -> None:
    """Three floats of an observation."""
    for k in range(3):
        buffers.observations[i, at + k] = value[k]


@wp.func
def observe_published(buffers: StepBuffers, state: ReachState, rules: ReachRules, i: int, at: int) -> None:
    """What the article's agents see, in their order."""
    pos = state.pos[i]
    away = state.target[i] - pos
    direction = away / wp.max(wp.length(away), _TINY)
    if rules.observation == _CAR:
        put3(buffers, i, at, wp.quat_rotate_inv(state.q[i], away))
        put3(buffers, i, at + 3, wp.quat_rotate_inv(state.q[i], state.vel[i]))
        put3(buffers, i, at + 6, wp.quat_rotate_inv(state.q[i], direction))
        return
    lift = wp.vec3(0.0, 0.0, 0.0)
    if rules.is_stacked != 0:
        lift = wp.vec3(0.0, -_PLATFORM_DROP_M * float(i % _PLATFORMS), 0.0)
    put3(buffers, i, at, state.target[i] + lift)
    put3(buffers, i, at + 3, pos + lift)
    put3(buffers, i, at + 6, state.vel[i])
    if rules.observation == _WORLD_HEADING:
        put3(buffers, i, at + 9, direction)
        put3(buffers, i, at + 12, wp.quat_rotate(state.q[i], wp.vec3(0.0, 0.0, 1.0)))


@wp.func
def observe_ego(buffers: StepBuffers, state: ReachState, i: int, at: int) -> None:
    """Ours: bearing, distances, motion, the goal's heading, steering and the edges, as seen from the car."""
    pos = state.pos[i]
    yaw = yaw_of(state.q[i])
    sin_yaw = wp.sin(yaw)
    cos_yaw = wp.cos(yaw)
    away = state.target[i] - pos
    right = cos_yaw * away[0] - sin_yaw * away[2]
    ahead = sin_yaw * away[0] + cos_yaw * away[2]
    distance = wp.sqrt(right * right + ahead * ahead)
    vel_car = wp.quat_rotate_inv(state.q[i], state.vel[i])
    turn = state.target_yaw[i] - yaw
    half = state.params[i].half_platform_m
    buffers.observations[i, at] = right / wp.max(distance, _TINY)
    buffers.observations[i, at + 1] = ahead / wp.max(distance, _TINY)
    buffers.observations[i, at + 2] = distance / _RANGE
    buffers.observations[i, at + 3] = wp.min(distance / _NEAR, 1.0)
    buffers.observations[i, at + 4] = vel_car[2] / _SPEED
    buffers.observations[i, at + 5] = vel_car[0] / _SPEED
    buffers.observations[i, at + 6] = state.omega_car[i][1]
    buffers.observations[i, at + 7] = wp.sin(turn)
    buffers.observations[i, at + 8] = wp.cos(turn)
    buffers.observations[i, at + 9] = state.steer[i]
    for k in range(4):  # ahead, right, behind, left
        x = sin_yaw
        z = cos_yaw
        if k % 2 == 1:
            x = cos_yaw
            z = -sin_yaw
        if k >= 2:
            x = -x
            z = -z
        edge = wp.min(way_to_edge(pos[0], x, half), way_to_edge(pos[2], z, half))
        buffers.observations[i, at + 10 + k] = wp.clamp(edge / _RANGE, -1.0, 2.0)


@wp.func
def observe(buffers: StepBuffers, state: ReachState, rules: ReachRules, i: int) -> None:
    """Writes the newest frame."""
    at = open_frame(buffers, i)
    if rules.observation <= _CAR:
        observe_published(buffers, state, rules, i, at)
    else:
        observe_ego(buffers, state, i, at)


@wp.func
def place(buffers: StepBuffers, state: ReachState, rules: ReachRules, i: int, is_car_kept: bool) -> None:
    """Begins an episode: the target elsewhere; the car where it is after a success, otherwise at its start."""
    episode = begin_episode(buffers, i)
    if not is_car_kept:
        place_car(buffers, state, rules, i, episode)
    state.reaches[i] = 0
    draw_target(buffers, state, rules, i, episode, 0)
    observe(buffers, state, rules, i)


@wp.kernel(enable_backward=False)
def begin(buffers: StepBuffers, is_chosen: wp.array(dtype=wp.bool), state: ReachState, rules: ReachRules) -> None:
    """Starts an episode in the chosen rows."""
    i = wp.tid()
    if is_chosen[i]:
        place(buffers, state, rules, i, False)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, state: ReachState, rules: ReachRules) -> None:
    """One decision of every row."""
    i = wp.tid()
    n = state.params[i]
    car = car_of(n)
    steer = wp.clamp(buffers.continuous[i, 0], -1.0, 1.0)
    controls = controls_of(n, steer, buffers.continuous[i, 1], buffers.continuous[i, 2])
    motion = motion_of(state, i)
    before = float(0.0)
    if rules.reward == _POTENTIAL:
        before = potential(rules, n, motion, state.target[i], state.target_yaw[i])
    reward = float(0.0)
    reached = int(0)
    outcome = int(RUNNING)
    for _tick in range(_STEPS):
        for _substep in range(_SUBSTEPS):
            motion = driven(car, controls, motion)
        if rules.reward == _SHAPED_EACH_STEP:
            reward += n.shaping_scale * speed_towards(motion, state.target[i])
        if is_reached(rules, n, motion, state.target[i], state.target_yaw[i]):
            reached += 1
            reward += 1.0
            if rules.success != _GOES_ON:
                outcome = SUCCESS
                break
            state.reaches[i] += 1
            draw_target(buffers, state, rules, i, buffers.episodes[i] - 1, state.reaches[i])
        if motion.pos[1] < 0.0:
            outcome = FELL
            break
        if rules.does_contact_end != 0 and is_chassis_hit(car, motion):
            outcome = HIT_OTHER
            break
    keep_motion(state, i, motion)
    state.steer[i] = steer
    if rules.reward == _SHAPED:
        reward += n.shaping_scale * speed_towards(motion, state.target[i])
    is_late = outcome == RUNNING and float(buffers.steps[i] + 1) >= n.step_limit
    if is_late:
        outcome = wp.where(state.reaches[i] > 0, SUCCESS, TIMEOUT)
    if rules.reward == _POTENTIAL:
        after = float(0.0)  # of an ended episode, and of a target that has moved on
        if reached == 0 and (outcome == RUNNING or is_late):
            after = potential(rules, n, motion, state.target[i], state.target_yaw[i])
        reward += n.shaping_gamma * after - before
    observe(buffers, state, rules, i)
    if close_step(buffers, i, reward, outcome):
        if is_late:  # also where SUCCESS says that the cut episode had reached a target
            buffers.is_truncated[i] = True
            buffers.is_terminated[i] = False
        place(buffers, state, rules, i, outcome == SUCCESS and not is_late and rules.is_start_anywhere == 0)
