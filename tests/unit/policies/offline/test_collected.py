"""What `dataset collect` writes is what training from datasets reads: from episodes to a judged policy."""

import json
import re

import numpy as np
from typer.testing import CliRunner

from mission.cli import app
from policies.datasets.reader import DatasetReader
from policies.offline.store import open_store


def recipe(dataset):
    behavior = {
        "trainer_type": "iql",
        "offline": {"dataset": str(dataset), "evaluation_episodes": 4},
        "network_settings": {"normalize": True, "hidden_units": 16, "num_layers": 1},
        "max_steps": 400,
    }
    return {"behaviors": {"RollerBall": behavior}, "env_settings": {"env_path": "RollerBall", "num_areas": 4}}


def invoked(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output


def test_a_collected_dataset_is_trained_from_and_its_policy_judged(tmp_path):
    folder = tmp_path / "set"
    collected = ("dataset", "collect", "RollerBall", "--policy", "expert", "--noise", "0.3", "--episodes", "12")
    invoked(*collected, "-o", folder)
    store = open_store([str(folder)])
    with DatasetReader(folder) as reader:
        assert (store.episode_count, len(store), store.layout) == (12, reader.steps, reader.layout)
        for returned, episode in zip(store.episode_returns().tolist(), reader, strict=True):
            assert abs(returned - episode.rewards.sum()) < 1e-4
        rows = np.concatenate([episode.observations for episode in reader])
    assert np.array_equal(store.observations.numpy(), rows.astype(np.float32))

    (tmp_path / "iql.yaml").write_text(json.dumps(recipe(folder)))
    invoked("train", tmp_path / "iql.yaml", "--run-id", "r", "--results-dir", tmp_path, "--seed", "1")
    judged = invoked("eval", tmp_path / "r" / "RollerBall.pt", "--episodes", "4")
    assert re.search(r"episodes +│ 4 ", judged)
