"""`honeyguide benchmark navigate` and `park`: any policy goes to goals, and what came of it is shown and written."""

import json
from dataclasses import asdict
from math import nan

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.benchmark import navigating, parking
from mission.benchmark.benchmark import TASKS, benchmark_of
from mission.benchmark.goal_flights import Crossing
from mission.benchmark.goal_pilots import goal_pilot
from mission.benchmark.kept_flight import KeptFlight
from mission.benchmark.parking import Parking, parked
from mission.benchmark.session import misses
from mission.cli import app
from policies.companion.guard.settings import GuardSettings
from policies.companion.pilot import PilotError
from policies.companion.vector_pilot import DrivingPilot, NavigationPilot
from policies.datasets.reader import DatasetReader
from policies.learn.export.provenance import code_record
from policies.pretrained.pretrained_policies import pretrained


class StraightOn:
    """A drone's policy that sees nothing."""

    def reset(self):
        pass

    def act(self, vector):  # noqa: ARG002
        return np.array([1.0, 0.0, 0.0, 0.0], np.float32)


class FullThrottle(StraightOn):
    """A rover's."""

    def act(self, vector):  # noqa: ARG002
        return np.array([1.0, 0.0], np.float32)


def honeyguide(*words):
    return CliRunner().invoke(app, ["benchmark", *words])


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("navigate", "--condition", "rain"), "--condition rain: there are 200-late-0, 200-late-100,"),
        (("park", "--condition", "rain"), "--condition rain: there are park, reverse, calm, late-100, late-200"),
        (("navigate", "--policy", "drive-park"), "made for another task"),
        (("park", "--policy", "builtins:dict"), "a pilot has reset, act too"),
        (("park", "--policy", "nowhere.onnx"), "nowhere.onnx"),
    ],
)
def test_what_is_wrong_is_refused_in_a_sentence(words, sentence):
    result = honeyguide(*words)
    assert result.exit_code == 2
    assert sentence in result.stderr


@pytest.mark.parametrize(
    ("task", "condition", "seed"), [("navigate", "200-late-100", "3940001"), ("park", "late-200", "3940005")]
)
def test_a_flight_is_shown_and_written(task, condition, seed, tmp_path):
    """Seeds that what ships arrives with; it does not with each: how often is the benchmark's to say."""
    out = tmp_path / "out"
    words = ("--condition", condition, "--flights", "1", "--seed", seed, "--jobs", "1")
    result = honeyguide(task, *words, "--guard-setting", "crown_m=0.9", "--out", str(out))
    assert result.exit_code in {0, 1}, result.output
    record = json.loads((out / "flights.json").read_text())
    (outcome,) = record["flights"][condition]
    assert outcome["outcome"] in {"arrived", "there"}
    assert (record["task"], record["has_guard"], record["guard_settings"]) == (task, True, {"crown_m": 0.9})
    assert (out / "table.md").read_text().startswith("| condition |")
    assert f": `{condition}` |" in (out / "table.md").read_text()
    assert record["code"] == code_record()


@pytest.mark.parametrize(
    ("task", "condition", "seed", "built_as"),
    [
        ("navigate", "200-late-0", 500_002, ("Navigate",)),
        ("park", "calm", 500_000, ("Drive", "--env-args", "preset=park")),
    ],
)
def test_a_recorded_flight_goes_as_another_and_becomes_a_dataset(task, condition, seed, built_as, tmp_path):
    flights, out, dataset = (tmp_path / name for name in ("flights", "out", "set"))
    words = ("--condition", condition, "--flights", "1", "--jobs", "1", "--seed", str(seed), "--out", str(out))
    result = honeyguide(task, *words, "--record", str(flights))
    assert result.exit_code in {0, 1}, result.output
    assert [path.name for path in flights.iterdir()] == [f"{condition}-seed{seed}"]
    (recorded,) = json.loads((out / "flights.json").read_text())["flights"][condition]
    benchmark = benchmark_of(task)
    unrecorded = benchmark.fly(benchmark.load(TASKS[task][1]), condition, seed, GuardSettings(), KeptFlight())
    assert recorded == asdict(unrecorded)
    built = CliRunner().invoke(app, ["dataset", "build", str(flights), "-o", str(dataset), "--task", *built_as])
    assert built.exit_code == 0, built.output
    with DatasetReader(dataset) as reader:
        (episode,) = list(reader)
        assert reader.origin.rewards_by == "truth"
    assert (episode.outcome, episode.context["pilot"]) == ("success", TASKS[task][1])
    again = honeyguide(task, *words, "--record", str(flights))
    assert again.exit_code == 2
    assert f"--record: {flights / condition}-seed{seed} is there already" in again.stderr


