import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.parking.arena import pose

WALL_Z_HIGH, WALL_X_HIGH, WALL_X_LOW = 14.995, 14.935, -14.945
LENGTH = 100.0


def seen(*, pos=(0.0, 0.0), yaw_deg=0.0, blocks=(), goal=(-14.0, -14.0, 0.0), params=None, **settings):
    """The rays of one car, (rays, tags + 2), and the task."""
    task = build_task("Parking1", 1, task_settings("Parking1", {"rays": 1, **settings}))
    task.set_params({"ray_degrees": 90.0, "ray_length_m": LENGTH, "turn_deg": 0.1, "push_n": 0.0, **(params or {})})
    task.reset(0)
    task.world.pos.numpy()[0] = pos
    task.world.yaw.numpy()[0] = np.radians(yaw_deg)
    task.world.goal.numpy()[0] = pose(goal)
    aside = [(14.0, -14.0 + 2 * k, 0.0) for k in range(3)]
    task.blocks.numpy()[0] = [pose(position) for position in (*blocks, *aside)][:3]
    task.step()  # a push of 0 N: nothing moves
    size = task.rules.tag_count + 2
    return task.buffers.observations.numpy()[0, -(2 * task.rules.ray_count + 1) * size :].reshape(-1, size)


def test_the_order_is_ahead_then_right_then_left():
    ahead, right, left = seen(pos=(3.0, 1.0))[:, -1] * LENGTH
    assert ahead == pytest.approx(WALL_Z_HIGH - 1.0 - 0.5, rel=1e-5)
    assert right == pytest.approx(WALL_X_HIGH - 3.0 - 0.5, rel=1e-5)
    assert left == pytest.approx(3.0 - WALL_X_LOW - 0.5, rel=1e-5)


def test_rays_turn_with_the_car():
    ahead, right, left = seen(pos=(3.0, 1.0), yaw_deg=-90.0)[:, -1] * LENGTH
    assert ahead == pytest.approx(3.0 - WALL_X_LOW - 0.5, rel=1e-5)
    assert right == pytest.approx(WALL_Z_HIGH - 1.0 - 0.5, rel=1e-5)
    assert left == pytest.approx(1.0 + 14.955 - 0.5, rel=1e-5)


def test_a_tagged_hit_sets_its_tag_and_an_untagged_one_none():
    rays = seen(blocks=[(0.0, 6.0, 0.0)])
    assert rays[0] == pytest.approx([1.0, 0.0, (6.0 - 0.5 - 0.5) / LENGTH])  # the block
    assert rays[1] == pytest.approx([0.0, 0.0, (WALL_X_HIGH - 0.5) / LENGTH])  # a wall: seen, without a tag


def test_beyond_the_length_a_ray_misses_with_fraction_one():
    assert seen(params={"ray_length_m": 10.0})[0].tolist() == [0.0, 1.0, 1.0]


def test_a_sphere_meets_what_a_thin_ray_passes_and_rounds_its_corners():
    block = (0.0, 6.0, 90.0)  # half a metre wide to each side of x = 0
    assert seen(pos=(0.6, 0.0), blocks=[block], params={"ray_radius_m": 0.0})[0, 0] == 0.0
    hit = seen(pos=(0.8, 0.0), blocks=[block])[0]
    edge = 6.0 - 3.467 / 2
    assert hit == pytest.approx([1.0, 0.0, (edge - 0.4) / LENGTH], abs=1e-6)  # 0.3 aside of the corner: 0.4 before it
    assert seen(pos=(1.02, 0.0), blocks=[block])[0, 0] == 0.0


def test_pads_are_hit_as_triggers_are():
    rays = seen(goal=(0.0, 8.0, 0.0), ray_tags="goal+obstacle")
    assert rays[0] == pytest.approx([1.0, 0.0, 0.0, (8.0 - 0.5 - 0.5) / LENGTH])


def test_the_fan_is_spread_evenly_to_each_side():
    rays = seen(rays=4, params={"ray_degrees": 80.0, "ray_radius_m": 0.0})[:, -1] * LENGTH
    angles = np.radians([20.0, 40.0])
    assert rays[1] == pytest.approx(WALL_Z_HIGH / np.cos(angles[0]), rel=1e-5)
    assert rays[2] == pytest.approx(WALL_Z_HIGH / np.cos(angles[0]), rel=1e-5)
    assert rays[3] == pytest.approx(WALL_Z_HIGH / np.cos(angles[1]), rel=1e-5)
