"""Scenario files: what may be written short, and the sentence that each fault gets."""

import pickle
import shutil
from pathlib import Path
from typing import get_args

import pytest
import yaml

import common.airframes
from autopilot.interface.vehicle_state import Mode
from mission.console.option_checks import UserError
from mission.flight_settings import WORLD_KINDS
from mission.scenario.flight.building import check_scenario, flight_configs
from mission.scenario.flight.flying import ACTIONS
from mission.scenario.judging.judge import JUDGES
from mission.scenario.keeping import keep_scenario
from mission.scenario.parts.checks import Check
from mission.scenario.parts.faults import SensorName
from mission.scenario.parts.steps import ModeName, Step, Takeoff
from mission.scenario.scenario import Scenario, World, WorldName
from mission.scenario.scenario_file import READY, find_files, parse_scenario, read_scenario
from sim.faults import BIAS_UNITS
from sim.world.world import WorldConfig
from tests.unit.mission.scenario.parsing import parsed

AIRFRAMES = Path(common.airframes.__file__).parent
HOP = """about: Up and down.
vehicle:
  script:
    - arm
    - takeoff: 5
    - land
checks:
  - at_end: {is_armed: false}
"""


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
        (
            "vehicle:\n",
            "vehicle:\n  policy:\n    name: scripted\n    guard:\n      owner: 3\n",
            "6: vehicle.policy.guard.owner: the guard has no such setting; did you mean owner_m?",
        ),
        (
            "vehicle:\n",
            "vehicle:\n  policy: {name: scripted, guard: {owner_m: -1}}\n",
            "3: vehicle.policy.guard.owner_m: must be above 0, not -1",
        ),
        (
            "vehicle:\n",
            "vehicle:\n  policy: {name: scripted, has_guard: false, guard: {owner_m: 2}}\n",
            "3: vehicle.policy.guard: it has none: has_guard is false",
        ),
        ("about:", "seeds: [1, -1]\nabout:", "1: seeds[1]: must be at least 0, not -1"),
        ("about:", "seeds: [2147483648]\nabout:", "1: seeds[0]: must be at most 2.14748e+09, not 2147483648"),
        *(
            ("about:", f"name: {name}\nabout:", f"1: name: is the name of files and folders: no path, not {name!r}")
            for name in ("../esc", "/tmp/esc", "a\\b", "..")
        ),
        ("about:", "aboot:", "1: aboot: unknown key; did you mean about?"),
        ("about: Up and down.", "about: [", "not YAML"),
        ("vehicle:\n", "vehicle:\n  plan: a.plan\n", "2: vehicle: plan and script: choose one"),
        ("checks:", "faults: [{at: 1, when: speed > 1, battery: 0.1}]\nchecks:", "7: faults[0]: a fault has either at"),
        ("- at_end", "- tilt: {max: 3}\n    from: upp\n  - at_end", "9: checks[0].from: nothing makes a mark 'upp'"),
        (
            "- at_end",
            "- tilt: {max: 3}\n    from: 3\n    vehicle: 3\n  - at_end",
            "10: checks[0].vehicle: there is no vehicle 3; there is one vehicle, 1",
        ),
        (
            "checks:",
            "faults:\n  - at: 1\n    battery: 0.1\n    vehicle: 3\nchecks:",
            "10: faults[0].vehicle: there is no vehicle 3; there is one vehicle, 1",
        ),
        (
            "- at_end: {is_armed: false}",
            "- near: {to_vehicle: 2, within_m: 3}",
            "8: checks[0].near.to_vehicle: there is no vehicle 2; there is one vehicle, 1",
        ),
        ("- at_end", "- tilt: {max: 3}\n    fron: 3\n  - at_end", "9: checks[0].fron: unknown key; did you mean from?"),
        (
            "- at_end",
            "- tilt: {max: 3}\n    xyz: 3\n  - at_end",
            "9: checks[0].xyz: unknown key; there are name, from,",
        ),
        (
            "- at_end: {is_armed: false}",
            "- away: {pont: [0, 0, 0], min_m: 3}",
            "8: checks[0].away.pont: unknown key; did you mean point?",
        ),
        ("at_end: {is_armed: false}", "altitude: {min: 10, max: 5}", "8: checks[0].altitude: min 10 is above max 5"),
        (
            "at_end: {is_armed: false}",
            "scorecard: {in_view: {min: 0.9, max: 0.5}}",
            "8: checks[0].scorecard.in_view: min 0.9 is above max 0.5",
        ),
        (
            "at_end: {is_armed: false}",
            "figures: {park_seconds: {max: 5}}",
            "8: checks[0].figures.park_seconds: must be park_distance_m, park_turn_deg, park_s or policy_goto_s, not",
        ),
        (
            "at_end: {is_armed: false}",
            "duration: {min_s: 10, max_s: 5}",
            "8: checks[0].duration: min_s 10 is above max_s 5",
        ),
        (
            "at_end: {is_armed: false}",
            "following: {distance_min_m: 3, distance_max_m: 2}",
            "8: checks[0].following: distance_min_m 3 is above distance_max_m 2",
        ),
        ("- at_end", "- tilt: {max: 3}\n    from: 8\n    to: 5\n  - at_end", "8: checks[0]: from 8 is above to 5"),
        (
            "  script:\n",
            "  count: 3\n  start:\n    ne_m: [0, 30]\n  script:\n",
            "5: vehicle.start.ne_m: is one place for 3 vehicles: write each in vehicles",
        ),
        ("about:", "vehicles: [{}]\nabout:", "1: vehicles: there is vehicle, too: choose one"),
        ("- at_end", "- tilt: {max: 3}\n    speed: {max: 3}\n  - at_end", "names speed and tilt: put each in an entry"),
    ],
)
def test_a_fault_is_one_sentence_with_its_place(tmp_path, old, new, fault):
    assert old in HOP
    said = fault_of(HOP.replace(old, new, 1), tmp_path)
    assert fault in said
    assert said.startswith("hop.scenario.yaml")
    assert "\n" not in said


