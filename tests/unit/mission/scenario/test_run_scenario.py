"""A scenario is flown and judged: margins, worst moments, what fails and why; twice the same, byte for byte."""

import pickle
from math import isnan

import pytest

from mission.console.option_checks import UserError
from mission.scenario.runner import UnderWay, run_scenario
from mission.scenario.scenario import Scenario
from sim.faults import FAULT_MODES

PLAIN = {"kind": "plain"}
HOP = ["arm", {"takeoff": 5}, {"mark": "up"}, {"hold": 3}, {"mark": "held"}, "land"]


def flown(script=HOP, seed=None, folder=None, **keys):
    vehicle = {"script": script, **keys.pop("vehicle", {})}
    return run_scenario(Scenario.model_validate({"world": PLAIN, "vehicle": vehicle, **keys}), seed, folder=folder)


def by_name(result):
    return {check.name: check for check in result.checks}


@pytest.fixture(scope="module")
def hop():
    checks = [
        {"altitude": {"min": 4, "max": 5.5}, "from": "up", "to": "held"},
        {"altitude": {"max": 3}, "name": "too low"},
        {"near": {"point": [0, 0, -5], "within_m": 1}, "from": "up", "to": "held"},
        {"modes": ["takeoff", "hold", "land"]},
        {"modes": {"order": ["takeoff", "land"], "is_exact": True}, "name": "exact modes"},
        {"heard": "landed"},
        {"not_heard": "LANDED", "name": "silent"},
        {"always": "tilt < 60 and altitude > -1"},
        {"once": "altitude > 100"},
        {"duration": {"max_s": 5}, "from": "up", "to": "held"},
        {"battery": {"used_max_mah": 200}},
        {"touch_down": 1.0},
        {"no_contact": {}},
        {"clearance": 1.0},
        {"estimator": {"horizontal_m": 2, "tilt_deg": 5}},
        {"speed": {"max": 3}, "from": "item 3"},
        {"at_end": {"is_armed": False, "is_landed": True, "near": [0, 0]}},
    ]
    return flown(checks=checks)


def test_checks_have_margins_and_worst_moments(hop):
    found = by_name(hop)
    high = found["altitude: most"]
    assert high.passed
    assert 0.0 < high.margin < 1.5
    assert hop.simulated_s > high.worst_s > 3.0
    low = found["too low"]
    assert not low.passed
    assert low.margin == pytest.approx(3.0 - 5.0, abs=0.5)
    assert low.unit == "m"


@pytest.mark.parametrize(
    "name",
    ["near", "modes", "heard", "battery", "touch down", "no contact", "clearance", "duration", "at end: armed",
     "at end: place", "estimator: tilt", "always: tilt < 60", "always: altitude > -1"],
)  # fmt: skip
def test_what_is_so_passes(hop, name):
    assert by_name(hop)[name].passed


@pytest.mark.parametrize(
    ("name", "happened"),
    [
        ("exact modes", "takeoff ("),
        ("silent", "'Landed' at"),
        ("once", "never; nearest"),
        ("speed", "'item 3' was never reached"),
    ],
)
def test_what_is_not_so_fails_and_says_why(hop, name, happened):
    check = by_name(hop)[name]
    assert not check.passed
    assert happened in check.happened


def test_a_result_says_what_failed_and_can_be_pickled(hop):
    assert not hop.passed
    assert not hop.error
    assert len(hop.failures) == 5
    again = pickle.loads(pickle.dumps(hop))
    assert again.as_json() == hop.as_json()


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(tmp_path):
    def logs(name, seed):
        folder = tmp_path / name
        result = flown(seed=seed, folder=folder, wind={"speed_m_s": 5})
        assert result.ulogs == (str(folder / "flight.ulg"),)
        return (folder / "flight.ulg").read_bytes(), (folder / "flight.tlog").read_bytes()

    assert logs("first", 3) == logs("again", 3)
    assert logs("other", 4) != logs("first again", 3)


def test_a_step_that_fails_is_named():
    result = flown(["arm", {"takeoff": 5}, {"wait_until": {"condition": "altitude > 90", "timeout_s": 2}}])
    assert result.error == "step 3, wait_until: altitude > 90: nothing within 2 s"
    assert not result.passed


def test_a_script_that_shall_fail_passes_if_it_does():
    script = [{"wait_until": {"condition": "altitude > 90", "timeout_s": 2}}]
    assert flown(script, fails_with="altitude > 90").passed
    assert "was to fail" in flown(["arm", "disarm"], fails_with="altitude").error


def test_time_that_is_up_is_an_error():
    assert flown([{"wait": 60}], time_max_s=5).error == "the script was not done after 5 s"


def test_faults_come_at_their_time_or_condition_and_go():
    faults = [
        {
            "when": "altitude > 3",
            "sensor": {"name": "baro", "mode": "biased", "magnitude": 300},
            "for_s": 2,
            "mark": "bent",
        },
        {"at": 8, "motor": {"number": 1, "power": 0.9}, "mark": "weak"},
    ]
    checks = [
        {"altitude": {"min": 3}, "from": "bent", "to": "up"},
        {"duration": {"max_s": 100}, "from": "weak"},
    ]
    result = flown(faults=faults, checks=checks)
    assert result.passed, result.failures


