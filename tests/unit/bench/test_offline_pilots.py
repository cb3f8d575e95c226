"""The mediocre pilots that offline training learns from: they get there, worse than who ships, the same each time."""

import numpy as np
import pytest

from bench.offline_story.pilots import Clumsy, ClumsyDriver, ClumsyNavigator, UnsteadyHand
from mission.benchmark import navigating, parking
from mission.benchmark.goal_pilots import goal_pilot
from policies.companion.guard.settings import GuardSettings
from policies.companion.vector_pilot import DrivingPilot, NavigationPilot

SEED = 500_004  # even: of what is learnt from


@pytest.mark.parametrize(
    ("pilot", "shown"),
    [
        (ClumsyNavigator(), lambda rng: (rng.uniform(0.0, 1.0, NavigationPilot.frame_size).astype(np.float32),)),
        (ClumsyDriver(), lambda rng: (rng.normal(0.0, 0.3, 2 * len(DrivingPilot.task.frame)).astype(np.float32),)),
        (Clumsy(), lambda rng: (rng.normal(0.0, 0.3, 21).astype(np.float32), np.zeros((64, 64, 4), np.uint8))),
    ],
)
def test_after_a_reset_they_make_the_same_errors(pilot, shown):
    found = []
    for _ in range(2):
        rng = np.random.default_rng(1)
        pilot.reset()
        found.append([pilot.act(*shown(rng)) for _ in range(20)])
    assert np.array_equal(*found)
    assert (abs(np.array(found)) <= 1.0).all()


def test_a_hand_is_late_and_trembles():
    hand = UnsteadyHand(2, noise=0.0, late=3)
    done = [float(hand.done(np.full(2, k / 10, np.float32))[0]) for k in range(6)]
    assert done == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.1, 0.2])
    trembling = UnsteadyHand(2, noise=0.1)
    errors = np.array([trembling.done(np.zeros(2, np.float32)) for _ in range(2000)])
    assert 0.1 < errors.std() < 0.25  # 0.1 over the root of 1 - 0.8²


def test_the_navigator_gets_through_a_forest_under_the_guard_and_takes_its_time():
    pilot = goal_pilot("bench.offline_story.pilots:ClumsyNavigator", NavigationPilot, 2)
    crossing = navigating.cross(pilot, navigating.CONDITIONS["200-late-0"], SEED, GuardSettings())
    assert crossing.outcome == "arrived"
    assert crossing.speed_m_s < 4.5  # the policy that ships flies at more than 5 m/s


def test_the_driver_parks_where_nothing_moves():
    pilot = goal_pilot("bench.offline_story.pilots:ClumsyDriver", DrivingPilot, 2)
    assert parking.parked(pilot, parking.CONDITIONS["calm"], SEED, GuardSettings()).outcome == "there"
