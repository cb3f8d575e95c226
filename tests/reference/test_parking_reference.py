"""Overlaps and rays of the parking tasks against plain NumPy: separating axes, sampled distances, sphere tracing."""

import numpy as np
import pytest
import warp as wp

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.parking.arena import (
    INNER_FACES,
    PORTAL_POSITIONS,
    PORTAL_SIZE,
    STOREY_X,
    STOREY_Z,
    pose,
)
from policies.tasks.parking.car import box_meets_capsule, boxes_overlap

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def overlap_kernel(
    a: wp.array(dtype=wp.vec4),
    half_a: wp.vec2,
    b: wp.array(dtype=wp.vec4),
    half_b: wp.vec2,
    radius: float,
    is_box: wp.array(dtype=wp.bool),
    is_capsule: wp.array(dtype=wp.bool),
) -> None:
    """Box a against box b, and against the capsule along b's forward axis."""
    i = wp.tid()
    is_box[i] = boxes_overlap(a[i], half_a, b[i], half_b)
    middle = wp.vec2(b[i][0], b[i][1])
    reach = wp.vec2(b[i][2], b[i][3]) * half_b[1]
    is_capsule[i] = box_meets_capsule(a[i], half_a, middle - reach, middle + reach, radius)


def axes(poses):
    """Right and forward unit vectors, each (n, 2)."""
    sine, cosine = poses[..., 2], poses[..., 3]
    return np.stack([cosine, -sine], -1), np.stack([sine, cosine], -1)


def corners(poses, half):
    right, forward = axes(poses)
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    return poses[:, None, :2] + signs[:, :1] * half[0] * right[:, None] + signs[:, 1:] * half[1] * forward[:, None]


def separation(corners_a, corners_b, directions):
    """The widest gap between the shadows of two sets of corners on each pair's directions; negative: they overlap."""
    gaps = []
    for direction in directions:
        shadow_a = np.einsum("nkd,nd->nk", corners_a, direction)
        shadow_b = np.einsum("nkd,nd->nk", corners_b, direction)
        gaps += [shadow_b.min(1) - shadow_a.max(1), shadow_a.min(1) - shadow_b.max(1)]
    return np.max(gaps, axis=0)


def box_gap(poses, half, points):
    """Distance from points to rounded boxes' cores, (n,)."""
    right, forward = axes(poses)
    gap = points - poses[..., :2]
    local = np.stack([np.sum(gap * right, -1), np.sum(gap * forward, -1)], -1)
    return np.linalg.norm(np.maximum(np.abs(local) - half, 0.0), axis=-1)


def random_poses(rng, count, spread):
    yaw = rng.uniform(-np.pi, np.pi, count)
    return np.column_stack([rng.uniform(-spread, spread, (count, 2)), np.sin(yaw), np.cos(yaw)]).astype(np.float32)


def test_overlaps_of_boxes_and_capsules_agree_with_separating_axes_and_sampled_distances():
    rng = np.random.default_rng(0)
    count = 4000
    half_a, half_b, radius = (0.57, 0.83), (0.5, 1.7), 0.75
    a, b = random_poses(rng, count, 2.0), random_poses(rng, count, 2.0)
    is_box, is_capsule = wp.zeros(count, dtype=wp.bool), wp.zeros(count, dtype=wp.bool)
    sent = [wp.array(poses, dtype=wp.vec4) for poses in (a, b)]
    wp.launch(overlap_kernel, count, [sent[0], wp.vec2(*half_a), sent[1], wp.vec2(*half_b), radius, is_box, is_capsule])
    gap = separation(corners(a, half_a), corners(b, half_b), (*axes(a), *axes(b)))
    clear = np.abs(gap) > 1e-4  # rounding decides the rest
    assert (is_box.numpy() == (gap <= 0.0))[clear].all()
    assert 0.2 < is_box.numpy().mean() < 0.8
    along = np.linspace(-half_b[1], half_b[1], 2001)
    points = b[:, None, :2] + along[:, None] * axes(b)[1][:, None]
    to_line = box_gap(a[:, None], np.array(half_a), points).min(1)
    clear = np.abs(to_line - radius) > 2e-3  # the spacing of the samples
    assert (is_capsule.numpy() == (to_line <= radius))[clear].all()
    assert is_capsule.numpy().mean() > 0.5


