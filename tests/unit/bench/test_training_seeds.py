"""How the policy that ships is chosen among those of several seeds."""

import json
from pathlib import Path

import pytest

from bench.training_seeds import SEEDS, TRAININGS, Judged, main, policy_of, train, train_all
from common.intervals import Interval
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.export.policy_path import find_policy


@pytest.mark.parametrize("name", TRAININGS)
def test_legs_are_recipes_of_the_task_and_the_last_has_late_scans(name):
    story = TRAININGS[name]
    configs = [load_config(recipe(leg)).config for leg in story.legs]
    assert {config.env_settings.env_path for config in configs} == {story.task}
    assert {"scan_lag_s", "attitude_error_deg"} <= set(configs[-1].environment_parameters)


def test_a_leg_begins_when_the_one_before_it_has_ended_and_not_by_what_an_earlier_training_left(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = "drive-park"
    first, second = TRAININGS[name].legs
    earlier = [policy_of(name, seed, leg) for seed in SEEDS for leg in (first, second)]
    for path in earlier:
        path.parent.mkdir(parents=True)
        path.touch()
    monkeypatch.setattr("bench.training_seeds.run_side_by_side", lambda jobs, *_: jobs)
    jobs = {job.name: job for job in train_all(name)}
    assert len(jobs) == len(earlier)
    assert {job for job in jobs if jobs[job].is_ready()} == {f"{name}-seed-{seed}-{first}" for seed in SEEDS}
    policy_of(name, 2, first).touch()
    assert jobs[f"{name}-seed-2-{second}"].is_ready()
    assert not jobs[f"{name}-seed-1-{second}"].is_ready()


def test_a_leg_that_was_stopped_and_no_other_leaves_no_policy_to_go_on_from(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = policy_of("drive-reach", 1, "drive-reach")

    def ended(*_: object, **__: object) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(find_policy("reach-target").read_bytes())
        status = path.parent / "run_logs" / "training_status.json"
        status.parent.mkdir(exist_ok=True)
        status.write_text(json.dumps({"end": end}))

    end = "stopped"
    monkeypatch.setattr("bench.training_seeds.subprocess.run", ended)
    with pytest.raises(SystemExit, match="was stopped before its end"):
        train("drive-reach", 1, "drive-reach")
    assert not path.exists()
    end = "max_steps"
    train("drive-reach", 1, "drive-reach")  # also where the best policy is an earlier one
    assert path.exists()


def test_failed_legs_are_named_and_nothing_is_chosen(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("bench.training_seeds.run_side_by_side", lambda jobs, *_: [jobs[0].name])
    chosen = Path("results/drive-reach-chosen.pt")
    chosen.parent.mkdir()
    chosen.touch()
    assert main(["drive-reach"]) == 1
    assert "drive-reach-seed-1-drive-reach failed" in capsys.readouterr().out
    assert not chosen.exists()


def test_a_policy_is_as_good_as_its_intervals_begin_on_average():
    success = (Interval(0.9, 0.8, 1.0), Interval(0.8, 0.7, 0.9), Interval(0.5, 0.3, 0.7))
    judged = Judged(Path("a.pt"), success, ("1 s", "2 s", "3 s"))
    assert judged.low == pytest.approx(0.6)
    assert judged.row.startswith("| a.pt | 90.0 % (80.0 to 100.0), 1 s | 80.0 % (70.0 to 90.0), 2 s |")


def test_a_policy_that_is_not_known_is_refused(capsys):
    assert main(["hover"]) == 2
    assert f"name one of {', '.join(TRAININGS)}" in capsys.readouterr().out
    assert main(["drive-park", "seed=1", "hover"]) == 2
    assert "name one of drive-park, drive-park-careful" in capsys.readouterr().out
