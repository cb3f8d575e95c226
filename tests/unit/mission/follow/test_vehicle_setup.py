"""How the flight controller is set to follow, and that the guard reckons with how it brakes then."""

import pytest

from common.airframe import AIRFRAME_FOLDER, load_airframe
from common.geodesy import GRAVITY_M_S2
from mission.flight_config import FlightConfig, OwnerConfig, flight_parameters
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.vehicle_setup import as_trained, owner_brake
from policies.companion.guard.settings import GuardSettings
from policies.companion.names import FOLLOWER
from policies.experts.follower import ScriptedFollower
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.follow_me.tracked.quick_vehicle import QUICK, QUICK_BRAKE_M_S2, trained_brake_m_s2
from tests.unit.mission.follow.follow_flight import following

USUAL = GuardSettings().owner_brake


def brake_of(airframe, engine="native", **parameters):
    config = FlightConfig(airframe=airframe, engine=engine, parameters=parameters)
    return owner_brake(config, flight_parameters(config, load_airframe(airframe)))


def quick(**changed):
    """A flight by the policy that ships, which goes by the senses, and its guard."""
    pilot = any_pilot(FOLLOWER)
    pilot.reset()
    flight, companion = following(pilot=pilot, **changed)
    return flight, companion.skill.guard


def test_a_vehicle_as_it_ships_brakes_as_a_guard_takes_any_vehicle_to():
    assert brake_of("x500") == USUAL


def test_a_quicker_vehicle_is_taken_to_brake_harder_and_a_slower_one_more_gently():
    leaning_m_s2 = GRAVITY_M_S2 - 3.0  # by 45 degrees, less what the wind takes
    assert brake_of("x500", **QUICK) == pytest.approx(leaning_m_s2 / 4.0 * USUAL)
    assert brake_of("x500", MPC_ACC_HOR=2.0) == pytest.approx(0.5 * USUAL)


def test_what_it_takes_long_to_come_to_does_not_count():
    assert brake_of("x500", MPC_ACC_HOR=7.0) == USUAL  # the jerk is the usual one
    assert brake_of("x500", MPC_JERK_MAX=5.0) < 0.5 * USUAL


def test_nor_what_it_may_not_lean_for():
    assert brake_of("x500", MPC_TILTMAX_AIR=20.0, **QUICK) < 0.5 * USUAL


def test_more_than_was_measured_is_not_reckoned_with():
    assert brake_of("x500", MPC_TILTMAX_AIR=60.0, MPC_ACC_HOR=15.0, MPC_JERK_MAX=500.0) == pytest.approx(1.75 * USUAL)


@pytest.mark.parametrize("engine", ["native", "jsbsim", "pybullet"])
def test_where_nothing_was_measured_it_brakes_no_harder_than_any_vehicle(engine, tmp_path):
    own = tmp_path / "mine.toml"
    own.write_text((AIRFRAME_FOLDER / "x500.toml").read_text())
    airframe = str(own) if engine == "native" else "x500"
    assert brake_of(airframe, engine, **QUICK) == USUAL
    assert brake_of(airframe, engine, MPC_ACC_HOR=2.0) == pytest.approx(0.5 * USUAL)


def test_of_a_vehicle_without_these_parameters_nothing_is_known():
    assert brake_of("rover") == USUAL
    assert as_trained(FlightConfig(airframe="rover"), any_pilot(FOLLOWER)).parameters == {}


def test_who_goes_by_the_senses_has_a_quick_vehicle_and_nobody_else():
    """As where they were trained."""
    config = FlightConfig(owner=OwnerConfig(), parameters={"MPC_JERK_MAX": 25.0})
    assert as_trained(config, any_pilot(FOLLOWER)).parameters == QUICK | {"MPC_JERK_MAX": 25.0}
    assert as_trained(config, ScriptedFollower()) == config


@pytest.mark.parametrize("airframe", ["x500", "x500+f450"])
def test_it_is_trained_with_what_it_flies(airframe):
    for observation, is_quick in (("tracked", True), ("state", False)):
        task = FollowMe(FollowSettings(observation=observation, airframe=airframe), 4)
        task.reset(seed=3)
        rows = task.rig.arrays.autopilot.control_params.numpy()
        assert (rows["accel_max_xy"] == QUICK["MPC_ACC_HOR"]).all() == is_quick


def test_in_airframes_that_were_not_measured_it_is_trained_under_the_guard_that_they_would_have():
    assert trained_brake_m_s2(("x500", "f450")) == QUICK_BRAKE_M_S2
    assert trained_brake_m_s2(("x500", "mine.toml")) == USUAL


def test_the_guard_of_a_flight_knows_its_vehicle_as_training_does():
    flight, guard = quick()
    assert guard.settings.owner_brake == QUICK_BRAKE_M_S2
    assert guard.settings.brake == QUICK_BRAKE_M_S2
    flight.params.set("MPC_ACC_HOR", 2.0)  # as by a ground station
    assert guard.settings.owner_brake == pytest.approx(0.5 * USUAL)
    guard.reckon_with(0.1)
    assert guard.settings.owner_brake == pytest.approx(0.5 * USUAL)
    assert guard.settings.reaction_s == pytest.approx(GuardSettings().reaction_s + 0.1)


def test_a_guard_that_was_told_is_not_told_again():
    flight, guard = quick(settings={"owner_brake": 2.0})
    assert guard.settings.owner_brake == 2.0
    flight.params.set("MPC_ACC_HOR", 5.0)
    assert guard.settings.owner_brake == 2.0
    assert guard.settings.brake == pytest.approx(1.25 * USUAL)
