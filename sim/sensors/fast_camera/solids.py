"""Round things in front of a camera: trunks, crowns and limbs are all capsules, kept in the camera's own frame.

A trunk's round ends are under ground and inside the crown, so the capsule is the world's cylinder where it can be seen.
In: the camera, the world's trees, other vehicles. Out: the list of what may be in the image, with boxes in pixels.
"""

import warp as wp

from sim.sensors.fast_camera.camera_view import View
from sim.sensors.ray import CROWN, SKY, TRUNK, VEHICLE
from sim.world.neighbours import Neighbours
from sim.world.trees import Forest, Tree

wp.set_module_options({"enable_backward": False})

NEVER = wp.constant(1.0e30)
HULL_COLOUR = wp.constant(wp.vec3(0.05, 0.05, 0.06))  # as `sim.sensors.shading`
_EDGE_RAY = wp.constant(1.0e-7)  # a ray along the axis meets an end


@wp.struct
class Solid:
    """A capsule in the frame of a camera, and its looks."""

    foot: wp.vec3  # [m] start of the axis, rdf
    axis: wp.vec3  # unit, rdf
    length: float  # [m]
    radius: float  # [m]
    foot_along: float  # dot(foot, axis)
    off_squared: float  # [m²] of the axis from the camera, less the squared radius
    foot_squared: float  # [m²] likewise of the foot
    tip_squared: float  # [m²] and of the tip
    kind: int
    albedo: wp.vec3
    roughness: float  # how uneven it looks


@wp.struct
class Sights:
    """The solids of all cameras, `room` each."""

    solids: wp.array[Solid]
    boxes: wp.array[wp.vec4i]  # first and last column and row in the image
    room: int
    crown_max_m: float  # no crown has a larger radius


@wp.func
def make_solid(foot: wp.vec3, tip: wp.vec3, radius: float, kind: int, albedo: wp.vec3, roughness: float) -> Solid:
    """The capsule between two points in the frame of the camera."""
    solid = Solid()
    way = tip - foot
    length = wp.length(way)
    axis = wp.vec3(0.0, -1.0, 0.0)
    if length > 1.0e-6:
        axis = way / length
    solid.foot = foot
    solid.axis = axis
    solid.length = length
    solid.radius = radius
    along = wp.dot(foot, axis)
    solid.foot_along = along
    off = foot - along * axis
    solid.off_squared = wp.dot(off, off) - radius * radius
    solid.foot_squared = wp.dot(foot, foot) - radius * radius
    solid.tip_squared = wp.dot(tip, tip) - radius * radius
    solid.kind = kind
    solid.albedo = albedo
    solid.roughness = roughness
    return solid


@wp.func
def solid_depth(solid: Solid, ray: wp.vec3, ray_squared: float) -> float:
    """Parameter of a ray from the camera at the capsule's front; NEVER if it misses or is behind."""
    along = wp.dot(ray, solid.axis)
    towards = wp.dot(ray, solid.foot)
    level = wp.max(ray_squared - along * along, _EDGE_RAY)
    half = towards - along * solid.foot_along
    spare = half * half - level * solid.off_squared
    if spare <= 0.0:
        return NEVER
    t = (half - wp.sqrt(spare)) / level
    position = t * along - solid.foot_along
    if position < 0.0:
        spare = towards * towards - ray_squared * solid.foot_squared
        if spare <= 0.0:
            return NEVER
        t = (towards - wp.sqrt(spare)) / ray_squared
    elif position > solid.length:
        half = towards + solid.length * along
        spare = half * half - ray_squared * solid.tip_squared
        if spare <= 0.0:
            return NEVER
        t = (half - wp.sqrt(spare)) / ray_squared
    return wp.where(t > 0.0, t, NEVER)


@wp.func
def is_in_solid(solid: Solid) -> bool:
    """Whether the camera is inside."""
    if -solid.foot_along < 0.0:
        return solid.foot_squared < 0.0
    if -solid.foot_along > solid.length:
        return solid.tip_squared < 0.0
    return solid.off_squared < 0.0


