"""Scenario files are collected by a plain `pytest`, one test per seed, and say what `honeyguide test` says."""

from pathlib import Path

import pytest
import warp as wp
from typer.testing import CliRunner

from mission.cli import app
from tests.unit.mission.pytest_plugin.inner_pytest import inner

pytest_plugins = "pytester"
HOP = "seeds: [1, 2]\nworld: {kind: plain}\nvehicle: {script: [arm, {takeoff: 5}, land]}\n"


@pytest.fixture
def run(pytester):
    return lambda *options: inner(pytester, *options)


def test_each_seed_is_a_test(pytester, run):
    (pytester.path / "hop.scenario.yaml").write_text(HOP)
    result = run("-v")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["hop.scenario.yaml::seed1 PASSED*", "hop.scenario.yaml::seed2 PASSED*"])
    run("hop.scenario.yaml::seed2").assert_outcomes(passed=1)
    run("-k", "seed1").assert_outcomes(passed=1)


def test_what_failed_is_told_as_by_the_command(pytester, run, monkeypatch):
    kernels = Path(wp.config.kernel_cache_dir).parent  # pytester has taken the home folder away
    monkeypatch.setenv("WARP_CACHE_PATH", str(kernels))
    (pytester.path / "hop.scenario.yaml").write_text(HOP + "checks: [{tilt: {max: 3}}]\n")
    told = CliRunner().invoke(app, ["test", "hop.scenario.yaml", "--jobs", "1", "--keep", "kept"]).stdout
    result = run("--honeyguide-keep", "kept")
    result.assert_outcomes(failed=2)
    first = told.splitlines().index("hop, seed 1:")
    for line in told.splitlines()[first : first + 3]:
        assert line in result.outlines
    assert (pytester.path / "kept" / "hop-seed1" / "flight.ulg").is_file()
    result = run("-k", "seed2")
    file = pytester.path / "hop.scenario.yaml"
    result.stdout.fnmatch_lines([f"  again: honeyguide test {file} --seeds 2 --keep failed"])


def test_all_are_kept_if_asked_for(pytester, run):
    (pytester.path / "hop.scenario.yaml").write_text(HOP)
    run("--honeyguide-keep", "kept").assert_outcomes(passed=2)
    assert not list((pytester.path / "kept").glob("*"))
    run("--honeyguide-keep", "kept", "--honeyguide-keep-all").assert_outcomes(passed=2)
    assert sorted(each.name for each in (pytester.path / "kept").iterdir()) == ["hop-seed1", "hop-seed2"]


def test_runs_of_equal_names_are_kept_by_their_folders(pytester, run):
    for name in ("a", "b"):
        pytester.mkdir(name).joinpath("hop.scenario.yaml").write_text(HOP)
    run("--honeyguide-keep", "kept", "--honeyguide-keep-all", "-k", "seed1").assert_outcomes(passed=2)
    assert sorted(each.name for each in (pytester.path / "kept").iterdir()) == ["a-hop-seed1", "b-hop-seed1"]


def test_a_run_is_kept_in_the_same_folder_whichever_tests_are_selected(pytester, run):
    for name in ("a", "b"):
        pytester.mkdir(name).joinpath("hop.scenario.yaml").write_text(HOP)
    run("--honeyguide-keep", "kept", "--honeyguide-keep-all", "-k", "b and seed1").assert_outcomes(passed=1)
    assert [each.name for each in (pytester.path / "kept").iterdir()] == ["b-hop-seed1"]


def test_a_wrong_file_is_one_sentence(pytester, run):
    (pytester.path / "hop.scenario.yaml").write_text("seeds: [1, 2]\nvehicle: {scrit: [arm]}\n")
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*hop.scenario.yaml:2: vehicle.scrit: unknown key; did you mean script[?]"])


def test_what_cannot_be_flown_is_one_sentence(pytester, run):
    (pytester.path / "hop.scenario.yaml").write_text("vehicle: {airframe: x5000}\n")
    result = run()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*hop.scenario.yaml:1: vehicle.airframe: unknown airframe 'x5000'; known: *"])
