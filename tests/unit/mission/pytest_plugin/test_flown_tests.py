"""Tests that fly, in a pytest of their own: in simulated time, by their marker, judged and shown in the end."""

import json

import pytest

from tests.unit.mission.pytest_plugin.inner_pytest import inner

pytest_plugins = "pytester"
HEAD = "import asyncio\nimport pytest\npytestmark = pytest.mark.honeyguide(world='plain')\n"
UP = """
    await vehicle.wait_ready()
    await vehicle.arm()
    await vehicle.takeoff(5.0)
"""


@pytest.fixture
def run(pytester):
    """Runs a file of tests, in which every warning is an error."""
    pytester.makeini("[pytest]\nfilterwarnings = error\n")

    def run(text, *options):
        pytester.makepyfile(test_flown=HEAD + text)
        return inner(pytester, *options)

    return run


def test_coroutines_fly_in_simulated_time_and_know_the_truth(run):
    result = run(f"""
async def test_up(vehicle, flight, fleet, world):
    assert fleet == [vehicle]
    {UP}
    flight.mark("up")
    flight.check(altitude={{"min": 4, "max": 6}}, from_="up", to="end")
    await vehicle.sleep(10.0)
    flight.mark("end")
    assert flight.time_s > 12.0
    assert flight.pos_ned()[2] == pytest.approx(vehicle.pos_ned[2], abs=1.0)
    assert world.height(0.0, 0.0) == 0.0

class TestsOfAClass:
    @pytest.fixture
    async def up(self, vehicle):
        self.vehicle = vehicle
        {UP.replace(chr(10), chr(10) + "    ")}
        return vehicle

    async def test_a_fixture_flies_too(self, up, flight):
        assert up is self.vehicle
        assert flight.time_s > 5.0
        await up.land()

@pytest.mark.honeyguide(count=2)
async def test_two(vehicle, fleet, flight):
    assert fleet[0] is vehicle
    flight.check(separation=5)
    for each in fleet:
        await each.wait_ready()
        await each.arm()
    await fleet[1].takeoff(5.0)
    assert flight.pos_ned(2)[2] < -4.0
""")
    result.assert_outcomes(passed=3)


def test_what_is_not_ours_is_left_alone(run):
    result = run("""
@pytest.fixture
def vehicle():
    return "a van"

def test_own_fixture(vehicle):
    assert vehicle == "a van"

async def test_own_coroutine(vehicle):
    pass
""")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*async def functions are not natively supported*"])


def test_a_test_flies_with_each_seed_wind_and_airframe(run):
    result = run(
        """
seen = []

@pytest.mark.honeyguide(airframes=["x500", "f450"], winds=[0, {"speed_m_s": 4, "from_deg": 90}], seeds=[1, 2])
async def test_each(vehicle, flight):
    seen.append((flight.scenario.vehicle.airframe, flight.scenario.wind.from_deg, flight.seed))

@pytest.mark.honeyguide(seed=7, wind=3)
@pytest.mark.parametrize("height", [2, pytest.param(5, marks=pytest.mark.honeyguide(wind=9))])
async def test_marks_of_parameters(vehicle, flight, height):
    assert (flight.seed, flight.scenario.wind.speed_m_s) == (7, 9.0 if height == 5 else 3.0)
    assert flight.scenario.world.kind == "plain"

def test_all():
    assert len(set(seen)) == 8
""",
        "-v",
    )
    result.assert_outcomes(passed=11)
    result.stdout.fnmatch_lines(["*::test_each[[]f450-wind4_90-seed2] PASSED*"])


