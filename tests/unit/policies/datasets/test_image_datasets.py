"""Datasets whose observations are a vector and an image: as the environment shows them, and edited whole."""

import json
from dataclasses import replace

import gymnasium
import h5py
import numpy as np
import pytest
from minari import MinariDataset

from policies.datasets.editing import keep, merge, split
from policies.datasets.episodes import DatasetError, DatasetOrigin, EpisodeRows
from policies.datasets.exporting import export_d4rl
from policies.datasets.reader import DatasetReader
from policies.datasets.statistics import statistics_of
from policies.datasets.writer import DatasetWriter
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.layout import Element, ImageElement, Layout

PIXELS = ImageElement(8, 8, ("red", "green", "blue", "depth"))
LAYOUT = Layout("FollowMe", 1, (Element("a", "m"), Element("b", "1")), (Element("go", "m/s"),), image=PIXELS)


def episode(steps=5, seed=0, *, shape=(8, 8, 4)):
    rng = np.random.default_rng(seed)
    return EpisodeRows(
        observations=rng.normal(size=(steps + 1, 2)).astype(np.float32),
        actions=rng.uniform(-1.0, 1.0, (steps, 1)).astype(np.float32),
        rewards=rng.normal(size=steps),
        is_terminated=True,
        outcome="success" if seed % 2 == 0 else "lost",
        images=None if shape is None else rng.integers(0, 256, (steps + 1, *shape), np.uint8),
    )


def written(folder, seeds=range(6)):
    with DatasetWriter(folder, DatasetOrigin(LAYOUT, {}, "test")) as writer:
        writer.add_all(episode(5 + seed, seed) for seed in seeds)
    return folder


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_minari_reads_vector_and_image_to_the_byte(tmp_path):
    dataset = MinariDataset(written(tmp_path / "set"))
    for seed, found in enumerate(dataset.iterate_episodes()):
        expected = episode(5 + seed, seed)
        assert np.array_equal(found.observations["vector"], expected.observations)
        assert np.array_equal(found.observations["image"], expected.images)
        assert found.observations["image"].dtype == np.uint8


def test_the_observation_space_is_that_of_the_environment(tmp_path):
    settings = settings_of("FollowMe", ("observation=camera",))
    task = build_task("FollowMe", 1, settings)
    rows = EpisodeRows(
        observations=np.zeros((2, task.layout.observation_size), np.float32),
        actions=np.zeros((1, 4), np.float32),
        rewards=np.zeros(1),
        is_terminated=True,
        outcome="lost",
        images=np.zeros((2, *task.layout.image_shape), np.uint8),
    )
    origin = DatasetOrigin(task.layout, settings.model_dump(mode="json"), "test")
    with DatasetWriter(tmp_path / "set", origin) as writer:
        writer.add(rows)
    env = gymnasium.make("policies:honeyguide/FollowMe-v0", observation="camera")
    dataset = MinariDataset(tmp_path / "set")
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space
    assert env.observation_space.contains({name: part[0] for name, part in dataset[0].observations.items()})


def test_the_same_episodes_give_the_same_bytes_and_a_merge_of_one_too(tmp_path):
    one = files(written(tmp_path / "one"))
    assert one == files(written(tmp_path / "other"))
    merge([tmp_path / "one"], tmp_path / "merged")
    assert one == files(tmp_path / "merged")


def test_split_merge_and_filter_keep_images_with_their_vectors(tmp_path):
    whole = written(tmp_path / "whole")
    split(whole, 0.5, 1, (tmp_path / "a", tmp_path / "b"))
    merge([tmp_path / "a", tmp_path / "b"], tmp_path / "again")
    assert keep(whole, tmp_path / "good", lambda each: each.is_success) == 3
    for folder in ("again", "good"):
        with DatasetReader(tmp_path / folder) as reader:
            for found in reader:
                expected = episode(len(found), len(found) - 5)
                assert np.array_equal(found.observations, expected.observations)
                assert np.array_equal(found.images, expected.images)


def test_statistics_are_of_the_vector(tmp_path):
    with DatasetReader(written(tmp_path / "set")) as reader:
        found = statistics_of(reader)
        assert reader.episode(0, has_images=False).images is None
    assert found.observations.names == ("a", "b")
    assert found.steps == sum(range(5, 11))


@pytest.mark.parametrize("shape", [None, (8, 8, 3)])
def test_an_episode_without_its_images_is_refused(tmp_path, shape):
    with (
        pytest.raises(DatasetError, match=r"set: an episode with images of shape .*, not \(8, 8, 4\)"),
        DatasetWriter(tmp_path / "set", DatasetOrigin(LAYOUT, {}, "test")) as writer,
    ):
        writer.add(episode(shape=shape))
    assert not list(tmp_path.iterdir())


def test_an_episode_with_an_image_too_few_is_refused():
    whole = episode()
    with pytest.raises(DatasetError, match="an episode of 6 observations has 5 images"):
        EpisodeRows(whole.observations, whole.actions, whole.rewards, True, "lost", whole.images[:-1])


def test_d4rl_has_an_image_beside_each_observation_and_those_after_the_last_steps(tmp_path):
    assert export_d4rl(written(tmp_path / "set"), tmp_path / "flat.hdf5") == sum(range(5, 11))
    expected = [episode(5 + seed, seed) for seed in range(6)]
    with h5py.File(tmp_path / "flat.hdf5") as file:
        columns = {name: rows[()] for name, rows in file.items()}
        assert json.loads(file.attrs["layout"])["image"]["channels"] == list(PIXELS.channels)
    assert columns["images"].dtype == np.uint8
    assert np.array_equal(columns["images"], np.concatenate([each.images[:-1] for each in expected]))
    assert np.array_equal(columns["observations"], np.concatenate([each.observations[:-1] for each in expected]))
    following = np.roll(columns["images"], -1, axis=0)  # as the docs tell to find that of `next_observations`
    following[columns["terminals"] | columns["timeouts"]] = columns["final_images"]
    assert np.array_equal(following, np.concatenate([each.images[1:] for each in expected]))


def test_d4rl_has_no_images_of_those_beside_a_vector(tmp_path):
    layout = replace(LAYOUT, image=None)
    with DatasetWriter(tmp_path / "set", DatasetOrigin(layout, {}, "test")) as writer:
        writer.add(episode())
    export_d4rl(tmp_path / "set", tmp_path / "flat.hdf5")
    with h5py.File(tmp_path / "flat.hdf5") as file:
        assert not {"images", "final_images"} & set(file)
