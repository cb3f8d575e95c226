"""`honeyguide eval` and `export`, on a run that `honeyguide train` has finished."""

from pathlib import Path

from policies.learn.export.policy_file import load_policy
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
