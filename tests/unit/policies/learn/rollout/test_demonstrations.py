import json

import numpy as np
import pytest
import torch
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_storage import MinariStorage

from policies.experts.demonstration_file import LAYOUT_KEY
from policies.learn.rollout.demonstrations import DemonstrationError, load_demonstrations
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.gym import action_space, observation_space
from policies.tasks.layout import Branch, Element, Layout, LayoutError

STEERED = Layout("Steered", 1, (Element("heading", "rad"),), branches=(Branch("steer", ("left", "right", "none")),))


@pytest.fixture(scope="module")
def layout():
    return build_task("RollerBall", 1).layout


def episode(layout, length, seed=0, **changes):
    rng = np.random.default_rng(seed)
    actions = rng.uniform(-1, 1, (length, len(layout.continuous))).astype(np.float32)
    if layout.branches:
        actions = rng.integers(layout.branch_sizes[0], size=length)
    columns = {
        "observations": rng.normal(size=(length + 1, layout.observation_size)).astype(np.float32),
        "actions": actions,
        "rewards": np.arange(length, dtype=np.float64),
        "terminations": [False] * (length - 1) + [True],
        "truncations": [False] * length,
    }
    return EpisodeBuffer(**columns | changes)


def write(folder, layout, episodes, **metadata):
    storage = MinariStorage.new(folder, observation_space(layout), action_space(layout))
    storage.update_episodes(episodes)
    entries = {LAYOUT_KEY: json.dumps(layout.record()), "dataset_id": "test-v0", "minari_version": "0.5.4"}
    storage.update_metadata(entries | metadata)
    return folder


def test_episodes_become_one_flat_batch_in_order(tmp_path, layout):
    episodes = [episode(layout, 3, 1), episode(layout, 2, 2)]
    got = load_demonstrations(str(write(tmp_path / "set", layout, episodes)), layout)
    assert got.is_ended.tolist() == [False, False, True, False, True]
    assert got.rewards.tolist() == [0, 1, 2, 0, 1]
    assert torch.equal(got.observations[3:], torch.tensor(episodes[1].observations[:2]))
    assert torch.equal(got.next_observations[:3], torch.tensor(episodes[0].observations[1:]))
    assert torch.equal(got.continuous, torch.tensor(np.concatenate([e.actions for e in episodes])))
    assert got.branches.shape == (5, 0)


def test_choices_of_a_single_branch_get_their_column(tmp_path):
    recorded = episode(STEERED, 4)
    got = load_demonstrations(str(write(tmp_path / "set", STEERED, [recorded])), STEERED)
    assert got.branches.dtype == torch.int64
    assert got.branches[:, 0].tolist() == recorded.actions.tolist()
    assert got.continuous.shape == (4, 0)


def test_a_path_is_a_folder_a_file_in_it_a_folder_of_datasets_or_a_local_id(tmp_path, layout, monkeypatch):
    (tmp_path / "sets").mkdir()
    first = write(tmp_path / "sets" / "a", layout, [episode(layout, 3)])
    write(tmp_path / "sets" / "b", layout, [episode(layout, 2)])
    write(tmp_path / "sets" / "c.part", layout, [episode(layout, 2)])
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    for path, count in (
        (first, 3),
        (first / "main_data.hdf5", 3),
        (tmp_path / "sets", 5),
        ("sets/a", 3),
    ):
        assert len(load_demonstrations(str(path), layout).rewards) == count


def test_demonstrations_of_another_preset_are_refused_with_the_file_named(tmp_path, layout):
    stacked = build_task("RollerBall", 1, task_settings("RollerBall", {"stack": 2})).layout
    folder = write(tmp_path / "set", stacked, [episode(stacked, 3)])
    with pytest.raises(LayoutError, match=r"set: made for another task or preset: stacked frames is 2 there"):
        load_demonstrations(str(folder), layout)


def test_what_cannot_be_read_is_refused_in_one_sentence(tmp_path, layout, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    with pytest.raises(DemonstrationError, match=r"parked: no such file or folder, and no dataset of this name in"):
        load_demonstrations("parked", layout)
    with pytest.raises(DemonstrationError, match="no Minari dataset there"):
        load_demonstrations(str(tmp_path), layout)
    empty = MinariStorage.new(tmp_path / "empty", observation_space(layout), action_space(layout))
    empty.update_metadata({LAYOUT_KEY: json.dumps(layout.record())})
    with pytest.raises(DemonstrationError, match="empty: has no episodes"):
        load_demonstrations(str(tmp_path / "empty"), layout)
    foreign = write(tmp_path / "foreign", layout, [episode(layout, 3)], **{LAYOUT_KEY: ""})
    with pytest.raises(DemonstrationError, match="foreign: was not recorded by honeyguide"):
        load_demonstrations(str(foreign), layout)
    broken = write(tmp_path / "broken", layout, [episode(layout, 3)])
    (broken / "main_data.hdf5").write_bytes(b"half a file")
    with pytest.raises(DemonstrationError, match="broken: not a readable Minari dataset: "):
        load_demonstrations(str(broken), layout)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"observations": np.zeros((3, 8), np.float32)}, r"episode 0: 3 rewards need observations of shape \(4, 8\)"),
        ({"actions": np.zeros((2, 2), np.float32)}, "episode 0: 3 rewards need 6 actions, not 4"),
        ({"actions": np.full((3, 2), np.nan, np.float32)}, "episode 0: holds a value that is not finite"),
    ],
)
def test_an_episode_that_does_not_fit_is_refused(tmp_path, layout, changes, message):
    folder = write(tmp_path / "set", layout, [episode(layout, 3, **changes)])
    with pytest.raises(DemonstrationError, match=message):
        load_demonstrations(str(folder), layout)


def test_a_choice_that_no_branch_has_is_refused(tmp_path):
    folder = write(tmp_path / "set", STEERED, [episode(STEERED, 2, actions=np.array([0, 3]))])
    with pytest.raises(DemonstrationError, match="holds a choice that no branch has"):
        load_demonstrations(str(folder), STEERED)