def test_a_fault_that_never_happens_is_an_error():
    result = flown(faults=[{"when": "altitude > 90", "battery": 0.1}])
    assert result.error == "a fault never happened: altitude > 90"


def test_of_two_faults_of_one_thing_the_one_that_ends_first_does_not_mend_the_other():
    jammed = {"at": 4, "sensor": {"name": "gnss", "mode": "noisy", "magnitude": 2}, "for_s": 4}
    off = {"at": 6, "sensor": {"name": "gnss", "mode": "off"}, "for_s": 6}
    gust = {"at": 5, "wind": {"speed_m_s": 8}, "for_s": 2}
    cut = [{"at": at, "link": "sticks", "for_s": 2} for at in (5, 6)]
    scenario = Scenario.model_validate(
        {"world": PLAIN, "vehicle": {"script": HOP}, "faults": [jammed, off, gust, *cut], "checks": []}
    )
    under_way = UnderWay(scenario, 1, None)
    flight = under_way.run.vehicles[0].flight
    under_way.start()
    modes = {}
    for second in (5, 7, 9, 13):
        under_way.fly(lambda end_us=second * 1_000_000: flight.time_us >= end_us)
        modes[second] = int(flight.rig.rows["faults"][0]["gnss"]["mode"])
    result = under_way.end()
    assert modes == {5: FAULT_MODES["noisy"], 7: FAULT_MODES["off"], 9: FAULT_MODES["off"], 13: FAULT_MODES["none"]}
    assert (4.0, 1, "fault: sensor gnss noisy magnitude 2") in result.events
    assert (12.0, 1, "over: sensor gnss off") in result.events
    assert [text for _, _, text in result.events].count("mark: up") == 1


@pytest.mark.parametrize(
    "check",
    [
        {"duration": {"max_s": 20}},
        {"no_contact": {}},
        {"not_heard": "landed"},
        {"modes": ["land"]},
        {"touch_down": 1.0},
    ],
)
def test_a_part_that_does_not_exist_fails_each_check(check):
    (found,) = flown(checks=[{**check, "from": 300}]).checks
    assert not found.passed
    assert found.happened == "there was no such part of the flight"


def test_what_happens_counts_in_the_flight_mode_that_is_asked_for():
    asked = {
        "said in time": {"heard": "landed", "during": "land"},
        "said too late": {"heard": "landed", "during": "takeoff"},
        "not said before": {"not_heard": "landed", "during": "takeoff"},
        "said nevertheless": {"not_heard": "landed", "during": "land"},
        "silent in no mission": {"not_heard": "landed", "during": "mission"},
        "touched nothing in no mission": {"no_contact": {}, "during": "mission"},
        "reached in no mission": {"reached": 0, "during": "mission"},
        "landed softly": {"touch_down": 1.0, "during": "land"},
        "touched down in hold": {"touch_down": 1.0, "during": "hold"},
        "held": {"duration": {"max_s": 3.5}, "during": "hold"},
        "held and landed": {"duration": {"min_s": 5}, "during": "hold"},
        "flew no mission": {"duration": {"max_s": 5}, "during": "mission"},
    }
    found = by_name(flown(checks=[{**check, "name": name} for name, check in asked.items()]))
    assert {name for name in asked if found[name].passed} == {
        "said in time", "not said before", "landed softly", "held",
    }  # fmt: skip
    for name in ("silent in no mission", "touched nothing in no mission", "reached in no mission", "flew no mission"):
        assert found[name].happened == "there was no such part of the flight"


def test_standing_is_no_touch_down():
    (found,) = flown(script=["arm", {"wait": 2}, "disarm"], checks=[{"touch_down": 1.0}]).checks
    assert not found.passed
    assert found.happened == "it never flew"
    (found,) = flown(checks=[{"touch_down": 1.0}]).checks
    assert found.worst_s > 8.0


@pytest.mark.parametrize("airframe", ["x500", "rover"])
def test_it_knows_where_it_starts_before_it_may_be_armed(airframe):
    script = ["arm", {"wait": 1}, "disarm"]
    vehicle = {"airframe": airframe, "start": {"ne_m": [120, -80]}}
    (found,) = flown(script=script, vehicle=vehicle, checks=[{"estimator": {"horizontal_m": 3}}]).checks
    assert found.passed, found.happened


def test_a_battery_may_be_half_full():
    checks = [{"always": "battery < 0.55"}]
    assert flown(vehicle={"start": {"battery": 0.5}}, checks=checks).passed


