"""How followers are compared: alike but for what is compared, in a recipe's episodes where it is asked for."""

import pytest
import typer

from bench.follow.choice import main, numbers_of
from bench.follow.memory import MEMORIES, configured
from policies.tasks.catalogue import build_task, settings_of


@pytest.mark.parametrize("name", MEMORIES)
def test_students_are_trained_alike_but_for_what_they_remember(name):
    frames, memory = MEMORIES[name]
    first, other = configured("none", 1).model_dump(), configured(name, 1).model_dump()
    assert other["env_settings"]["env_args"][-1] == f"stack={frames}"
    assert (other["behavior"]["network_settings"]["memory"] is None) == (memory is None)
    for each in (first, other):
        each["env_settings"]["env_args"] = each["env_settings"]["env_args"][:-1]
        del each["behavior"]["network_settings"]["memory"], each["checkpoint_settings"]["run_id"]
    assert first == other


def test_the_numbers_of_a_recipe_reach_the_task():
    numbers = numbers_of("follow-me-tracked-away")
    task = build_task("FollowMe", 64, settings_of("FollowMe", ("observation=tracked", "has_estimator=false")))
    task.set_params(numbers)
    task.reset(3)
    rows = dict(zip(task.param_table.names, task.buffers.params.numpy().T, strict=True))
    assert (rows["unseen_limit_s"] == 12.0).all()
    assert (rows["owner_hide_s"] >= 1000.0).any()
    assert (rows["owner_hide_s"] < 2.0).any()


def test_what_would_say_a_wrong_figure_is_refused(tmp_path):
    with pytest.raises(typer.BadParameter, match=r"no-recipe: none of .*follow-me-tracked"):
        numbers_of("no-recipe")
    with pytest.raises(typer.BadParameter, match="--out: a card's figure is of the preset's episodes"):
        main([tmp_path / "a.pt"], recipe="follow-me-tracked-away", out=tmp_path / "b.pt")
