"""A flight of a policy that looks at images becomes a dataset with vector and image of each of its decisions."""

import json
import shutil

import gymnasium
import numpy as np
import pytest
from minari import MinariDataset
from typer.testing import CliRunner

from mission.cli import app
from policies.companion.pilot import load_pilot
from policies.datasets.reader import DatasetReader
from tests.system.companion.test_recorded_flight import flown
from tests.unit.policies.companion.test_pilot import policy_file

CAMERA = ("--env-args", "observation=camera")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    parent = tmp_path_factory.mktemp("camera")
    folder = parent / "run"
    return folder, flown(folder, str(policy_file(parent)))


def built(source, out, *words):
    return CliRunner().invoke(app, ["dataset", "build", str(source), "--task", "FollowMe", "-o", str(out), *words])


def test_the_dataset_holds_what_the_policy_saw_and_chose_in_the_layout_of_the_environment(run, tmp_path):
    folder, pilot = run
    result = built(folder, tmp_path / "set", *CAMERA)
    assert result.exit_code == 0, result.output
    dataset = MinariDataset(tmp_path / "set")
    (episode,) = dataset.iterate_episodes()
    vectors, images = episode.observations["vector"], episode.observations["image"]
    n = len(vectors)
    assert n > 35
    (first,) = [k for k in range(len(pilot.seen) - n + 1) if np.array_equal(pilot.seen[k], vectors[0])]
    assert np.array_equal(np.array(pilot.seen[first : first + n]), vectors)
    assert np.array_equal(np.array(pilot.images[first : first + n]), images)
    is_asked = (np.array(pilot.chosen[first : first + n - 1]) == episode.actions).all(axis=1)
    assert is_asked.any()  # where the guard changed nothing
    assert (abs(episode.actions) <= 1.0).all()
    env = gymnasium.make("policies:honeyguide/FollowMe-v0")
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space


def test_the_same_log_gives_the_same_bytes_and_is_shown(run, tmp_path):
    folder, _ = run
    for name in ("one", "other"):
        assert built(folder, tmp_path / name, *CAMERA).exit_code == 0
    for name in ("main_data.hdf5", "metadata.json"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()
    film = tmp_path / "e.mp4"
    shown = CliRunner().invoke(app, ["dataset", "show", str(tmp_path / "one"), "--mp4", str(film)])
    assert shown.exit_code == 0, shown.output
    assert "owner_pos_hfrd_x" in shown.output
    assert film.stat().st_size > 1_000


@pytest.mark.parametrize(
    "memory",
    [
        {"memory_size": 16, "sequence_length": 8},
        {"memory_type": "transformer", "sequence_length": 8, "layers": 1, "heads": 2},
    ],
    ids=["lstm", "transformer"],
)
def test_a_policy_that_is_cloned_from_it_acts_as_a_pilot(run, tmp_path, memory):
    folder, _ = run
    assert built(folder, tmp_path / "set", *CAMERA).exit_code == 0
    recipe = {
        "behaviors": {
            "FollowMe": {
                "trainer_type": "bc",
                "hyperparameters": {"batch_size": 32},
                "offline": {"dataset": str(tmp_path / "set"), "evaluation_episodes": 0},
                "network_settings": {
                    "normalize": True,
                    "hidden_units": 16,
                    "num_layers": 1,
                    "memory": memory,
                },
                "max_steps": 20,
            }
        },
        "env_settings": {"env_path": "FollowMe", "env_args": ["observation=camera"], "num_areas": 1},
    }
    (tmp_path / "bc.yaml").write_text(json.dumps(recipe))
    words = ["train", str(tmp_path / "bc.yaml"), "--run-id", "bc", "--results-dir", str(tmp_path), "--seed", "1"]
    trained = CliRunner().invoke(app, words)
    assert trained.exit_code == 0, trained.output
    pilot = load_pilot(str(tmp_path / "bc"))
    with DatasetReader(tmp_path / "set") as reader:
        episode = reader.episode(0)
    for vector, image in zip(episode.observations[:10], episode.images[:10], strict=True):
        action = pilot.act(vector, image)
        assert action.shape == (4,)
        assert (abs(action) <= 1.0).all()


def test_a_log_without_images_is_refused_with_file_and_topic(run, tmp_path):
    folder, _ = run
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(folder / "flight.ulg", alone)
    refused = built(alone, tmp_path / "set", *CAMERA)
    assert refused.exit_code == 2
    line = f"{alone}/flight.ulg: policy_decision: was recorded without pictures: images.zip is missing"
    assert refused.stderr.strip() == f"honeyguide: {line}"
    assert not (tmp_path / "set").exists()


def test_flights_of_pilots_without_this_vector_are_refused(run, tmp_path):
    folder, _ = run
    flown(tmp_path / "tracked", "follow-me-tracked")
    refused = built(tmp_path / "tracked", tmp_path / "set", *CAMERA)
    assert refused.exit_code == 2
    line = "policy_decision: holds no vectors of a policy that looks at pictures: none flew"
    assert refused.stderr.strip() == f"honeyguide: {tmp_path}/tracked/flight.ulg: {line}"
    other = built(folder, tmp_path / "set", *CAMERA, "--env-args", "preset=vision-only")
    assert other.exit_code == 2
    assert "policy_decision: made for another task or preset" in other.stderr
    assert not (tmp_path / "set").exists()
