"""Datasets and stores of a small made-up task, for the tests of offline training."""

import json

import numpy as np
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_storage import MinariStorage

from policies.experts.demonstration_file import LAYOUT_KEY
from policies.offline.store import OfflineStore
from policies.tasks.gym_arrays import action_space, observation_space
from policies.tasks.layout import Branch, Element, Layout

PUSHED = Layout("Pushed", 1, (Element("place", "m"), Element("speed", "m/s")), continuous=(Element("push", "1"),))
STEERED = Layout("Steered", 1, (Element("heading", "rad"),), branches=(Branch("steer", ("left", "right", "none")),))


def episode(layout, length, seed=0, *, is_cut=False, **changes):
    """An episode of random numbers; rewards count its decisions."""
    rng = np.random.default_rng(seed)
    actions = rng.uniform(-1, 1, (length, len(layout.continuous))).astype(np.float32)
    if layout.branches:
        actions = rng.integers(layout.branch_sizes[0], size=length)
    is_last = [False] * (length - 1) + [True]
    columns = {
        "observations": rng.normal(2.0, 3.0, size=(length + 1, layout.observation_size)).astype(np.float32),
        "actions": actions,
        "rewards": np.arange(length, dtype=np.float64),
        "terminations": [False] * length if is_cut else is_last,
        "truncations": is_last if is_cut else [False] * length,
    }
    return EpisodeBuffer(**columns | changes)


def write(folder, layout, episodes):
    """A dataset as `honeyguide` writes it."""
    storage = MinariStorage.new(folder.absolute(), observation_space(layout), action_space(layout))
    storage.update_episodes(episodes)
    entries = {LAYOUT_KEY: json.dumps(layout.record()), "dataset_id": "test-v0", "minari_version": "0.5.4"}
    storage.update_metadata(entries)
    return folder


def store_of(layout, rows):
    """A store of given rows; see `policies.offline.dataset_files`."""
    return OfflineStore(layout, np.array(rows, dtype=np.float32))
