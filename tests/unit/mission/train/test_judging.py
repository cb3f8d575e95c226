"""`honeyguide eval` and `export`, on a run that `honeyguide train` has finished."""

from pathlib import Path

from mission.train.policy_card import card_rows
from policies.learn.export.policy_file import PolicyCard, load_policy
from policies.learn.export.provenance import code_record
from policies.tasks.catalogue import build_task
from tests.unit.mission.train.training_run import honeyguide, write_config


def test_policy_is_judged_on_held_out_places(finished):
    result = honeyguide("eval", finished, "--episodes", "50", "--seed", "4")
    assert result.exit_code == 0, result.output
    assert "split=test" in result.output
    assert "seed 4" in result.output
    assert "success rate" in result.output
    result = honeyguide("eval", finished / "Ball/Ball-2048.pt", "--episodes", "10", "--env-args", "split=train")
    assert "split=train" in result.output


def test_a_card_shows_where_a_policy_comes_from(finished):
    result = honeyguide("card", finished)
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.replace("│", " ").split())
    assert "task RollerBall (preset=as-coded, split=train, stack=0)" in text
    assert "seed 3 steps 10,240" in text
    assert f"version {code_record()['version']}, commit {code_record()['commit'][:30]}" in text
    assert "(95 %: " in text
    assert "last episodes" in text


def test_a_cards_rows_name_teacher_data_and_the_legs_before():
    parent = {"task": "Hover", "seed": 4, "steps": 500, "code": {"version": "1", "commit": "abc"}}
    data = {"path": "shown", "use": "gail", "episodes": 3, "pilot": "expert"}
    teacher = {"policy": "master", "weights_sha256": "0123456789abcdef", "card": parent}
    figures = {"success_rate": 0.9, "success_low": 0.88, "success_high": 0.92, "episodes": 2000}
    taught = {"task": "Hover", "seed": 5, "steps": 600, "teacher": teacher}
    rows = dict(card_rows(PolicyCard("Hover", {}, 1, 9, figures, {}, [parent], {}, teacher, [data])))
    assert rows["success, judged"] == "90.00 % (95 %: 88.00 to 92.00) of 2,000 episodes that it did not train on"
    assert rows["teacher"] == "master: Hover, seed 4, 500 steps, commit abc; 0123456789ab"
    assert rows["data, gail"] == "shown: episodes 3, pilot expert"
    assert rows["began with"] == "Hover, seed 4, 500 steps, commit abc"
    (_, text) = list(card_rows(PolicyCard("Hover", {}, 1, 9, {}, {}, [taught])))[-1]
    assert text == f"Hover, seed 5, 600 steps; its teacher {rows['teacher']}"
    assert rows["code"] == "not known"


def test_the_card_of_nobody_is_refused():
    result = honeyguide("card", "nobody")
    assert result.exit_code == 2
    assert "nobody: no such policy file" in result.stderr


def test_policy_is_judged_with_the_numbers_it_was_trained_with():
    for name, step_limit in (("short", 1.0), ("long", 50.0)):
        write_config(max_steps=1, parameters={"step_limit": step_limit, "reach_m": 0.1})
        assert honeyguide("train", "config.yaml", "--run-id", name).exit_code == 0
    short, long = (honeyguide("eval", name, "--episodes", "20").output for name in ("short", "long"))
    assert "1.0 decisions" in short
    assert "1.0 decisions" not in long


def test_policy_is_refused_for_another_task(finished):
    result = honeyguide("eval", finished, "--task", "ReachTarget")
    assert result.exit_code == 2
    assert "made for another task or preset" in result.stderr


def test_inference_plays_the_run(finished):
    result = honeyguide(
        *("train", finished / "configuration.yaml", "--run-id", "run", "--results-dir", finished.parent),
        *("--inference", "--deterministic"),
    )
    assert result.exit_code == 0, result.output
    assert "mean reward" in result.output


def test_exported_network_is_written_where_asked(finished):
    result = honeyguide("export", finished, "a.onnx")
    assert result.exit_code == 0, result.output
    assert Path("a.onnx").read_bytes() == (finished / "Ball.onnx").read_bytes()
    assert honeyguide("export", finished, "no/folder/a.onnx").exit_code == 2


def test_layout_of_the_policy_is_that_of_the_task(finished):
    assert load_policy(finished / "Ball.pt")[0].layout == build_task("RollerBall", 1).layout
