"""Scenarios that cannot be flown: refused before the flight, with file, line and key."""

from pathlib import Path

import pytest
from PIL import Image

import common.airframes
from mission.console.option_checks import UserError
from mission.scenario.flight.building import check_scenario, flight_configs
from mission.scenario.scenario import Scenario
from tests.unit.mission.scenario.parsing import parsed

AIRFRAMES = Path(common.airframes.__file__).parent

AT_REST = "checks: [{at_end: {is_armed: false}}]\n"


def refused(text, tmp_path):
    """The sentence with which a file that can be read is refused before it is flown."""
    with pytest.raises(UserError) as refusal:
        check_scenario(parsed(text, tmp_path), "not its name")
    said = str(refusal.value)
    assert "\n" not in said
    return said.replace(f"{tmp_path.resolve()}/", "").removeprefix("hop.scenario.yaml:")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("vehicle:\n  airframe: x5000\n", "2: vehicle.airframe: unknown airframe 'x5000'; known: c172,"),
        ("vehicle:\n  airframe: own.toml\n", "2: vehicle.airframe: own.toml: no such file"),
        ("vehicles:\n  - {}\n  - airframe: x5000\n", "3: vehicles[1].airframe: unknown airframe"),
        (
            "vehicle:\n  parameters:\n    MPC_LAND_SPEED: 1\n    MPC_XY_VEL_MAXX: 3\n",
            "4: vehicle.parameters.MPC_XY_VEL_MAXX: unknown parameter; did you mean MPC_XY_VEL_MAX?",
        ),
        (
            "vehicle:\n  parameters:\n    ZZZZ: 3\n",
            "3: vehicle.parameters.ZZZZ: unknown parameter; the flight controller of x500 has none of that name",
        ),
        (
            "vehicle:\n  parameters:\n    NAV_DLL_ACT: 99\n",
            "3: vehicle.parameters.NAV_DLL_ACT: 99 is not between",
        ),
        ("vehicle:\n  throw_m_s: 10\n", "2: vehicle.throw_m_s: airframe 'x500': only a plane can be thrown"),
        (
            "vehicle:\n  airframe: f450\n",
            "1: vehicle: is told nothing and nothing is checked: give it a script, or add",
        ),
        ("vehicle:\n  plan: no.plan\n", "2: vehicle.plan: no.plan: no such file"),
        ("vehicle:\n  plan: hop.py\n", "2: vehicle.plan: hop.py: "),
        (
            "vehicle:\n  script:\n    - arm\n    - fly_plan: no.plan\n",
            "4: vehicle.script[1].fly_plan: no.plan: no",
        ),
        ("vehicle:\n  python: no.py:hop\n", "2: vehicle.python: no.py: no such file"),
        (
            "vehicle:\n  python: hop.py:jumpp\n",
            "2: vehicle.python: hop.py: has no coroutine 'jumpp' (async def jumpp(drone): ...); did you mean jump?",
        ),
        (
            "vehicle:\n  python: hop.py:stay\n",
            "2: vehicle.python: hop.py: has no coroutine 'stay' (async def",
        ),
        ("vehicle:\n  python: bad.py:hop\n", "2: vehicle.python: bad.py: is no Python: "),
        ("world:\n  file: no.world.yaml\n", "2: world.file: no.world.yaml: no such file"),
        ("world:\n  file: yard.yaml\n", "2: world.file: yard.yaml:1: meshes[0].fil: unknown key; did you mean file?"),
        ("world:\n  tree_height_min_m: 50\n", "1: world: tree_height_min_m is larger than tree_height_max_m"),
        (
            "faults:\n  - at: 1\n    motor:\n      number: 7\n",
            "4: faults[0].motor.number: x500 has motors 1 to 4, not 7",
        ),
        (
            "faults:\n  - at: 1\n    link: ground_station\n",
            "3: faults[0].link: ground_station: there is none; add has_ground_station: true",
        ),
        (
            "faults:\n  - at: 1\n    link: companion\n",
            "3: faults[0].link: companion: there is none, the vehicle has no policy",
        ),
        (
            "vehicles: [{airframe: rover}, {}]\nfaults:\n  - {at: 1, vehicle: 2, sensor: {name: wheels, mode: off}}\n",
            "3: faults[0].sensor.name: x500 has no sensor wheels; it has gyro, accel, mag, baro, gnss, range, battery",
        ),
        (
            "faults: [{at: 1, sensor: {name: airspeed, mode: stuck}}]\n",
            "1: faults[0].sensor.name: x500 has no sensor airspeed; it has gyro,",
        ),
        (
            "vehicle:\n  airframe: rover\nfaults: [{at: 1, sensor: {name: airspeed, mode: stuck}}]\n",
            "3: faults[0].sensor.name: rover has no sensor airspeed; it has gyro, accel, mag, baro, gnss, range",
        ),
        (
            "vehicles:\n  - start: {ne_m: [5, 5]}\n  - {}\n  - start:\n      ne_m: [5.5, 5]\n",
            "5: vehicles[2].start.ne_m: vehicles 1 and 3 start 0.5 m apart, at least 1 m are needed",
        ),
        (
            "vehicles:\n  - {}\n  - start:\n      ne_m: [0, 0]\n",
            "4: vehicles[1].start.ne_m: vehicles 1 and 2 start 0 m apart",
        ),
        (
            "world: {size_m: 200}\nvehicle:\n  start:\n    ne_m: [0, -101]\n",
            "4: vehicle.start.ne_m: is outside of the world, which ends 100 m to each side of home",
        ),
        ("world: {size_m: 50}\nvehicles:\n  - count: 50\n", "2: vehicles: the world has free ground for"),
        (
            "vehicle:\n  script:\n    - arm\n    - let_policy_fly: 30\n",
            "4: vehicle.script[1].let_policy_fly: the vehicle has no policy",
        ),
        ("vehicle:\n  script:\n    - policy_park: 3\n", "3: vehicle.script[0].policy_park: the vehicle has no policy"),
        (
            "vehicle:\n  policy: {name: Navigate}\n  script:\n    - let_policy_fly: 3\n",
            "4: vehicle.script[0].let_policy_fly: there is nobody to follow; add an owner",
        ),
        (
            "vehicle:\n  script:\n    - set_param:\n        MPC_LAND_SPEED: 1\n        MPC_XY_VEL_MAXX: 3\n",
            "5: vehicle.script[0].set_param.MPC_XY_VEL_MAXX: unknown parameter; did you mean MPC_XY_VEL_MAX?",
        ),
        (
            "vehicles:\n  - {}\n  - airframe: rover\n    script:\n      - arm\n      - takeoff: 5\n",
            "6: vehicles[1].script[1].takeoff: rover drives, and takes off never",
        ),
        ("checks:\n  - airspeed: {min: 5}\n", "2: checks[0].airspeed: x500 measures no airspeed, which planes do"),
        (
            "vehicles: [{airframe: plane}, {airframe: rover}]\nchecks:\n  - airspeed: {min: 5}\n",
            "3: checks[0].airspeed: rover measures no airspeed",
        ),
        ("checks:\n  - always: speed > 1 and airspeed > 5\n", "2: checks[0].always: x500 measures no airspeed"),
        (
            "faults:\n  - when: airspeed > 5\n    battery: 0.1\n",
            "2: faults[0].when: x500 measures no airspeed, which planes do",
        ),
        ("checks:\n  - separation: 5\n", "2: checks[0].separation: there is one vehicle"),
        ("checks:\n  - following: {in_view_min: 0.5}\n", "2: checks[0].following: the vehicle has no policy"),
        ("checks:\n  - figures: {park_s: {max: 60}}\n", "2: checks[0].figures: the vehicle has no policy"),
    ],
)
def test_what_cannot_be_flown_is_refused_before_with_its_place(tmp_path, text, said):
    (tmp_path / "hop.py").write_text("def stay(drone): pass\nasync def jump(drone): pass\n")
    (tmp_path / "bad.py").write_text("async def\n")
    (tmp_path / "yard.yaml").write_text("meshes: [{fil: tower.stl}]\n")
    assert refused(text, tmp_path).startswith(said)