@pytest.mark.parametrize(
    ("check", "fault"),
    [
        (
            "estimator",
            ".estimator: asks for nothing: needs horizontal_m, vertical_m, velocity_m_s, tilt_deg or heading_deg",
        ),
        ("estimator: {percent: 90}", ".estimator: asks for nothing: needs horizontal_m,"),
        ("duration: {}", ".duration: asks for nothing: needs min_s or max_s"),
        ("battery:", ".battery: asks for nothing: needs used_max_mah, used_max_wh or remaining_min"),
        ("at_end: {is_crashed: null}", ".at_end: asks for nothing: needs is_armed, is_landed, is_crashed or near"),
        ("at_end: {within_m: 3}", ".at_end: within_m: is of near, which is left out"),
        ("following: {has_collision: null}", ".following: asks for nothing: needs in_band_min,"),
        ("scorecard: {}", ".scorecard: must not be empty"),
        ("scorecard: {in_view: {}}", ".scorecard.in_view: needs min, max or both"),
        ("figures: {}", ".figures: must not be empty"),
    ],
)
def test_a_check_that_asks_for_nothing_is_refused(tmp_path, check, fault):
    assert f": checks[0]{fault}" in fault_of(HOP.replace("at_end: {is_armed: false}", check), tmp_path)


@pytest.mark.parametrize(
    ("check", "fault"),
    [
        ("at_end:\n    from: 3", "from: at_end is of the whole flight, not of a part: leave it out"),
        ("at_end:\n    during: land", "during: at_end is of the whole flight"),
        ("following:\n    to: 30", "to: following is of the whole flight"),
        ("scorecard: {in_view: {min: 0.5}}\n    during: hold", "during: scorecard is of the whole flight"),
        ("interventions: 3\n    from: 3", "from: interventions is of the whole flight"),
        ("figures: {park_s: {max: 60}}\n    to: 30", "to: figures is of the whole flight"),
        ("modes: [land]\n    during: land", "during: modes is of all flight modes: leave it out, or use from and to"),
        ("separation: 3\n    during: land", "during: separation is of all flight modes"),
        ("not_heard: x\n    to: .nan", "to"),
    ],
)
def test_a_part_of_the_flight_that_a_check_does_not_look_at_is_refused(tmp_path, check, fault):
    said = fault_of(HOP.replace("at_end: {is_armed: false}", check), tmp_path)
    assert said.startswith(f"hop.scenario.yaml:9: checks[0].{fault}")