@wp.func
def ball_span(across: float, depth: float, radius: float) -> wp.vec2:
    """First and last x (or y) of a ball in the image, as x = across / depth; first after last if it is behind."""
    if depth < -0.99 * radius:  # an end that was moved: the capsule goes on to the side from here
        return wp.vec2(wp.where(across < radius, -NEVER, NEVER), wp.where(across > -radius, NEVER, -NEVER))
    tangent_squared = across * across + depth * depth - radius * radius
    if tangent_squared <= 1.0e-6:
        return wp.vec2(-NEVER, NEVER)  # the lens is in it, seen along the other axis
    tangent = wp.sqrt(tangent_squared)
    # the two tangents from the lens; one that points backwards leaves that side open, or all of it unseen
    low = across * tangent - depth * radius
    low_depth = depth * tangent + across * radius
    high = across * tangent + depth * radius
    high_depth = depth * tangent - across * radius
    first = wp.where(low < 0.0, -NEVER, NEVER)
    last = wp.where(high > 0.0, NEVER, -NEVER)
    if low_depth > 1.0e-6:
        first = low / low_depth
    if high_depth > 1.0e-6:
        last = high / high_depth
    return wp.vec2(first, last)


@wp.func
def in_front(point: wp.vec3, other: wp.vec3, radius: float) -> wp.vec3:
    """An end of an axis, moved along it to where the capsule comes into the half space in front of the lens."""
    if point[2] >= -radius or other[2] <= -radius:
        return point
    return point + ((-radius - point[2]) / (other[2] - point[2])) * (other - point)


@wp.func
def solid_box(solid: Solid, per_pixel: float, width: int, height: int) -> wp.vec4i:
    """First and last column and row that the capsule can cover; last before first if none."""
    end = solid.foot + solid.length * solid.axis
    if wp.max(solid.foot[2], end[2]) + solid.radius <= 0.0:
        return wp.vec4i(0, -1, 0, -1)
    foot = in_front(solid.foot, end, solid.radius)
    tip = in_front(end, solid.foot, solid.radius)
    x_foot = ball_span(foot[0], foot[2], solid.radius)
    x_tip = ball_span(tip[0], tip[2], solid.radius)
    y_foot = ball_span(foot[1], foot[2], solid.radius)
    y_tip = ball_span(tip[1], tip[2], solid.radius)
    x0 = first_pixel(wp.min(x_foot[0], x_tip[0]), per_pixel, width)
    x1 = first_pixel(wp.max(x_foot[1], x_tip[1]), per_pixel, width) - 1
    y0 = first_pixel(wp.min(y_foot[0], y_tip[0]), per_pixel, height)
    y1 = first_pixel(wp.max(y_foot[1], y_tip[1]), per_pixel, height) - 1
    return wp.vec4i(x0, x1, y0, y1)


@wp.func
def first_pixel(x: float, per_pixel: float, count: int) -> int:
    """The first of `count` pixels whose middle is at or beyond x, 0..count."""
    position = x / per_pixel + 0.5 * float(count) - 0.5
    return int(wp.ceil(wp.clamp(position, 0.0, float(count))))


@wp.func
def list_solid(sights: Sights, i_camera: int, view: View, solid: Solid, width: int, height: int) -> View:
    """The camera with a capsule on its list, if that can be in the image and there is room."""
    box = solid_box(solid, view.per_pixel, width, height)
    if view.solids < sights.room and box[0] <= box[1] and box[2] <= box[3]:
        k = i_camera * sights.room + view.solids
        sights.solids[k] = solid
        sights.boxes[k] = box
        view.solids = view.solids + 1
    return view


@wp.func
def to_rdf(view: View, point_ned: wp.vec3) -> wp.vec3:
    """A point in the frame of the camera [m]."""
    off = point_ned - view.pos_ned
    return wp.vec3(wp.dot(off, view.right), wp.dot(off, view.down), wp.dot(off, view.ahead))


@wp.func
def list_tree(sights: Sights, i_camera: int, view: View, tree: Tree, i_tree: int, width: int, height: int) -> View:
    """The camera with a tree's trunk and crown on its list."""
    low = to_rdf(view, wp.vec3(tree.north, tree.east, -tree.crown_low))
    high = to_rdf(view, wp.vec3(tree.north, tree.east, -tree.crown_high))
    root = to_rdf(view, wp.vec3(tree.north, tree.east, -tree.root_height))
    crown = make_solid(low, high, tree.crown_radius, CROWN, leaf_colour(i_tree), 1.0)
    trunk = make_solid(root, low, tree.trunk_radius, TRUNK, wp.vec3(0.115, 0.080, 0.055), 0.4)
    if view.inside == SKY and is_in_solid(crown):
        view.inside = CROWN
    if view.inside == SKY and is_in_solid(trunk):
        view.inside = TRUNK
    view = list_solid(sights, i_camera, view, crown, width, height)
    return list_solid(sights, i_camera, view, trunk, width, height)


