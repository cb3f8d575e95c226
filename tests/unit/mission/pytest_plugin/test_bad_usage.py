"""What is written wrong is one clear sentence, without a traceback."""

import pytest

from tests.unit.mission.pytest_plugin.inner_pytest import inner

pytest_plugins = "pytester"

MARKERS = {
    "airfrme='x500'": "*: unknown key airfrme; did you mean airframe[?]",
    "airframe='x5000'": "*::test_it: @pytest.mark.honeyguide: *airframe: unknown airframe 'x5000'; known: *",
    "wind='strong'": "*: wind: must be a mapping of keys to values, not 'strong'",
    "wind=50": "*: wind.speed_m_s: must be at most 20, not 50",
    "world='moon'": "*: world.kind: must be *, not 'moon'",
    "seed=-1": "*: seed: must be a whole number from 0, not -1",
    "seeds=3": "*: seeds: must be a list of at least one, not 3",
    "winds=[]": "*: winds: must be a list of at least one, not [[]]",
    "5": "*: takes keys only, as wind=5, not 5",
    "plan='none.plan'": "*: */none.plan: *",
    "checks=[{'tlt': {'max': 3}}]": "*: checks[[]0]: tlt: unknown key; did you mean tilt[?]",
    "faults=[{'at': 1, 'motor': {'number': 7}}]": "*: faults[[]0].motor.number: x500 has motors 1 to 4, not 7",
    "parameters={'MPC_XY_VEL_MX': 3}": "*MPC_XY_VEL_MX*",
    "airframe='x500', vehicles=[{}]": "*: airframe: is of a vehicle, write it there",
}


@pytest.mark.parametrize("keys", MARKERS)
def test_a_wrong_marker_is_one_sentence(pytester, keys):
    pytester.makepyfile(f"import pytest\n@pytest.mark.honeyguide({keys})\nasync def test_it(vehicle): pass\n")
    result = inner(pytester)
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([MARKERS[keys]])
    result.stdout.no_fnmatch_line("*During handling*")
    result.stdout.no_fnmatch_line("*.py:[0-9]*: *Error")


def test_a_function_that_asks_for_a_vehicle_must_be_a_coroutine(pytester):
    pytester.makepyfile("def test_it(vehicle): pass\n")
    result = inner(pytester)
    result.stdout.fnmatch_lines(["*test_it: flies in simulated time, so that it must be a coroutine: async def *"])


def test_a_fixture_that_flies_cannot_yield(pytester):
    pytester.makepyfile(
        "import pytest\n@pytest.fixture\nasync def up(vehicle):\n    yield vehicle\nasync def test_it(up): pass\n"
    )
    result = inner(pytester)
    result.stdout.fnmatch_lines(["*the fixture up flies and yields; the flight is over with the test*"])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--honeyguide-keep-all"], "--honeyguide-keep-all: needs --honeyguide-keep FOLDER"),
        (["--link", "carrier-pigeon:3"], "--link carrier-pigeon:3: must be udpout"),
    ],
)
def test_wrong_options_are_one_sentence(pytester, options, sentence):
    pytester.makepyfile("async def test_it(vehicle): pass\n")
    result = inner(pytester, *options)
    assert result.ret != 0
    assert sentence in result.stdout.str() + result.stderr.str()


def test_logs_are_not_written_over_what_somebody_has_there(pytester):
    pytester.makepyfile("async def test_it(vehicle): pass\n")
    own = pytester.mkdir("kept") / "test_logs_are_not_written_over_what_somebody_has_there.py-test_it"
    own.mkdir()
    (own / "thesis.txt").write_text("mine")
    result = inner(pytester, "--honeyguide-keep", "kept")
    result.stdout.fnmatch_lines(["*: is there already, and is no kept run"])
    assert (own / "thesis.txt").exists()
