import numpy as np
import pytest
import warp as wp

from sim.walking_owner import Owner
from sim.world.people import PERSON_DT_S, RUN_SPEED_M_S, WALK_SPEED_M_S, Person, chest_ned, is_line_free, person_model
from sim.world.world import World, WorldConfig, build_world

wp.set_module_options({"enable_backward": False})

PEOPLE = 48
STEPS = 3000  # a minute


@pytest.fixture(scope="module")
def forest():
    return build_world(
        WorldConfig(
            seed=3,
            size_m=128.0,
            hill_height_m=12.0,
            hill_wavelength_m=80.0,
            clearing_radius_m=5.0,
            clearing_blend_m=20.0,
            trees_per_ha=300.0,
            tree_height_min_m=8.0,
            tree_height_max_m=15.0,
            has_walls=True,
        )
    )


def walk(world, speed_max_m_s, people=PEOPLE, steps=STEPS, seed=5):
    owner = Owner(world, np.zeros((people, 3)), seed, model=person_model(speed_max_m_s))
    rows = np.empty((steps, people), dtype=owner.people.numpy().dtype)
    for k in range(steps):
        owner.step_to(5 * (k + 1))
        rows[k] = owner.people.numpy()
    return rows


@pytest.fixture(scope="module")
def running(forest):
    return walk(forest, RUN_SPEED_M_S)


@pytest.fixture(scope="module")
def walking(forest):
    return walk(forest, WALK_SPEED_M_S)


def bark_distance(world, pos):
    trees = world.trees
    off = np.hypot(pos[..., 0, None] - trees["north"], pos[..., 1, None] - trees["east"])
    return (off - trees["trunk_radius"]).min(axis=-1)


def test_feet_stay_on_the_ground_and_inside_the_map(forest, running):
    pos = running["pos_ned"]
    np.testing.assert_allclose(-pos[..., 2], forest.height(pos[..., 0], pos[..., 1]), atol=1e-4)
    assert np.abs(pos[..., :2]).max() < 64.0 - 2.0


def test_nobody_goes_through_a_trunk_and_everybody_passes_some_closely(forest, running):
    distance = bark_distance(forest, running["pos_ned"][::2])
    assert distance.min() > 0.3 - 1e-3
    assert ((distance < 1.0).any(axis=0)).mean() > 0.9


def test_speeds_stay_within_the_class_and_use_it(running, walking):
    for rows, limit in ((running, RUN_SPEED_M_S), (walking, WALK_SPEED_M_S)):
        speed = np.linalg.norm(rows["vel_ned"][..., :2], axis=-1)
        assert speed.max() <= limit + 1e-3
        assert (speed.max(axis=0) > 0.6 * limit).mean() > 0.9
        assert 0.02 < (rows["speed"] < 0.1).mean() < 0.3  # stops


def test_the_same_seed_gives_the_same_walk_and_each_row_its_own(forest):
    many = walk(forest, RUN_SPEED_M_S, people=5, steps=300)
    again = walk(forest, RUN_SPEED_M_S, people=5, steps=300)
    alone = walk(forest, RUN_SPEED_M_S, people=1, steps=300)
    assert many.tobytes() == again.tobytes()
    assert many[:, :1].tobytes() == alone.tobytes()
    assert len(np.unique(many[-1]["pos_ned"], axis=0)) == 5


def test_velocity_is_the_change_of_the_place(running):
    pos, vel = running["pos_ned"].astype(np.float64), running["vel_ned"]
    np.testing.assert_allclose(np.diff(pos, axis=0), PERSON_DT_S * vel[1:], atol=1e-4)


def test_accelerations_are_those_of_legs(running):
    change = (running["vel_ned"][10:, :, :2] - running["vel_ned"][:-10, :, :2]) / (10 * PERSON_DT_S)
    size = np.linalg.norm(change, axis=-1)
    assert (size < 5.0).mean() > 0.999  # the rest: a trunk is touched
    assert size.max() < 15.0


def test_people_slow_down_on_slopes(forest, running):
    moving = running["speed_sp"] > 0.5
    north, east, heading = running["pos_ned"][..., 0], running["pos_ned"][..., 1], running["heading_rad"]
    rise = forest.height(north + np.cos(heading), east + np.sin(heading)) - forest.height(north, east)
    fraction = running["speed"] / np.maximum(running["speed_sp"], 0.5)
    assert fraction[moving & (np.abs(rise) > 0.3)].mean() < 0.7 * fraction[moving & (np.abs(rise) < 0.05)].mean()


def test_steps_follow_the_speed(running):
    turns = np.diff(np.unwrap(running["gait_phase"], axis=0), axis=0) / (
        2.0 * np.pi * PERSON_DT_S
    )  # strides per second
    standing = running["speed"][1:] < 1e-3
    fast = running["speed"][1:] > 3.0
    assert np.abs(turns[standing]).max(initial=0.0) < 0.1
    assert 1.2 < turns[fast].mean() < 1.6
    assert (running["is_running"][1:][fast] == 1).all()


@wp.kernel
def sight(world: World, eyes: wp.array[wp.vec3], people: wp.array[Person], is_seen: wp.array[wp.int32]):
    i = wp.tid()
    if is_line_free(world, eyes[i], chest_ned(people[i])):
        is_seen[i] = 1


def test_a_trunk_hides_a_person_who_stands_behind_it(forest):
    trees = forest.trees
    tree = trees[np.argmin(np.hypot(trees["north"] - 20.0, trees["east"]))]
    people = np.zeros(3, dtype=wp.zeros(1, dtype=Person).numpy().dtype)
    # behind the trunk, beside it, and behind a hill of the ground
    off_m = tree["trunk_radius"] + 0.35
    for row, (north, east) in enumerate([(off_m, 0.0), (0.0, 1.5), (off_m, 0.0)]):
        position = np.array([tree["north"] + north, tree["east"] + east])
        people[row]["pos_ned"] = [*position, -forest.height(*position)]
        people[row]["stature_m"] = 1.75
    eyes = people["pos_ned"] - [2.0 * off_m, 0.0, 1.2]
    eyes[2] = people["pos_ned"][2] + [0.0, 0.0, 0.5]  # from under ground
    is_seen = wp.zeros(3, dtype=wp.int32)
    wp.launch(
        sight,
        dim=3,
        inputs=[forest.kernel, wp.array(eyes, dtype=wp.vec3), wp.array(people, dtype=Person)],
        outputs=[is_seen],
    )
    assert is_seen.numpy().tolist() == [0, 1, 0]