@wp.func
def list_neighbours(sights: Sights, i_camera: int, view: View, others: Neighbours, width: int, height: int) -> View:
    """The camera with the other vehicles on its list: balls, and capsules as long as a box."""
    for i in range(others.count):
        if i != others.i_own:
            other = others.rows[i]
            radius = wp.sqrt(other.half_width * other.half_height)
            half_m = wp.max(other.half_length - radius, 0.0)
            along_ned = wp.vec3(half_m * other.cos_yaw, half_m * other.sin_yaw, 0.0)
            rear = to_rdf(view, other.pos_ned - along_ned)
            front = to_rdf(view, other.pos_ned + along_ned)
            hull = make_solid(rear, front, radius, VEHICLE, HULL_COLOUR, 0.0)
            if view.inside == SKY and is_in_solid(hull):
                view.inside = VEHICLE
            view = list_solid(sights, i_camera, view, hull, width, height)
    return view


@wp.func
def leaf_colour(i_tree: int) -> wp.vec3:
    """Each tree has a green of its own, a few are turning: as `sim.sensors.shading`."""
    state = wp.rand_init(7, i_tree)
    hue = wp.randf(state)
    tone = 0.75 + 0.5 * wp.randf(state)
    albedo = wp.vec3(0.050, 0.105, 0.028) + hue * hue * wp.vec3(0.100, 0.055, 0.004)
    if hue > 0.93:
        albedo = wp.vec3(0.24, 0.13, 0.03)
    return tone * albedo


@wp.func
def list_bucket(
    sights: Sights, i_camera: int, view: View, forest: Forest, row: int, column: int, range_m: float, size: wp.vec2i
) -> View:
    """The camera with the trees of one bucket on its list, those that stand in it."""
    if row < 0 or column < 0 or row >= forest.buckets or column >= forest.buckets:
        return view
    middle = wp.vec2(float(row) + 0.5, float(column) + 0.5) / forest.buckets_per_m
    half = wp.vec2(forest.half_size_m, forest.half_size_m)
    off_middle = middle - half - wp.vec2(view.pos_ned[0], view.pos_ned[1])
    spare = 0.71 / forest.buckets_per_m + sights.crown_max_m
    if wp.dot(view.left_edge, off_middle) < -spare or wp.dot(view.right_edge, off_middle) < -spare:
        return view
    bucket = row * forest.buckets + column
    for k in range(forest.bucket_start[bucket], forest.bucket_start[bucket + 1]):
        i_tree = forest.bucket_trees[k]
        tree = forest.trees[i_tree]
        own_row = int((tree.north + forest.half_size_m) * forest.buckets_per_m)
        own_column = int((tree.east + forest.half_size_m) * forest.buckets_per_m)
        off_north = tree.north - view.pos_ned[0]
        off_east = tree.east - view.pos_ned[1]
        off = wp.vec2(off_north, off_east)
        reach = range_m + tree.crown_radius
        is_near = wp.dot(off, off) < reach * reach
        is_left = wp.dot(view.right_edge, off) > -tree.crown_radius
        is_right = wp.dot(view.left_edge, off) > -tree.crown_radius
        if own_row == row and own_column == column and is_near and is_left and is_right:
            view = list_tree(sights, i_camera, view, tree, i_tree, size[0], size[1])
    return view


@wp.func
def list_forest(
    sights: Sights, i_camera: int, view: View, forest: Forest, range_m: float, width: int, height: int
) -> View:
    """The camera with the trees within range on its list, in rings round it: where room ends, the far ones are left."""
    size = wp.vec2i(width, height)
    row = int(wp.floor((view.pos_ned[0] + forest.half_size_m) * forest.buckets_per_m))
    column = int(wp.floor((view.pos_ned[1] + forest.half_size_m) * forest.buckets_per_m))
    rings = int(range_m * forest.buckets_per_m) + 2
    for ring in range(rings):
        for i in range(-ring, ring + 1):
            step = wp.where(i == -ring or i == ring, 1, 2 * ring)  # the ring's ends are full rows
            for k in range(2 * ring / wp.max(step, 1) + 1):
                j = k * step - ring
                view = list_bucket(sights, i_camera, view, forest, row + i, column + j, range_m, size)
    return view
