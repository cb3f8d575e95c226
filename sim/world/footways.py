"""Ways for feet between trunks: what is in the way, how to get round it, and never into it.

In: a position, a course, how far to look. Out: a course, a distance or a position. Trees are found through the buckets
of `trees.py`; crowns do not matter, people pass under them. Asked at 50 Hz per person.
"""

import warp as wp

from common.rotation import wrap_pi
from sim.world.terrain import grid_coordinate, outer_cell
from sim.world.trees import Forest

wp.set_module_options({"enable_backward": False})

BODY_CLEARANCE_M = wp.constant(0.3)  # from the axis of a body to the bark: half a shoulder's width and a little
_GRAZE_M = wp.constant(8.0)  # how far ahead a tree is sought to pass it closely; guess
_NONE_M = wp.constant(1.0e9)


@wp.func
def bucket_at(forest: Forest, north: float, east: float) -> int:
    """The bucket that lists every tree near a position [m], -1 beyond the map."""
    row = outer_cell(grid_coordinate(north, forest.half_size_m, forest.buckets_per_m), forest.buckets)
    column = outer_cell(grid_coordinate(east, forest.half_size_m, forest.buckets_per_m), forest.buckets)
    if row < 0 or column < 0 or row >= forest.buckets or column >= forest.buckets:
        return -1
    return row * forest.buckets + column


@wp.func
def clear_of_trunks(forest: Forest, position: wp.vec2) -> wp.vec2:
    """A position [m] moved straight out of the trunk it is nearest to, if that is nearer than BODY_CLEARANCE_M."""
    out = position
    bucket = bucket_at(forest, position[0], position[1])
    if bucket < 0:
        return out
    for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
        tree = forest.trees[forest.bucket_trees[k]]
        off = out - wp.vec2(tree.north, tree.east)
        distance = wp.length(off)
        keep = tree.trunk_radius + BODY_CLEARANCE_M
        if distance < keep:
            outward = wp.vec2(1.0, 0.0)
            if distance > 1.0e-6:
                outward = off / distance
            out = wp.vec2(tree.north, tree.east) + keep * outward
    return out


@wp.func
def around_nearest(forest: Forest, position: wp.vec2, course_rad: float, look_m: float, clearance_m: float) -> float:
    """The course [rad], turned to the nearer tangent of the first tree that it would bring too close.

    Args:
        forest: the trees.
        position: north, east [m].
        course_rad: where to.
        look_m: how far ahead trees count.
        clearance_m: to keep between body and bark.
    """
    along = wp.vec2(wp.cos(course_rad), wp.sin(course_rad))
    nearest = _NONE_M
    out = course_rad
    for i_point in range(3):  # buckets list trees 2 m and more beyond their borders: no gap between these points
        point = position + (0.5 * float(i_point) * look_m) * along
        bucket = bucket_at(forest, point[0], point[1])
        if bucket >= 0:
            for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
                tree = forest.trees[forest.bucket_trees[k]]
                off = wp.vec2(tree.north, tree.east) - position
                forward = wp.dot(off, along)
                keep = tree.trunk_radius + BODY_CLEARANCE_M + clearance_m
                side = along[0] * off[1] - along[1] * off[0]
                if forward > 0.0 and forward < look_m and wp.abs(side) < keep and forward < nearest:
                    nearest = forward
                    distance = wp.max(wp.length(off), 1.0e-3)
                    # the tangent; nearer than `keep` it leads straight across
                    aside = wp.asin(wp.min(keep / distance, 1.0))
                    out = wrap_pi(wp.atan2(off[1], off[0]) - wp.where(side >= 0.0, aside, -aside))
    return out


@wp.func
def free_way_m(forest: Forest, position: wp.vec2, course_rad: float, look_m: float) -> float:
    """How far a body can go along a course before it touches a trunk [m], at most `look_m`."""
    along = wp.vec2(wp.cos(course_rad), wp.sin(course_rad))
    free = float(look_m)
    for i_point in range(3):
        point = position + (0.5 * float(i_point) * look_m) * along
        bucket = bucket_at(forest, point[0], point[1])
        if bucket >= 0:
            for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
                tree = forest.trees[forest.bucket_trees[k]]
                off = wp.vec2(tree.north, tree.east) - position
                forward = wp.dot(off, along)
                side = along[0] * off[1] - along[1] * off[0]
                keep = tree.trunk_radius + BODY_CLEARANCE_M
                if forward > 0.0 and wp.abs(side) < keep:
                    free = wp.min(free, wp.max(forward - wp.sqrt(keep * keep - side * side), 0.0))
    return free


@wp.func
def towards_tree(forest: Forest, position: wp.vec2, course_rad: float, clearance_m: float) -> float:
    """The course [rad] that just passes the first tree listed around a position ahead; unchanged if there is none."""
    along = wp.vec2(wp.cos(course_rad), wp.sin(course_rad))
    point = position + _GRAZE_M * along
    bucket = bucket_at(forest, point[0], point[1])
    out = course_rad
    if bucket >= 0:
        for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
            tree = forest.trees[forest.bucket_trees[k]]
            off = wp.vec2(tree.north, tree.east) - position
            distance = wp.length(off)
            keep = tree.trunk_radius + BODY_CLEARANCE_M + clearance_m
            if out == course_rad and wp.dot(off, along) > 2.0 and distance > keep:
                out = wp.atan2(off[1], off[0]) + wp.asin(keep / distance)
    return wrap_pi(out)
