"""The ground round a camera as columns of distances, and where a pixel's ray meets it.

A column looks along one level direction: at each of its distances it holds the steepest slope under which any ground
up to there is seen. A ray meets the ground between the two distances whose slopes enclose its own, on a triangle whose
plane it meets within the triangle: first that of the pixel before, then as Newton's method leads from one to the next.
A ray steeper than all ground needs no column. One that a neighbouring ridge misleads walks on along the distances.
"""

import warp as wp

from sim.sensors.fast_camera.camera_view import View, face_length, level_direction, pseudo_angle
from sim.sensors.fast_camera.flags import FAST
from sim.sensors.fast_camera.ground import Ground, Plane, plane_at, surface, triangle_at
from sim.sensors.fast_camera.solids import NEVER

wp.set_module_options(FAST)

_PLANES = wp.constant(4)  # triangles tried in turn, as Newton's method goes from one to the next
_STEP_M = wp.constant(0.02)  # the last step: exact on one triangle, and off by a fraction of itself where it leaves it
_STEP_FRACTION = wp.constant(0.004)
_WALK_BACK = wp.constant(2)  # samples that a misled ray goes back
_SECANT_STEPS = wp.constant(8)


@wp.struct
class Columns:
    """The columns of all cameras."""

    slopes: wp.array[float]  # running maxima, (cameras, room, samples)
    distances: wp.array[float]  # [m], (cameras, samples)
    room: int
    samples: int


@wp.struct
class Found:
    """Where a ray meets the ground."""

    t: float  # NEVER if it does not
    k: int  # sample at its end of the search: the next pixel's is near
    plane: Plane  # met last: the next pixel's is often the same


@wp.struct
class LevelRay:
    """A ray over the map: changes per unit of t."""

    u: float  # [cells] to the north
    v: float  # [cells] to the east
    climb: float  # [m]
    ahead: float  # [m] along the heading
    right: float


@wp.func
def level_ray(view: View, cells_per_m: float, ray_ned: wp.vec3) -> LevelRay:
    """A ray as it goes over the map."""
    level = LevelRay()
    level.u = ray_ned[0] * cells_per_m
    level.v = ray_ned[1] * cells_per_m
    level.climb = -ray_ned[2]
    level.ahead = ray_ned[0] * view.heading[0] + ray_ned[1] * view.heading[1]
    level.right = ray_ned[1] * view.heading[0] - ray_ned[0] * view.heading[1]
    return level


@wp.kernel
def lay_columns(
    first_camera: int, ground: Ground, views: wp.array[View], is_chosen: wp.array[wp.bool], columns: Columns
) -> None:
    i_row, i_column = wp.tid()
    i_camera = first_camera + i_row
    if not is_chosen[i_camera]:
        return
    view = views[i_camera]
    if i_column >= view.columns:
        return
    direction = level_direction(view.angle_low + float(i_column) / view.columns_per_angle)
    per_m = ground.cells_per_m
    u_rate = per_m * (direction[0] * view.heading[0] - direction[1] * view.heading[1])
    v_rate = per_m * (direction[0] * view.heading[1] + direction[1] * view.heading[0])
    first_slope = (i_camera * columns.room + i_column) * columns.samples
    first_distance = i_camera * columns.samples
    steepest = float(-NEVER)
    for k in range(columns.samples):
        distance = columns.distances[first_distance + k]
        height = surface(ground, view.cell_base, view.eye[0] + distance * u_rate, view.eye[1] + distance * v_rate)[0]
        steepest = wp.max(steepest, (height + view.pos_ned[2]) / distance)
        columns.slopes[first_slope + k] = steepest


@wp.func
def ground_depth(
    ground: Ground, columns: Columns, view: View, i_camera: int, ray: LevelRay, before: Found, t_max: float
) -> Found:
    """Where a ray meets the ground before `t_max`; NEVER if it does not, or surely only behind it."""
    found = before
    found.t = NEVER
    low = float(0.0)
    high = float(NEVER)
    t = plane_depth(before.plane, ray)  # as if the ground went on as it was in the pixel before
    is_steep = ray.climb * ray.climb > view.steep_squared * (ray.ahead * ray.ahead + ray.right * ray.right)
    if is_steep or view.columns == 0:
        if ray.climb > 0.0:
            return found
        t = wp.max(t, 0.0)
    else:
        major = face_length(ray.ahead, ray.right)
        inverse = 1.0 / major
        slope = ray.climb * inverse
        first = column_beside(columns, view, i_camera, ray, inverse, slope)
        if first < 0:
            return found
        k = first_at(columns, first, slope, before.k)
        found.k = k
        first_distance = i_camera * columns.samples
        far = columns.distances[first_distance + k]
        high = wp.min(t_max, far * inverse)
        near = float(0.0)
        if k > 0:
            near = columns.distances[first_distance + k - 1]
            low = near * inverse
            if low >= t_max:
                return found
        if t < low or t > high:
            t = high
            if k > 0:
                chord = chord_distance(near, far, columns.slopes[first + k - 1], columns.slopes[first + k], slope)
                t = wp.clamp(chord * inverse, low, high)
            found.plane.i = -1
    for _ in range(_PLANES):
        u = view.eye[0] + t * ray.u
        v = view.eye[1] + t * ray.v
        if triangle_at(ground, view.cell_base, u, v) == found.plane.i:
            found.t = t
            return found
        found.plane = plane_at(ground, view.cell_base, u, v, view.eye)
        t_next = plane_depth(found.plane, ray)
        if wp.abs(t_next - t) < _STEP_M + _STEP_FRACTION * t:
            found.t = t_next
            return found
        t = wp.clamp(t_next, low, high)
        if t != t_next:
            found.plane.i = -1
    return walk(ground, columns, view, i_camera, ray, found, t_max)