def test_what_failed_is_shown_with_its_flight(run):
    result = run(
        f"""
@pytest.mark.honeyguide(wind=5, seeds=[3])
async def test_calm(vehicle, flight):
    flight.check(tilt={{"max": 3}}, name="calm")
    flight.check(altitude={{"max": 6}})
    {UP}
    await vehicle.land()

async def test_refused(vehicle):
    await vehicle.arm()

async def test_wrong(vehicle):
    {UP}
    assert vehicle.is_landed

@pytest.mark.honeyguide(time_max_s=4)
async def test_long(vehicle):
    await vehicle.sleep(100.0)
""",
        "--honeyguide-keep",
        "kept",
    )
    result.assert_outcomes(failed=4)
    result.stdout.fnmatch_lines(
        [
            "calm: asked tilt at most 3 deg, but * deg at * s",
            "x500 in the world plain, wind 5 m/s, seed 3, * s flown",
            "FAILED calm: asked *, margin -* deg",
            "ok     altitude: asked altitude at most 6 m; *, margin * m",
            "heard last:",
            "* s  Disarmed after landing",
            "again: pytest 'test_flown.py::test_calm[[]seed3]'",
            "kept in kept/test_flown.py-test_calm-seed3; see it: honeyguide replay *",
            ">       await vehicle.arm()",
            "E       mission.client.CommandRefused: arm refused*",
            "*test_flown.py:*: CommandRefused",
            ">       assert vehicle.is_landed",
            ">       await vehicle.sleep(100.0)",
            "E       mission.client.ScriptTimeout: not done after 4 s of simulated time*",
        ]
    )
    result.stdout.no_fnmatch_line("*client.py*")


def test_plans_and_scripts_of_the_marker_are_flown_to_their_end(run, pytester):
    result = run("""
HOP = ["arm", {"takeoff": 5}, "land"]

@pytest.mark.honeyguide(script=HOP, checks=[{"at_end": {"is_landed": True, "is_armed": False}}])
class TestsOfAHop:
    async def test_watched(self, vehicle, flight):
        await flight.orders_done()
        assert flight.time_s > 10.0

    async def test_not_waited_for(self, vehicle):
        pass

@pytest.mark.honeyguide(script=["arm", {"takeoff": 5, "name": "none"}])
async def test_wrong_step(vehicle): pass

@pytest.mark.honeyguide(script=["land"])
async def test_failing(vehicle): pass
""")
    result.assert_outcomes(passed=2, failed=1, errors=1)
    result.stdout.fnmatch_lines(["step 1, land: *refused*"])


def test_faults_come_by_the_marker_and_by_the_test(run):
    result = run(f"""
@pytest.mark.honeyguide(faults=[{{"when": "altitude > 3", "motor": {{"number": 1, "power": 0.9}}, "mark": "weak"}}])
async def test_marker(vehicle, flight):
    flight.check(duration={{"min_s": 3}}, from_="weak")
    {UP}
    await vehicle.sleep(5.0)

async def test_now(vehicle, flight):
    {UP}
    flight.fail(sensor={{"name": "gnss", "mode": "off"}})
    await vehicle.sleep(10.0)
    flight.check(heard="no position source")
    with pytest.raises(ValueError, match="flight.fail: .*unknown"):
        flight.fail(sensr=1)
""")
    result.assert_outcomes(passed=2)


def test_the_same_test_and_seed_are_the_same_bytes(run, pytester):
    text = f"""
@pytest.mark.honeyguide(wind=6, seed=4)
async def test_hop(vehicle):
    {UP}
    await vehicle.land()
"""
    logs = []
    for name in ("one", "two"):
        run(text, "--honeyguide-keep", name, "--honeyguide-keep-all").assert_outcomes(passed=1)
        folder = pytester.path / name / "test_flown.py-test_hop"
        logs.append([(folder / each).read_bytes() for each in ("flight.ulg", "flight.tlog")])
        assert json.loads((folder / "result.json").read_text())["passed"]
    assert logs[0] == logs[1]


def test_runs_that_pass_or_are_refused_leave_no_folder(run, pytester):
    run(
        """
async def test_nothing(vehicle): pass

@pytest.mark.honeyguide(faults=[{"at": 1, "link": "companion"}])
async def test_refused(vehicle): pass
""",
        "--honeyguide-keep",
        "kept",
    ).assert_outcomes(passed=1, errors=1)
    assert list((pytester.path / "kept").iterdir()) == []