def test_python_flies_and_names_moments(tmp_path):
    (tmp_path / "hop.py").write_text(
        "async def hop(drone, run):\n"
        "    await drone.wait_ready()\n    await drone.arm()\n    await drone.takeoff(5.0)\n"
        "    run.mark('up')\n    await drone.land()\n"
    )
    vehicle = {"python": f"{tmp_path / 'hop.py'}:hop"}
    checks = [{"once": "altitude > 4.5", "from": "up"}]
    result = run_scenario(Scenario.model_validate({"world": PLAIN, "vehicle": vehicle, "checks": checks}))
    assert result.passed, result.failures
    with pytest.raises(UserError, match="has no coroutine 'jump'"):
        run_scenario(Scenario.model_validate({"world": PLAIN, "vehicle": {"python": f"{tmp_path / 'hop.py'}:jump"}}))


def test_several_vehicles_are_judged_one_by_one_and_together(tmp_path):
    vehicles = [{"script": HOP, "count": 2}, {"airframe": "rover", "script": ["arm", {"wait": 2}, "disarm"]}]
    checks = [
        {"separation": 5},
        {"at_end": {"is_armed": False}},
        {"once": "altitude > 4", "vehicle": 1},
        {"separation": 5, "vehicle": 3, "name": "from the rover", "to": 4},
    ]
    result = run_scenario(
        Scenario.model_validate({"world": PLAIN, "vehicles": vehicles, "checks": checks}), folder=tmp_path / "run"
    )
    assert result.passed, result.failures
    assert [check.name for check in result.checks][:3] == [
        "separation",
        "vehicle 1: at end: armed",
        "vehicle 1: at end: crashed",
    ]
    assert len(result.ulogs) == 3


def test_vehicles_that_start_in_each_other_are_refused_with_any_seed():
    vehicles = [{"start": {"ne_m": [5, 5]}}, {"start": {"ne_m": [5.5, 5]}}]
    with pytest.raises(UserError, match=r"vehicles\[1\].start.ne_m: vehicles 1 and 2 start 0.5 m apart"):
        run_scenario(Scenario.model_validate({"world": PLAIN, "vehicles": vehicles}), seed=7)


def test_a_plan_that_is_not_there_is_an_error_of_the_script():
    result = flown([{"fly_plan": "/none/round.plan"}])
    assert result.error.startswith("step 1, fly_plan: /none/round.plan: ")


def test_who_never_becomes_ready_says_why():
    result = flown(["arm"], vehicle={"start": {"battery": 0.05}})
    assert result.error == "ready to arm: nothing within 60 s: battery: 5% left, 15% needed"


def test_a_motor_that_is_not_there_is_refused():
    with pytest.raises(UserError, match="x500 has motors 1 to 4, not 7"):
        flown(faults=[{"at": 1, "motor": {"number": 7}}])


def test_a_ground_station_that_is_cut_is_missed():
    script = ["arm", {"takeoff": 5}, {"wait_disarmed": 60}]
    faults = [{"at": 10, "link": "ground_station"}]
    result = flown(
        script, faults=faults, has_ground_station=True, vehicle={"parameters": {"NAV_DLL_ACT": 3}},
        checks=[{"heard": "ground station"}, {"modes": ["takeoff", "land"]}],
    )  # fmt: skip
    assert result.passed, result.failures


def test_a_check_of_nothing_measured_has_no_margin():
    result = flown(["arm", "disarm"], checks=[{"reached": 2}, {"corridor": {"within_m": 1}}])
    reached, corridor = result.checks
    assert not reached.passed
    assert isnan(reached.margin)
    assert corridor.happened == "it flew no mission"


def test_an_exception_in_somebodys_python_is_an_error_of_the_flight(tmp_path):
    file = tmp_path / "bad.py"
    file.write_text("async def fly(drone):\n    await drone.wait_ready()\n    raise KeyError('x')\n")
    result = run_scenario(Scenario.model_validate({"world": PLAIN, "vehicle": {"python": f"{file}:fly"}}))
    assert result.error == f"{file}:fly, line 3: KeyError: 'x'"
    file.write_text("import nothing_of_the_kind\n")
    with pytest.raises(UserError, match="cannot be imported: ModuleNotFoundError"):
        run_scenario(Scenario.model_validate({"world": PLAIN, "vehicle": {"python": f"{file}:fly"}}))


def test_a_script_may_go_on_while_the_mission_is_flown():
    path = {"points": [[0, 0, -8], [40, 0, -8]], "end": "hold", "waits": False}
    script = [
        {"fly_path": path},
        {"wait_until": "north > 10"},
        {"set_mode": "hold"},
        {"mark": "held"},
        {"wait": 3},
        "land",
    ]
    result = flown(script, checks=[{"modes": ["mission", "hold", "land"]}, {"always": "north < 25"}])
    assert result.passed, result.failures


@pytest.mark.parametrize("airframe", ["x500", "rover"])
@pytest.mark.parametrize("heading_deg", [90.0, 225.0])
def test_its_nose_points_where_the_scenario_says_and_it_knows(airframe, heading_deg):
    held = f"heading > {heading_deg - 8} and heading < {heading_deg + 8} and heading_error < 8"
    start, script = {"start": {"heading_deg": heading_deg}}, [{"hold": 4}, {"mark": "on"}, {"hold": 1}]
    result = flown(vehicle={"airframe": airframe, **start}, script=script, checks=[{"always": held, "from": "on"}])
    assert result.passed, result.failures