@pytest.mark.parametrize(
    "text",
    [
        "vehicle: {airframe: plane, python: 'hop.py:jump'}\nfaults: [{at: 1, sensor: {name: airspeed, mode: stuck}}]\n",
        "vehicle: {airframe: rover, python: 'hop.py:sail'}\nfaults: [{at: 1, sensor: {name: wheels, mode: stuck}}]\n",
        "vehicle: {airframe: f550, python: 'hop.py:made'}\nfaults: [{at: 1, motor: {number: 6}}]\n",
        "has_ground_station: true\nfaults: [{at: 1, link: ground_station}]\n",
        "vehicles: [{start: {ne_m: [5, 5]}}, {start: {ne_m: [5, 6]}}]\nworld: {size_m: 50}\n" + AT_REST,
        "vehicle: {start: {ne_m: [100, -100]}}\nworld: {size_m: 200}\n" + AT_REST,
        "checks: [{altitude: {min: 5, max: 5}}]\n",
        "vehicles: [{airframe: plane}, {airframe: rover}]\nchecks: [{airspeed: {min: 5}, vehicle: 1}]\n",
        "vehicle: {airframe: rover, script: [{takeoff: 5}]}\nfails_with: takeoff\n",
    ],
)
def test_what_can_be_flown_is_not_refused(tmp_path, text):
    lines = ("import sea", "async def jump(drone): pass", "from sea import sail", "made = sea.wrapped(jump)")
    (tmp_path / "hop.py").write_text("\n".join(lines))
    check_scenario(parsed(text, tmp_path), "hop")


def test_a_start_is_within_the_map_of_a_heightmap(tmp_path):
    Image.new("L", (21, 21)).save(tmp_path / "flat.png")
    heights = "{file: flat.png, metres_per_pixel: 10, height_min_m: 0, height_max_m: 1}"
    (tmp_path / "yard.yaml").write_text(f"heightmap: {heights}\n")
    text = "world: {file: yard.yaml}\nvehicle: {start: {ne_m: [0, 101]}}\n"
    assert refused(text, tmp_path).startswith("2: vehicle.start.ne_m: is outside of the world, which ends 100 m")


def test_what_python_made_is_refused_with_the_key(tmp_path):
    with pytest.raises(UserError, match=r"^mine: vehicle\.airframe: unknown airframe 'x5000'"):
        check_scenario(Scenario(vehicle={"airframe": "x5000"}), "mine")


def test_a_wrong_parameter_is_refused_before_anything_flies():
    with pytest.raises(UserError, match="MPC_XY_VEL_MAXX"):
        flight_configs(Scenario(vehicle={"parameters": {"MPC_XY_VEL_MAXX": 3.0}}), 1)
