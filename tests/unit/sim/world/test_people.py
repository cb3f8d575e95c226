import numpy as np
import pytest

from sim.owner import Owner
from sim.world.people import PERSON_DT_S, RUN_SPEED_M_S, WALK_SPEED_M_S, person_model
from sim.world.world import WorldConfig, build_world

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
