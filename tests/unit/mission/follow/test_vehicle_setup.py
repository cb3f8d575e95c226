"""How the flight controller is set to follow, and that the guard reckons with how it brakes then."""

import pytest

from autopilot.params import parameter_table
from common.airframe import load_airframe
from mission.flight_config import flight_parameters
from mission.flight_settings import FollowOptions
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.follow_options import follow_config
from mission.follow.vehicle_setup import knowing_brakes, setup_of
from policies.companion.guard.settings import GuardSettings
from policies.companion.names import FOLLOWER
from policies.companion.skills.load_skill import load_follower
from policies.experts.follower import ScriptedFollower
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.follow_me.tracked.quick_vehicle import QUICK
from sim.bodies.vehicles import class_of
from tests.unit.mission.follow.follow_flight import following

USUAL = GuardSettings().owner_brake


def brake_of(airframe, guard=None, **parameters):
    table = parameter_table(load_airframe(airframe), vehicle=class_of(load_airframe(airframe)).vehicle)
    for name, value in parameters.items():
        table.set(name, value)
    return knowing_brakes(guard or GuardSettings(), table).owner_brake


def test_a_vehicle_as_it_ships_brakes_as_a_guard_takes_any_vehicle_to():
    assert brake_of("x500") == USUAL


def test_a_quicker_vehicle_is_taken_to_brake_harder_and_a_slower_one_more_gently():
    assert brake_of("x500", MPC_ACC_HOR=6.0, MPC_JERK_MAX=30.0) == pytest.approx(1.5 * USUAL)
    assert brake_of("x500", MPC_ACC_HOR=2.0) == pytest.approx(0.5 * USUAL)


def test_what_it_takes_long_to_come_to_does_not_count():
    assert brake_of("x500", MPC_ACC_HOR=6.0) == USUAL  # the jerk is the usual one
    assert brake_of("x500", MPC_JERK_MAX=5.0) < 0.5 * USUAL


def test_more_than_was_measured_is_not_reckoned_with():
    assert brake_of("x500", MPC_ACC_HOR=15.0, MPC_JERK_MAX=500.0) == pytest.approx(1.5 * USUAL)


def test_a_guard_that_was_told_is_not_told_again():
    assert brake_of("x500", GuardSettings(owner_brake=2.0), MPC_ACC_HOR=6.0, MPC_JERK_MAX=30.0) == 2.0


def test_of_a_vehicle_without_these_parameters_nothing_is_known():
    assert brake_of("rover") == USUAL


@pytest.mark.parametrize("board", ["own", "px4"])
def test_only_our_own_flight_controller_is_set_so(board):
    config = follow_config(FollowOptions(board=board), QUICK)
    assert set(QUICK).isdisjoint(config.parameters) == (board != "own")


def test_what_the_user_sets_stays():
    config = follow_config(FollowOptions(parameters=["MPC_ACC_HOR=3"]), QUICK)
    assert flight_parameters(config, load_airframe("x500"))["MPC_ACC_HOR"] == 3.0


def test_who_goes_by_the_senses_has_a_quick_vehicle_and_nobody_else():
    """As where they were trained."""
    assert setup_of(any_pilot(FOLLOWER)).items() >= QUICK.items()
    assert set(QUICK).isdisjoint(setup_of(ScriptedFollower()))
    assert set(QUICK).isdisjoint(setup_of(load_follower("navigate-rover-follow")))


def test_it_is_trained_with_what_it_flies():
    for observation, is_quick in (("tracked", True), ("state", False)):
        rows = FollowMe(FollowSettings(observation=observation), 2).rig.arrays.autopilot.control_params.numpy()
        assert (rows["accel_max_xy"] == QUICK["MPC_ACC_HOR"]).all() == is_quick


def test_the_guard_of_a_flight_knows_its_vehicle():
    _, companion = following(parameters=QUICK)
    assert companion.skill.guard.settings.owner_brake == pytest.approx(1.5 * USUAL)
