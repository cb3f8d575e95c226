"""Scenario files: what may be written short, and the sentence that each fault gets."""

from dataclasses import fields
from typing import get_args

import pytest
import yaml

from autopilot.interface.vehicle_state import Mode
from common.intervals import Interval
from mission.console.option_checks import UserError
from mission.flight_settings import WORLD_KINDS
from mission.scenario.flight.building import flight_configs
from mission.scenario.flight.flying import ACTIONS
from mission.scenario.judging.judge import JUDGES
from mission.scenario.parts.checks import Check, FigureName
from mission.scenario.parts.faults import SensorName
from mission.scenario.parts.steps import ModeName, Step, Takeoff
from mission.scenario.scenario import Scenario, World, WorldName
from mission.scenario.scenario_file import READY, find_files, parse_scenario, read_scenario
from policies.tasks.follow_me.scorecard import Scorecard
from sim.faults import BIAS_UNITS
from sim.world.world import WorldConfig

HOP = """about: Up and down.
vehicle:
  script:
    - arm
    - takeoff: 5
    - land
checks:
  - at_end: {is_armed: false}
"""


def parsed(text, tmp_path):
    return parse_scenario(text, "hop.scenario.yaml", tmp_path)


def fault_of(text, tmp_path):
    with pytest.raises(UserError) as refused:
        parsed(text, tmp_path)
    return str(refused.value)


def test_a_step_may_be_its_name_or_its_main_value_alone(tmp_path):
    scenario = parsed(HOP, tmp_path)
    assert scenario.name == "hop"
    arm, takeoff, land = scenario.vehicle.script
    assert (arm.name_chosen, land.name_chosen) == ("arm", "land")
    assert takeoff.chosen == Takeoff(height_m=5.0)
    assert scenario == parsed(
        HOP.replace("takeoff: 5", "takeoff: {height_m: 5}").replace("- land", "- land:"), tmp_path
    )


def test_python_makes_the_same_scenario(tmp_path):
    made = Scenario.model_validate(
        {
            "name": "hop",
            "about": "Up and down.",
            "vehicle": {"script": [Step(arm={}), Step(takeoff=Takeoff(height_m=5.0)), Step(land={})]},
            "checks": [Check(at_end={"is_armed": False})],
        }
    )
    assert made == parsed(HOP, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("    - arm\n", "    - arn\n", "3: vehicle.script[0]: unknown step 'arn'; did you mean arm?"),
        ("takeoff: 5", "takeof: 5", "5: vehicle.script[1].takeof: unknown key; did you mean takeoff?"),
        ("takeoff: 5", "takeoff: high", "5: vehicle.script[1].takeoff.height_m: must be a number, not 'high'"),
        ("takeoff: 5", "takeoff: -1", "5: vehicle.script[1].takeoff.height_m: must be above 0, not -1"),
        ("takeoff: 5", "set_mode: holt", "must be hold, takeoff, mission,"),
        ("is_armed", "is_arned", "8: checks[0].at_end.is_arned: unknown key; did you mean is_armed?"),
        (
            "at_end: {is_armed: false}",
            "always: altitud > 3",
            "8: checks[0].always.condition: 'altitud': no such quantity",
        ),
        ("about:", "xyz:", "1: xyz: unknown key; there are name, about, seeds,"),
        ("about:", "world: {kind: lunar}\nabout:", "1: world.kind: must be hills, plain, airfield, follow, forest,"),
        (
            "about:",
            "owner:\n  numbers:\n    light: 0.5\n    bystandrs: 3\nabout:",
            "4: owner.numbers.bystandrs: unknown key; did you mean bystanders?",
        ),
        (
            "about:",
            "owner: {numbers: {xyz: 3}}\nabout:",
            "1: owner.numbers.xyz: unknown key; there are hill_height_m, trees_per_ha, owner_speed_max,",
        ),
        ("about:", "aboot:", "1: aboot: unknown key; did you mean about?"),
        ("about: Up and down.", "about: [", "not YAML"),
        ("vehicle:\n", "vehicle:\n  plan: a.plan\n", "2: vehicle: plan and script: choose one"),
        ("checks:", "faults: [{at: 1, when: speed > 1, battery: 0.1}]\nchecks:", "7: faults[0]: a fault has either at"),
        ("- at_end", "- tilt: {max: 3}\n    from: upp\n  - at_end", "1: checks[0]: nothing makes a mark 'upp'"),
        ("- at_end", "- tilt: {max: 3}\n    speed: {max: 3}\n  - at_end", "names speed and tilt: put each in an entry"),
    ],
)
def test_a_fault_is_one_sentence_with_its_place(tmp_path, old, new, fault):
    assert old in HOP
    said = fault_of(HOP.replace(old, new, 1), tmp_path)
    assert fault in said
    assert said.startswith("hop.scenario.yaml")
    assert "\n" not in said


def test_the_word_off_is_no_boolean(tmp_path):
    text = HOP + "faults:\n  - at: 3\n    sensor: {name: gnss, mode: off}\n"
    assert parsed(text, tmp_path).faults[0].sensor.mode == "off"


def test_paths_are_seen_from_the_file(tmp_path):
    text = "vehicle: {plan: round.plan, airframe: own.toml}\n"
    vehicle = parsed(text, tmp_path).vehicle
    assert vehicle.plan == tmp_path.resolve() / "round.plan"
    assert vehicle.airframe == str(tmp_path.resolve() / "own.toml")


def test_files_are_found_in_folders(tmp_path):
    (tmp_path / "deep").mkdir()
    for name in ("b.scenario.yaml", "deep/a.scenario.yaml", "other.yaml"):
        (tmp_path / name).write_text(HOP)
    assert find_files([tmp_path]) == [tmp_path / "b.scenario.yaml", tmp_path / "deep" / "a.scenario.yaml"]
    with pytest.raises(UserError, match="no such file or folder"):
        find_files([tmp_path / "none"])


@pytest.mark.parametrize("path", find_files([READY]), ids=lambda path: path.name.partition(".")[0])
def test_scenarios_that_ship_say_what_they_show_and_ask_something(path):
    scenario = read_scenario(path)
    assert scenario.about.endswith(".")
    assert scenario.checks
    assert flight_configs(scenario, 1)
    dumped = yaml.safe_dump(scenario.model_dump(mode="json", by_alias=True, exclude_unset=True))
    assert parse_scenario(dumped, path.name, path.parent) == scenario


def test_a_world_has_what_the_world_module_offers():
    own = World.model_fields.keys() - {"kind", "file"}
    assert own == WorldConfig.model_fields.keys()
    for name in own - {"has_walls"}:
        ours, theirs = World.model_fields[name].metadata, WorldConfig.model_fields[name].metadata
        assert ours == theirs, name


def test_names_are_those_of_the_parts_that_do_it():
    assert set(get_args(SensorName)) == BIAS_UNITS.keys()
    assert set(get_args(ModeName)) == {mode.name.lower() for mode in Mode}
    assert set(Step.names()) == ACTIONS.keys()
    assert set(Check.names()) == JUDGES.keys()
    assert set(get_args(FigureName)) == {each.name for each in fields(Scorecard) if each.type is Interval}
    assert set(WORLD_KINDS) < set(get_args(WorldName))


def test_a_wrong_parameter_is_refused_before_anything_flies():
    with pytest.raises(UserError, match="MPC_XY_VEL_MAXX"):
        flight_configs(Scenario(vehicle={"parameters": {"MPC_XY_VEL_MAXX": 3.0}}), 1)