@pytest.mark.parametrize(("condition", "lag_s"), [("park", 0.0), ("late-100", 0.1), ("late-200", 0.2)])
def test_the_rover_of_a_late_condition_has_late_ranges_and_is_else_the_same(condition, lag_s):
    lots = (parking.CONDITIONS[name] for name in (condition, "park"))
    late, fresh = (parking.flight_of(lot, 5, np.random.default_rng(5)) for lot in lots)
    assert late == fresh.model_copy(update={"scan_lag_s": lag_s})


def test_the_guard_keeps_a_rover_at_full_throttle_off_what_stands_round_it():
    outcome = parked(FullThrottleOfTheTask(), parking.CONDITIONS["calm"], 3_000_003, GuardSettings())
    assert outcome.outcome == "missed"
    assert outcome.interventions_per_min > 60.0


class FullThrottleOfTheTask(FullThrottle):
    stack = 2


def test_a_class_of_ones_own_flies_with_what_the_task_says_where_it_does_not():
    made = goal_pilot(f"{__name__}:StraightOn", NavigationPilot, 2)
    assert (made.stack, made.drives, made.arrived_m) == (2, False, NavigationPilot.arrived_m)
    assert made.task == NavigationPilot.task


def test_a_flight_of_a_class_of_ones_own_is_recorded_too(tmp_path):
    pilot, kept = goal_pilot(f"{__name__}:FullThrottle", DrivingPilot, 2), KeptFlight(tmp_path, "mine")
    parked(pilot, parking.CONDITIONS["calm"], 500_000, GuardSettings(), kept)
    words = ["dataset", "build", str(tmp_path), "--task", "Drive", "--env-args", "preset=park"]
    built = CliRunner().invoke(app, [*words, "-o", str(tmp_path / "set")])
    assert built.exit_code == 0, built.output
    with DatasetReader(tmp_path / "set") as reader:
        assert {reader.episode(k).context["pilot"] for k in range(reader.count)} == {"mine"}


@pytest.mark.parametrize(("task", "kind"), [("Navigate", NavigationPilot), ("Drive", DrivingPilot)])
def test_an_exported_policy_chooses_what_the_policy_itself_does(task, kind, tmp_path):
    path = pretrained(task) if task == "Navigate" else pretrained("drive-park")
    exported = CliRunner().invoke(app, ["export", str(path), str(tmp_path / "policy.onnx")])
    assert exported.exit_code == 0, exported.output
    own, theirs = goal_pilot(str(path), kind, 2), goal_pilot(str(tmp_path / "policy.onnx"), kind, 2)
    assert theirs.stack == own.stack
    rng = np.random.default_rng(1)
    for _ in range(10):
        vector = rng.normal(0.0, 0.5, own.stack * kind.task.frame_size).astype(np.float32)
        assert theirs.act(vector) == pytest.approx(own.act(vector), abs=1e-4)


def test_a_network_of_another_task_is_refused(tmp_path):
    CliRunner().invoke(app, ["export", str(pretrained("drive-park")), str(tmp_path / "policy.onnx")])
    with pytest.raises(PilotError, match="a pilot of this task takes frames of 69 floats"):
        goal_pilot(str(tmp_path / "policy.onnx"), NavigationPilot, 2)


def test_what_fell_short_is_named():
    good, bad = Crossing(1, "arrived", 5.0, 1.0, ""), Crossing(3, "collision", nan, 20.0, "")
    assert misses("navigate", {"400-late-0": [good]}) == []
    assert len(misses("navigate", {"400-late-0": [good, bad]})) == 2
    slow = Crossing(5, "arrived", 4.9, 1.0, "")
    (line,) = misses("navigate", {"400-late-0": [slow]})
    assert line.endswith("4.90 m/s on the way, wanted 5")
    there, touched = Parking(1, "there", 9.0, 0.1, 2.0, 0.0, ""), Parking(3, "touched", 3.0, 2.0, 40.0, 0.0, "")
    assert misses("park", {"calm": [there]}) == []
    assert len(misses("park", {"calm": [there, touched]})) == 2


def test_every_condition_has_a_title_of_its_own():
    for benchmark in (navigating.BENCHMARK, parking.BENCHMARK):
        assert len(set(benchmark.titles.values())) == len(benchmark.titles)
