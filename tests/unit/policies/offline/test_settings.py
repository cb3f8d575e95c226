"""Offline training and what it reads: datasets recorded with settings that would mean something else are refused."""

import json

import numpy as np
import pytest

from common.config.yaml_locations import ConfigError
from policies.datasets.episodes import DatasetOrigin, EpisodeRows
from policies.datasets.writer import DatasetWriter
from policies.learn.config.load import load_config
from policies.learn.config.task_check import check_against_task
from policies.learn.rollout.demonstrations import DemonstrationError
from policies.offline.store import open_store
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.settings_difference import settings_difference


def recorded(folder, task, *pairs):
    """A dataset of one decision."""
    settings = settings_of(task, pairs)
    layout = build_task(task, 1, settings).layout
    observations = np.zeros((2, layout.observation_size), np.float32)
    actions = np.zeros((1, len(layout.continuous)), np.float32)
    with DatasetWriter(folder, DatasetOrigin(layout, settings.model_dump(mode="json"), "nobody")) as writer:
        writer.add(EpisodeRows(observations, actions, np.zeros(1), is_terminated=True, outcome="success"))
    return str(folder)


def recipe(folder, task, *pairs, datasets):
    behavior = {"trainer_type": "bc", "offline": {"dataset": datasets}, "max_steps": 10}
    environment = {"env_path": task, "env_args": list(pairs)}
    path = folder / "recipe.yaml"
    path.write_text(json.dumps({"behaviors": {task: behavior}, "env_settings": environment}, indent=1))
    return load_config(path)


def test_training_refuses_a_dataset_of_another_preset(tmp_path):
    park = recorded(tmp_path / "parked", "Drive", "preset=park")
    check_against_task(recipe(tmp_path, "Drive", "preset=park", datasets=[park]))
    with pytest.raises(ConfigError) as refused:
        check_against_task(recipe(tmp_path, "Drive", "preset=reach", datasets=[park]))
    sentence = "offline.dataset: " + f"{park}: recorded with other settings: preset is park there and reach here"
    assert str(refused.value).endswith(sentence)
    assert str(refused.value).startswith(f"{tmp_path / 'recipe.yaml'}:")


def test_training_takes_a_dataset_of_other_conditions(tmp_path):
    flown = recorded(tmp_path / "flown", "Drive", "preset=park", "has_estimator=true", "split=train")
    loaded = recipe(tmp_path, "Drive", "preset=park", "has_estimator=false", "split=test", datasets=[flown])
    check_against_task(loaded)


def test_datasets_of_different_settings_are_not_learnt_from_together(tmp_path):
    reach, park = (recorded(tmp_path / name, "Drive", f"preset={name}") for name in ("reach", "park"))
    with pytest.raises(DemonstrationError) as refused:
        open_store([reach, park])
    assert (
        str(refused.value) == f"{park}: recorded with other settings than {reach}: preset is park there and reach here"
    )


@pytest.mark.parametrize("task", ["own_module:Task", "Unknown"])
def test_of_a_task_that_is_not_known_here_all_but_the_split_counts(task):
    assert settings_difference(task, {"split": "train"}, {"split": "test"}) == ""
    assert settings_difference(task, {"has_wind": True}, {"has_wind": False}) == "has_wind is False there and True here"
    assert settings_difference(task, {"newer": True, "same": 1}, {"older": True, "same": 1}) == ""
