"""The world that the command line's options describe."""

import numpy as np
import pytest

from mission.flight_options import FlightOptions, flight_config
from policies.tasks.follow_me.world import FOLLOW_WORLD
from sim.world.world import build_world


def options(**changed):
    """`honeyguide fly` without any option, and what is changed."""
    given = {
        "plan": None, "is_idle": False, "once": False, "speed": "1", "seconds": None, "seed": 0, "wind_m_s": 0.0,
        "wind_from_deg": 270.0, "noise": 1.0, "airframe": "x500", "home": "47.397742,8.545594,488", "world_seed": 1,
        "trees_per_ha": 60.0, "hill_height_m": 12.0, "has_walls": False, "host": "127.0.0.1", "bind": "",
        "tcp_port": None, "has_to_sign": False, "gcs_port": 14550, "api_port": 14540, "run_folder": None,
    }  # fmt: skip
    return FlightOptions(**(given | changed))


@pytest.mark.parametrize("changed", [{"is_idle": True}, {"world_seed": 7, "trees_per_ha": 300.0}])
def test_no_tree_stands_within_80_m_of_home_and_some_do_beyond(changed):
    trees = build_world(flight_config(options(**changed), None).world).trees
    nearest_m = np.hypot(trees["north"], trees["east"]) - trees["crown_radius"]
    assert 80.0 < nearest_m.min() < 100.0


def test_the_world_of_an_owner_stays_that_of_training():
    world = flight_config(options(owner="walk", trees_per_ha=FOLLOW_WORLD.trees_per_ha), None).world
    assert world == FOLLOW_WORLD