@pytest.mark.parametrize("check", ["at_end", "following", "no_contact"])
def test_a_check_with_a_default_may_be_its_name_alone(tmp_path, check):
    assert parsed(HOP.replace("at_end: {is_armed: false}", check), tmp_path).checks[0].name_chosen == check


@pytest.mark.parametrize(
    ("fence", "fault"),
    [
        ("{}", "a fence is either a circle (circle_ne_m, radius_m) or a polygon (polygon_ne_m)"),
        ("{keeps: out}", "a fence is either a circle"),
        ("{radius_m: 40}", "a circle has both circle_ne_m (its middle) and radius_m"),
        ("{circle_ne_m: [0, 0]}", "a circle has both"),
        ("{polygon_ne_m: [[0, 0], [0, 9], [9, 0]], radius_m: 3}", "a circle has both"),
        ("{polygon_ne_m: [[0, 0], [0, 9], [9, 0]], circle_ne_m: [0, 0], radius_m: 3}", "a fence is either a circle"),
    ],
)
def test_a_fence_of_no_shape_or_two_is_refused(tmp_path, fence, fault):
    said = fault_of(HOP.replace("takeoff: 5", f"fence: {fence}"), tmp_path)
    assert said.startswith(f"hop.scenario.yaml:5: vehicle.script[1].fence: {fault}")


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
    check_scenario(scenario, path.name)
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
    assert set(WORLD_KINDS) < set(get_args(WorldName))


def test_a_scenario_knows_its_lines_wherever_it_is_sent(tmp_path):
    scenario = parsed("vehicle:\n  airframe: x5000\n", tmp_path)
    sent = pickle.loads(pickle.dumps(scenario.model_copy(update={"seeds": (3,)})))
    with pytest.raises(UserError, match=r"^hop\.scenario\.yaml:2: vehicle\.airframe: "):
        check_scenario(sent, "not its name")


def test_a_kept_scenario_needs_no_file_of_where_it_came_from(tmp_path):
    there, kept = tmp_path / "there", tmp_path / "kept"
    for folder in (there, kept):
        folder.mkdir()
    (there / "mine.toml").write_text((AIRFRAMES / "x500.toml").read_text())
    (there / "hop.py").write_text("async def hop(drone):\n    await drone.arm()\n")
    scenario = there / "own.scenario.yaml"
    scenario.write_text("vehicle: {airframe: mine.toml, python: 'hop.py:hop'}\n")
    keep_scenario(kept, read_scenario(scenario), 3)
    shutil.rmtree(there)
    again = read_scenario(kept / "own.scenario.yaml")
    check_scenario(again, "own")
    assert again.seeds == (3,)
    assert Path(again.vehicle.airframe) == kept / "mine.toml"


def test_kept_files_of_one_name_stay_apart(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "hop.py").write_text(f"async def hop(drone): '{name}'\n")
    scenario = tmp_path / "two.scenario.yaml"
    scenario.write_text("vehicles: [{python: 'a/hop.py:hop'}, {python: 'b/hop.py:hop'}, {python: 'a/hop.py:hop'}]\n")
    kept = tmp_path / "kept"
    kept.mkdir()
    keep_scenario(kept, read_scenario(scenario), 3)
    files = [Path(vehicle.python.removesuffix(":hop")) for vehicle in read_scenario(kept / "two.scenario.yaml").fleet]
    assert ["'a'" in file.read_text() for file in files] == [True, False, True]
    assert {file.parent for file in files} == {kept}
