"""The settings of the guard: which there are, what they may be, and that they count."""

import pytest

from mission.console.guard_options import guard_of
from mission.console.option_checks import UserError
from mission.flight_config import FlightConfig, OwnerConfig
from mission.scenario.flight.companions import flight_with_policy
from mission.scenario.scenario import Policy
from policies.companion.guard import settings
from policies.companion.guard.settings import SETTINGS, GuardSettingError, GuardSettings, guard_settings
from policies.companion.senses.local_map import ROOM_M
from policies.companion.skills import following, goal_skill


def test_what_is_not_set_is_as_it_ships():
    assert guard_settings({}) == GuardSettings()
    assert guard_settings({"owner_m": 1.5, "search_s": 3}) == GuardSettings(owner_m=1.5, search_s=3.0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"owner": 1.5}, "owner: the guard has no such setting; did you mean owner_m?"),
        ({"xyz": 1.5}, "xyz: the guard has no such setting; there are slow_s, stop_s, "),
        ({"is_on": 0}, "is_on: the guard has no such setting; there are slow_s, "),
        ({"owner_m": 0}, "owner_m: must be above 0, not 0"),
        ({"owner_m": 1e9}, "owner_m: must be at most 20, not 1000000000.0"),
        ({"owner_m": float("nan")}, "owner_m: must be a finite number, not nan"),
        ({"stop_s": 0.5}, "stop_s: must be above slow_s, which is 0.7"),
        ({"slow_s": 3}, "slow_s: must be below stop_s, which is 2"),
    ],
)
def test_what_cannot_be_is_refused_with_what_may(given, sentence):
    with pytest.raises(GuardSettingError) as caught:
        guard_settings(given)
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize("name", SETTINGS)
def test_each_has_bounds_and_a_meaning(name):
    schema = GuardSettings.model_json_schema()["properties"][name]
    assert schema["description"]
    assert "maximum" in schema
    assert {"minimum", "exclusiveMinimum"} & schema.keys()


def test_bounds_are_those_of_what_they_bound():
    assert round(settings.IMAGES_S * 1e6) == following.GUARDED_OLD_US == goal_skill.GUARDED_OLD_US
    assert settings.SOLID_MAX_M < ROOM_M


def test_the_command_line_sets_them():
    assert guard_of(True, ()) == GuardSettings()
    assert guard_of(False, ()) == GuardSettings(is_on=False)
    assert guard_of(True, ("owner_m=1.5", "search_s=3")) == GuardSettings(owner_m=1.5, search_s=3.0)


@pytest.mark.parametrize(
    ("has_guard", "given", "sentence"),
    [
        (True, ("owner_m",), "--guard-setting owner_m: must be NAME=NUMBER"),
        (True, ("owner_m=near",), "--guard-setting owner_m=near: must be NAME=NUMBER"),
        (True, ("owner=2",), "--guard-setting owner: the guard has no such setting; did you mean owner_m?"),
        (True, ("owner_m=-2",), "--guard-setting owner_m: must be above 0, not -2.0"),
        (False, ("owner_m=2",), "--guard-setting and --no-guard: choose one"),
    ],
)
def test_what_the_command_line_cannot_set_is_refused(has_guard, given, sentence):
    with pytest.raises(UserError) as caught:
        guard_of(has_guard, given)
    assert str(caught.value) == sentence


@pytest.mark.parametrize(("has_guard", "settings_of"), [(True, {"owner_m": 1.8}), (False, {})])
def test_a_scenario_flies_under_the_guard_that_it_asks_for(has_guard, settings_of):
    policy = Policy(name="scripted", has_guard=has_guard, guard=settings_of)
    config = FlightConfig(owner=OwnerConfig(), seed=1)
    _, companion = flight_with_policy(config, policy, (), None)
    guard = companion.skill.guard
    assert (guard is None) if not has_guard else guard.settings == GuardSettings(**settings_of)