def traced(start, direction, gaps):
    """Sphere tracing: the first distance at which the smallest of the gaps is 0, and which one that is."""
    far = 0.0
    for _ in range(3000):
        values = [gap(start + far * direction) for gap in gaps]
        nearest = min(values)
        if nearest < 1e-5:
            break
        far += nearest
    return far, int(np.argmin(values))


def room_gap(centre, radius):
    def gap(point):
        x, z = point - centre
        low_x, high_x, low_z, high_z = INNER_FACES
        return min(x - low_x, high_x - x, z - low_z, high_z - z) - radius

    return gap


def rounded(box, half, radius):
    return lambda point: float(box_gap(np.asarray(box, np.float64), np.array(half), point)) - radius


def scene_gaps(task, row, radius):
    """The surfaces that row's car can see: walls, obstacles, pad, portal, each with its kind."""
    pos = task.world.pos.numpy()[row]
    storey = int(pos[0] > 34.0)
    surfaces = [("wall", room_gap(np.array([STOREY_X[storey], STOREY_Z[storey]]), radius))]
    if hasattr(task, "movers"):
        movers = task.movers.numpy()[row, 2 * storey : 2 * storey + 2]
        surfaces += [("obstacle", rounded(mover, (0.0, 0.75), 0.75 + radius)) for mover in movers]
        portal = tuple(size / 2 for size in PORTAL_SIZE)
        surfaces.append(("portal", rounded(pose(PORTAL_POSITIONS[storey]), portal, radius)))
    else:
        block = tuple(size / 2 for size in (3.467, 1.0))
        surfaces += [("obstacle", rounded(box, block, radius)) for box in task.blocks.numpy()[row]]
    goal = task.world.goal.numpy()[row]
    if int(goal[0] > 34.0) == storey:
        surfaces.append(("goal", rounded(goal, tuple(size / 2 for size in (2.5, 1.0)), radius)))
    return surfaces


@pytest.mark.parametrize(("name", "radius"), [("Parking1", 0.5), ("Parking2", 0.5), ("Parking2", 0.0)])
def test_rays_agree_with_sphere_tracing_in_random_scenes(name, radius):
    rays, length, tags = 7, 25.0, ("wall", "obstacle", "goal", "portal")
    settings = task_settings(name, {"preset": "improved", "rays": rays, "ray_tags": "+".join(tags)})
    task = build_task(name, 24, settings)
    task.set_params({"ray_radius_m": radius, "ray_length_m": length, "ray_degrees": 110.0})
    task.reset(5)
    observation = task.buffers.observations.numpy()[:, -(2 * rays + 1) * 6 :].reshape(24, 2 * rays + 1, 6)
    kinds = set()
    for row in range(24):
        start = task.world.pos.numpy()[row].astype(np.float64)
        surfaces = scene_gaps(task, row, radius)
        for k in range(2 * rays + 1):
            side = 1 if k % 2 else -1
            angle = float(task.world.yaw.numpy()[row]) + side * ((k + 1) // 2) * np.radians(110.0) / rays
            far, which = traced(start, np.array([np.sin(angle), np.cos(angle)]), [gap for _, gap in surfaces])
            *one_hot, miss, fraction = observation[row, k]
            if abs(far - length) < 0.05:
                continue
            if far > length:
                assert (sum(one_hot), miss, fraction) == (0.0, 1.0, 1.0)
                continue
            assert fraction * length == pytest.approx(far, abs=0.03)  # grazing rays: tracing stops 1e-5 from a surface
            assert miss == 0.0
            assert one_hot == [float(tag == surfaces[which][0]) for tag in tags]
            kinds.add(surfaces[which][0])
    assert {"wall", "obstacle", "goal"} <= kinds
