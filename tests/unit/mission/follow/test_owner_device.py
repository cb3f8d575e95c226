"""The owner of a flight is the owner of training: the same world, the same habits."""

import numpy as np
import pytest
import warp as wp

from common.geodesy import DEFAULT_HOME
from common.kernels import FRAME_US
from mission.flight_config import OwnerConfig
from mission.follow.owner_device import FollowedOwner
from policies.tasks.follow_me.follow_me_params import PARAMS
from sim.truth import Truth
from sim.world.world import WorldConfig, build_world

WAITED_S = 20.0
DEFAULTS = {number.name: number.default for number in PARAMS}


@pytest.fixture(scope="module")
def plain():
    return build_world(WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0))


def owner_of(world, seed):
    return FollowedOwner(OwnerConfig(), world, wp.zeros(1, dtype=Truth), seed, DEFAULT_HOME)


@pytest.mark.parametrize("seed", range(8))
def test_who_waited_sets_off_within_two_seconds_as_in_training(plain, seed):
    owner = owner_of(plain, seed)
    time_us = 0
    while time_us < WAITED_S * 1e6:
        time_us += FRAME_US
        owner.frame(time_us, is_followed=False)
    assert owner.vel_ned == (0.0, 0.0, 0.0)
    followed_us = time_us
    while np.hypot(*owner.vel_ned[:2]) < 0.05:
        time_us += FRAME_US
        owner.frame(time_us, is_followed=True)
        assert time_us - followed_us < 2.3e6  # two seconds, and the first step


def test_they_stop_and_pass_trees_as_often_as_in_training(plain):
    model = owner_of(plain, 0)._walking
    assert model.stop_fraction == pytest.approx(DEFAULTS["owner_stop_share"], rel=1e-5)
    assert model.graze_fraction == pytest.approx(DEFAULTS["owner_graze_share"], rel=1e-5)
    assert model.speed_max == pytest.approx(DEFAULTS["owner_speed_max"], rel=1e-5)
