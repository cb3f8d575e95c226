"""Who does not fly does not notice the plugin; who does pays little for each test."""

import subprocess
import sys

import pytest

from tests.unit.mission.pytest_plugin.inner_pytest import inner

pytest_plugins = "pytester"
OVERHEAD_MAX_S = 0.3  # of processor time per test, after the first
LIST_MODULES = """
import sys, pytest
pytest.main([*sys.argv[1:], "-q"])
print("modules:", *sys.modules)
"""


def modules_of_a_run(folder, *options):
    command = [sys.executable, "-c", LIST_MODULES, *options]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    assert "1 passed" in run.stdout
    return set(run.stdout.rpartition("modules:")[2].split())


def test_a_plain_run_imports_one_file(pytester):
    pytester.makeini("[pytest]\nfilterwarnings = error\n")
    pytester.makepyfile(test_plain="def test_it(): pass")
    (pytester.path / "hop.scenario.yaml").write_text("vehicle: {script: [arm]}\n")
    without = modules_of_a_run(pytester.path, "-p", "no:honeyguide", "test_plain.py")
    added = modules_of_a_run(pytester.path, "-p", "pytest_honeyguide", "test_plain.py") - without
    assert added <= {
        *("pytest_honeyguide", "mission", "mission.pytest_plugin", "mission.pytest_plugin.scenario_items"),
    }


def test_twenty_tests_cost_little_each(pytester):
    pytester.makepyfile(
        """
        import time
        import pytest
        ends = []

        @pytest.mark.parametrize("number", range(21))
        async def test_trivial(vehicle, number):
            ends.append(time.process_time())

        def test_cost():
            costs = sorted(after - before for before, after in zip(ends, ends[1:]))
            print("CPU s per test: median", costs[10], "most", costs[-1], "mean", sum(costs) / 20)
            assert sum(costs) / 20 < OVERHEAD_MAX_S
    """.replace("OVERHEAD_MAX_S", str(OVERHEAD_MAX_S))
    )
    result = inner(pytester, "-s")
    result.assert_outcomes(passed=22)


def test_the_marker_is_known(pytester):
    inner(pytester, "--markers").stdout.fnmatch_lines(["@pytest.mark.honeyguide(airframe=, wind=,*"])


@pytest.mark.parametrize("name", ["vehicle", "fleet", "flight", "world"])
def test_fixtures_are_described(pytester, name):
    inner(pytester, "--fixtures").stdout.fnmatch_lines([f"{name} -- *pytest_honeyguide.py:*"])
