import json
import os

import numpy as np
import pytest
import torch

from policies.experts.demonstration_file import LAYOUT_KEY
from policies.learn.rollout.demonstrations import DemonstrationError, load_demonstrations
from policies.offline import dataset_files
from policies.offline.store import open_store
from policies.tasks.layout import LayoutError
from tests.unit.policies.offline.datasets import PUSHED, STEERED, episode, write


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    episodes = [episode(PUSHED, 3, 1), episode(PUSHED, 2, 2, is_cut=True), episode(PUSHED, 1, 3)]
    return write(tmp_path_factory.mktemp("pushed") / "set", PUSHED, episodes)


def test_the_store_holds_what_demonstrations_hold(dataset):
    store, expected = open_store([str(dataset)]), load_demonstrations(str(dataset), PUSHED)
    got = store.take(store.decisions)
    for name in ("observations", "next_observations", "continuous", "branches", "rewards", "is_ended"):
        assert torch.equal(getattr(got, name), getattr(expected, name)), name
    assert got.is_terminated.tolist() == [0, 0, 1, 0, 0, 1]  # the second was only cut
    assert (len(store), store.episode_count) == (6, 3)
    assert store.lengths.tolist() == [3, 2, 1]
    assert store.starts.tolist() == [0, 4, 7]
    assert store.episode_returns().tolist() == [3, 1, 0]
    assert torch.equal(torch.cat([part.rewards for part in store.in_order(4)]), expected.rewards)


def test_statistics_are_those_of_all_observations(dataset):
    store = open_store([str(dataset)])
    statistics = store.statistics()
    observations = store.observations.double()
    torch.testing.assert_close(statistics.mean, observations.mean(0))
    torch.testing.assert_close(statistics.variance, observations.var(0, correction=0))
    assert statistics.reward_mean == pytest.approx(4 / 6)
    assert statistics.reward_deviation == pytest.approx(np.std([0, 1, 2, 0, 1, 0]))


def test_a_mapped_store_is_the_same_and_is_made_anew_when_the_dataset_changes(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(dataset_files, "CHUNK_ROWS", 2)
    small = open_store([str(dataset)])
    mapped = open_store([str(dataset)], memory_limit=0)
    assert torch.equal(small.rows, mapped.rows)
    (cache,) = dataset.glob("rows-*.npy")
    made = cache.stat().st_mtime_ns
    open_store([str(dataset)], memory_limit=0)
    assert cache.stat().st_mtime_ns == made
    data = dataset / "main_data.hdf5"
    os.utime(data, ns=(0, 7))
    open_store([str(dataset)], memory_limit=0)
    (again,) = dataset.glob("rows-*.npy")
    assert again != cache
    open_store([str(dataset)], memory_limit=0, cache=tmp_path / "elsewhere")
    assert len(list((tmp_path / "elsewhere").iterdir())) == 1


def test_a_cache_is_made_whole_or_not_at_all(tmp_path):
    bad = episode(PUSHED, 2, rewards=np.array([0.0, np.nan]))
    folder = write(tmp_path / "set", PUSHED, [episode(PUSHED, 3), bad])
    with pytest.raises(DemonstrationError, match="episode 1: holds a value that is not finite"):
        open_store([str(folder)], memory_limit=0)
    assert sorted(path.name for path in folder.iterdir()) == ["main_data.hdf5", "metadata.json"]
    with pytest.raises(DemonstrationError, match="the cache cannot be written"):
        open_store([str(folder)], memory_limit=0, cache=folder / "metadata.json")


def test_several_datasets_follow_each_other(dataset, tmp_path):
    other = write(tmp_path / "other", PUSHED, [episode(PUSHED, 4, 9)])
    store = open_store([str(dataset), str(other)])
    assert store.lengths.tolist() == [3, 2, 1, 4]
    assert store.identity() != open_store([str(dataset)]).identity()


def test_choices_come_back_as_whole_numbers(tmp_path):
    recorded = episode(STEERED, 4)
    store = open_store([str(write(tmp_path / "set", STEERED, [recorded]))])
    batch = store.take(store.decisions)
    assert batch.branches.dtype == torch.int64
    assert batch.branches[:, 0].tolist() == recorded.actions.tolist()


def test_what_cannot_be_learnt_from_is_refused_in_one_sentence(dataset, tmp_path):
    with pytest.raises(LayoutError, match="task is Pushed there and Steered here"):
        open_store([str(dataset)], STEERED)
    with pytest.raises(DemonstrationError, match="no such file or folder"):
        open_store([str(tmp_path / "nothing")])
    with pytest.raises(DemonstrationError, match="no dataset is named"):
        open_store([])
    goes_on = episode(PUSHED, 3, terminations=[True, False, True])
    with pytest.raises(DemonstrationError, match="episode 0: goes on after a decision that ended it"):
        open_store([str(write(tmp_path / "on", PUSHED, [goes_on]))])
    folder = write(tmp_path / "damaged", PUSHED, [episode(PUSHED, 3)])
    (folder / "main_data.hdf5").write_bytes(b"nothing")
    with pytest.raises(DemonstrationError, match="not a readable Minari dataset"):
        open_store([str(folder)])
    metadata = json.loads((folder / "metadata.json").read_text())
    del metadata[LAYOUT_KEY]
    (folder / "metadata.json").write_text(json.dumps(metadata))
    with pytest.raises(DemonstrationError, match="was not recorded by honeyguide"):
        open_store([str(folder)])
