"""Where a rover is to go: a free pose on a course, or a free spot of a car park."""

import warp as wp

from policies.tasks.drive.way_length import way_length_m
from policies.tasks.flight.episode_draws import draw_angle, draw_index
from sim.world.building import lot_yaw, spot_pose
from sim.world.world import World, ground_height, ground_normal_ned, obstacle_contact, world_at

wp.set_module_options({"enable_backward": False})

TURN_RADIUS_M = wp.constant(1.0)  # of the way that is left: a little wider than a car of 1:5 can turn
AXLE_M = wp.constant(0.25)  # from the vehicle's middle back to its rear axle, which moves along the nose
_GOAL_STREAM = wp.constant(6)
_HEADING_STREAM = wp.constant(40)
_DARTS = 16
_ROOM_M = wp.constant(1.1)  # round a goal on a course
_SPOT_ROOM_M = wp.constant(0.4)  # round the middle of a free spot: half of it, and some
_OVER_GROUND_M = wp.constant(0.25)
_LEVEL = wp.constant(0.985)  # cosine of the steepest ground under a goal: 10 deg
_MOMENTS = wp.constant(8)  # at which movers are looked for
_MOMENT_TICKS = wp.constant(700)
_OUT_M = wp.constant(1.6)  # before a spot, where the way into it is straight
_LANE_M = wp.constant(0.35)  # half of the lane into a spot
_GOAL_CLEAR_OF_EDGE_M = wp.constant(2.5)


@wp.func
def has_room(world: World, north: float, east: float, room_m: float) -> bool:
    """Whether nothing stands within a distance of a place [m], now or when movers come by."""
    at_ned = wp.vec3(north, east, -ground_height(world, north, east) - _OVER_GROUND_M)
    for moment in range(_MOMENTS):
        now = world_at(world, world.boxes.tick + moment * _MOMENT_TICKS)
        if obstacle_contact(now, at_ned, room_m)[3] > 0.0:
            return False
    return True


@wp.func
def course_goal(world: World, nearest_m: float, farthest_m: float, seed: int, i: int, episode: int) -> wp.vec3:
    """A pose on a course (north, east, heading) with room round it, in a distance from home."""
    heading = draw_angle(seed, i, episode, _HEADING_STREAM)
    goal = wp.vec3(nearest_m, 0.0, heading)
    is_found = bool(False)
    half = world.terrain.half_size_m - _GOAL_CLEAR_OF_EDGE_M
    for k in range(_DARTS):
        bearing = draw_angle(seed, i, episode, _GOAL_STREAM + 2 * k)
        fraction = draw_angle(seed, i, episode, _GOAL_STREAM + 2 * k + 1) / (2.0 * wp.pi) + 0.5
        away_m = nearest_m + fraction * wp.max(farthest_m - nearest_m, 0.0)
        north = wp.clamp(away_m * wp.cos(bearing), -half, half)
        east = wp.clamp(away_m * wp.sin(bearing), -half, half)
        is_level = -ground_normal_ned(world, north, east)[2] > _LEVEL
        if not is_found and is_level and has_room(world, north, east, _ROOM_M):
            goal = wp.vec3(north, east, heading)
            is_found = True
    return goal


@wp.func
def spot_goal(world: World, world_seed: int, spot_count: int, seed: int, i: int, episode: int) -> wp.vec3:
    """The pose in a free spot of a car park, nose or tail to the aisle."""
    first = draw_index(seed, i, episode, _GOAL_STREAM, 2 * spot_count)
    goal = spot_pose(world_seed, spot_count, first)
    is_found = bool(False)
    for k in range(2 * spot_count):
        pose = spot_pose(world_seed, spot_count, (first + k) % (2 * spot_count))
        if not is_found and has_room(world, pose[0], pose[1], _SPOT_ROOM_M):
            goal = pose
            is_found = True
    if draw_angle(seed, i, episode, _HEADING_STREAM) < 0.0:
        goal = wp.vec3(goal[0], goal[1], goal[2] + wp.pi)
    return goal


@wp.func
def way_out(goal: wp.vec3, world_seed: int) -> float:
    """1 where the nose of a goal in a spot shows into the aisle, -1 where its tail does."""
    yaw = lot_yaw(world_seed)
    right_of_aisle = goal[1] * wp.cos(yaw) - goal[0] * wp.sin(yaw)
    nose_right = wp.sin(goal[2] - yaw)
    return wp.where(right_of_aisle * nose_right < 0.0, 1.0, -1.0)


@wp.func
def rear_axle(pose: wp.vec3) -> wp.vec3:
    """The pose of the rear axle's middle."""
    return wp.vec3(pose[0] - AXLE_M * wp.cos(pose[2]), pose[1] - AXLE_M * wp.sin(pose[2]), pose[2])


@wp.func
def shifted(pose: wp.vec3, ahead_m: float) -> wp.vec3:
    """A pose so much farther ahead."""
    return wp.vec3(pose[0] + ahead_m * wp.cos(pose[2]), pose[1] + ahead_m * wp.sin(pose[2]), pose[2])


@wp.func
def way_left_m(pose: wp.vec3, goal: wp.vec3, out: float) -> float:
    """How far it is from a pose to a goal for a car [m].

    Args:
        pose: north, east, heading of the vehicle.
        goal: of where it is to be.
        out: 0 on a course; of a spot 1 where the goal's nose shows into the aisle, else -1: the way leads in straight.
    """
    start = rear_axle(pose)
    end = rear_axle(goal)
    if out != 0.0:
        north = pose[0] - goal[0]
        east = pose[1] - goal[1]
        ahead = (north * wp.cos(goal[2]) + east * wp.sin(goal[2])) * out
        right = east * wp.cos(goal[2]) - north * wp.sin(goal[2])
        if ahead > _OUT_M or wp.abs(right) > _LANE_M:
            return way_length_m(start, shifted(end, out * _OUT_M), TURN_RADIUS_M) + _OUT_M
    return way_length_m(start, end, TURN_RADIUS_M)
