"""Policies that look at images are cloned from datasets with images, in memory or streamed from disk; others refuse."""

import numpy as np
import pytest
import torch

from policies.datasets.collecting import collected
from policies.datasets.episodes import DatasetOrigin
from policies.datasets.writer import DatasetWriter
from policies.learn.rollout.demonstrations import DemonstrationError, load_demonstrations
from policies.offline import dataset_files
from policies.offline.algorithm import OfflineError
from policies.offline.draws import Draws
from policies.offline.store import open_store
from tests.unit.policies.learn.squares import Squares
from tests.unit.policies.offline.test_algorithms import MEMORIES, behavior, built

MEMORY = {"lstm": MEMORIES["lstm"] | {"memory_size": 32}, "transformer": MEMORIES["transformer"]}
NETWORK = {"hidden_units": 16, "num_layers": 1, "vis_encode_type": "compact"}


class Pointing:
    """Points where the square is, as its side says: only the image tells where."""

    def act(self, task):
        world = task.world
        task.buffers.continuous.assign((world.place.numpy() * world.side.numpy())[:, None])


@pytest.fixture(scope="module")
def squares(tmp_path_factory):
    """A dataset of 64 episodes of 4 decisions."""
    folder = tmp_path_factory.mktemp("squares") / "set"
    task = Squares(16)
    with DatasetWriter(folder, DatasetOrigin(task.layout, {}, "expert")) as writer:
        writer.add_all(collected(task, Pointing(), 64, seed=1))
    return folder


def test_collected_images_are_those_of_their_decisions(squares):
    store = open_store([str(squares)])
    assert len(store) == 256
    decisions = store.images[:, 0, 0, 2]  # as the task writes into each image
    assert decisions.reshape(64, 5).tolist() == [[0, 1, 2, 3, 4]] * 64
    assert (store.images[:, 0, 0, 0].reshape(64, 5).float().std(dim=1) == 0.0).all()  # of one row


def test_what_is_streamed_from_disk_is_what_is_in_memory(squares, tmp_path, monkeypatch):
    monkeypatch.setattr(dataset_files, "_IMAGE_BYTES", 2 * 32 * 32 * 3)  # two images at a time
    here = open_store([str(squares)])
    mapped = open_store([str(squares)], memory_limit=0, cache=tmp_path)
    assert len(list(tmp_path.glob("rows-*-images.npy"))) == 1
    assert torch.equal(here.images, mapped.images)
    assert torch.equal(here.rows, mapped.rows)


@pytest.mark.parametrize("memory", [None, *MEMORY])
def test_the_loss_of_cloning_falls(squares, memory):
    network = NETWORK if memory is None else NETWORK | {"memory": MEMORY[memory]}
    settings, store = behavior("bc", network, learning_rate=5e-3), open_store([str(squares)])
    _, cloning = built(settings, store)
    draws = Draws(store, 64, 1 if memory is None else 4, 1.0)
    losses = [float(cloning.step(rows)) for rows in draws.block(150, torch.Generator().manual_seed(1))]
    assert np.mean(losses[-10:]) < 0.1 * np.mean(losses[:10])  # of black images nothing is learnt: 0.8 to 1.1


@pytest.mark.parametrize("trainer", ["td3_bc", "iql", "awac"])
def test_others_refuse_images(squares, trainer):
    with pytest.raises(OfflineError, match=f"trainer_type: {trainer} sees no images, and Squares as it is set shows"):
        built(behavior(trainer, NETWORK), open_store([str(squares)]))


def test_demonstrations_of_other_trainers_hold_no_images(squares):
    with pytest.raises(DemonstrationError, match="holds images, and demonstrations are read without"):
        load_demonstrations(str(squares), Squares(1).layout)