@wp.func
def column_beside(columns: Columns, view: View, i_camera: int, ray: LevelRay, inverse: float, slope: float) -> int:
    """Where, of the two columns beside a ray, that begins in which its slope is reached; -1 if it passes over both.

    `inverse` is one over the length that the ray goes along its cube face.
    """
    position = (pseudo_angle(ray.ahead, ray.right, inverse) - view.angle_low) * view.columns_per_angle
    left = wp.clamp(int(position), 0, view.columns - 2)
    fraction = position - float(left)
    first = (i_camera * columns.room + left) * columns.samples
    last = columns.samples - 1
    skyline_left = columns.slopes[first + last]
    skyline_right = columns.slopes[first + columns.samples + last]
    if slope > skyline_left + fraction * (skyline_right - skyline_left):
        return -1
    if (fraction > 0.5 and slope <= skyline_right) or slope > skyline_left:
        return first + columns.samples
    return first


@wp.func
def first_at(columns: Columns, first: int, slope: float, start: int) -> int:
    """The first sample of a column whose slope reaches one that the last reaches; the search starts anywhere."""
    last = columns.samples - 1
    k = wp.min(start, last)
    while k < last and columns.slopes[first + k] < slope:
        k = k + 1
    while k > 0 and columns.slopes[first + k - 1] >= slope:
        k = k - 1
    return k


@wp.func
def chord_distance(near: float, far: float, slope_near: float, slope_far: float, slope: float) -> float:
    """Where a slope is met between two samples of an even hillside: it is linear in one over the distance."""
    part = (slope - slope_near) / wp.max(slope_far - slope_near, 1.0e-6)
    return near * far / wp.max(far + part * (near - far), 1.0e-6)


@wp.func
def plane_depth(plane: Plane, ray: LevelRay) -> float:
    """Parameter of a ray at a plane of the ground."""
    return plane.below / wp.max(plane.rise_north * ray.u + plane.rise_east * ray.v - ray.climb, 1.0e-4)


@wp.func
def walk(
    ground: Ground, columns: Columns, view: View, i_camera: int, ray: LevelRay, before: Found, t_max: float
) -> Found:
    """Where a ray meets the ground: from sample to sample until it is under it, then by regula falsi."""
    found = Found()
    found.k = before.k
    found.plane = before.plane
    found.t = NEVER
    u = view.eye[0]
    v = view.eye[1]
    inverse = 1.0 / face_length(ray.ahead, ray.right)
    first = i_camera * columns.samples
    low = float(0.0)
    gap_low = view.above_ground
    k = wp.max(before.k - _WALK_BACK, 0)
    if k > 0:
        low = columns.distances[first + k - 1] * inverse
        gap_low = (
            ray.climb * low - view.pos_ned[2] - surface(ground, view.cell_base, u + low * ray.u, v + low * ray.v)[0]
        )
    while k < columns.samples and low < t_max:
        high = columns.distances[first + k] * inverse
        gap = (
            ray.climb * high - view.pos_ned[2] - surface(ground, view.cell_base, u + high * ray.u, v + high * ray.v)[0]
        )
        if gap <= 0.0:
            gap_high = float(gap)
            for _ in range(_SECANT_STEPS):
                t = low + (high - low) * wp.clamp(gap_low / wp.max(gap_low - gap_high, 1.0e-6), 0.02, 0.98)
                gap = ray.climb * t - view.pos_ned[2] - surface(ground, view.cell_base, u + t * ray.u, v + t * ray.v)[0]
                if gap > 0.0:
                    low = t
                    gap_low = gap
                else:
                    high = t
                    gap_high = gap
            found.t = low + (high - low) * wp.clamp(gap_low / wp.max(gap_low - gap_high, 1.0e-6), 0.0, 1.0)
            return found
        low = high
        gap_low = gap
        k = k + 1
    return found
