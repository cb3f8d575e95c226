"""Datasets on disk: the same bytes for the same episodes, whole or not at all, and what is made of them."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from minari import MinariDataset

from policies.datasets.collecting import NoisyDriver, collected
from policies.datasets.editing import keep, merge, split
from policies.datasets.episodes import DatasetError, DatasetOrigin, EpisodeRows
from policies.datasets.exporting import export_d4rl
from policies.datasets.reader import DatasetReader
from policies.datasets.statistics import statistics_of
from policies.datasets.writer import DatasetWriter
from policies.experts.catalogue import build_expert
from policies.experts.demonstration_file import DemonstrationFileError
from policies.learn.rollout.demonstrations import load_demonstrations
from policies.tasks.catalogue import build_task
from policies.tasks.layout import Element, Layout, LayoutError

LAYOUT = Layout("Hover", 1, (Element("a", "m"), Element("b", "1")), (Element("go", "m/s"),))
OTHER = Layout("Hover", 2, LAYOUT.frame, LAYOUT.continuous)


def episode(steps=5, seed=0, **more):
    rng = np.random.default_rng(seed)
    return EpisodeRows(
        observations=rng.normal(size=(steps + 1, 2)).astype(np.float32),
        actions=rng.uniform(-1.0, 1.0, (steps, 1)).astype(np.float32),
        rewards=rng.normal(size=steps),
        is_terminated=seed % 2 == 0,
        outcome="success" if seed % 2 == 0 else "timeout",
        context={"source": f"run-{seed}/flight.ulg", "wind_m_s": 2.0},
        **more,
    )


def written(folder, seeds=(0, 1, 2), layout=LAYOUT, notes=None, **settings):
    origin = DatasetOrigin(layout, {"preset": "improved"} | settings, "test", notes=notes or {})
    with DatasetWriter(folder, origin) as writer:
        writer.add_all(episode(5 + seed, seed) for seed in seeds)
    return folder


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_same_episodes_give_the_same_bytes(tmp_path):
    assert files(written(tmp_path / "one")) == files(written(tmp_path / "other"))


def test_minari_and_the_learner_read_what_was_written(tmp_path):
    folder = written(tmp_path / "set")
    dataset = MinariDataset(folder)
    assert dataset.total_episodes == 3
    assert dataset.total_steps == 5 + 6 + 7
    for seed, found in enumerate(dataset.iterate_episodes()):
        expected = episode(5 + seed, seed)
        assert np.array_equal(found.observations, expected.observations)
        assert np.array_equal(found.actions, expected.actions)
        assert np.array_equal(found.rewards, expected.rewards)
        assert found.terminations[-1] == expected.is_terminated
        assert found.truncations[-1] != expected.is_terminated
    assert len(load_demonstrations(str(folder), LAYOUT).rewards) == 18


def test_images_lie_beside_the_observations_without_loss(tmp_path):
    images = np.random.default_rng(1).integers(0, 255, (6, 8, 8, 4), np.uint8)
    with DatasetWriter(tmp_path / "set", DatasetOrigin(LAYOUT, {}, "test")) as writer:
        writer.add(episode(images=images))
    assert np.array_equal(MinariDataset(tmp_path / "set")[0].infos["images"], images)


def test_what_is_left_by_an_error_leaves_nothing(tmp_path):
    def broken():
        yield episode()
        raise DatasetError("a log: has no topic")

    with (
        pytest.raises(DatasetError, match="has no topic"),
        DatasetWriter(tmp_path / "set", DatasetOrigin(LAYOUT, {}, "test")) as writer,
    ):
        writer.add_all(broken())
    assert list(tmp_path.iterdir()) == []


def test_a_dataset_without_an_episode_is_none(tmp_path):
    with (
        pytest.raises(DatasetError, match="no episode"),
        DatasetWriter(tmp_path / "set", DatasetOrigin(LAYOUT, {}, "test")),
    ):
        pass
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_already_stays(tmp_path):
    before = files(written(tmp_path / "set"))
    with pytest.raises(DemonstrationFileError, match="already"):
        written(tmp_path / "set", (3,))
    assert files(tmp_path / "set") == before


def test_merged_parts_of_a_split_are_the_episodes_of_the_whole(tmp_path):
    whole = written(tmp_path / "whole", range(8))
    assert split(whole, 0.75, 3, (tmp_path / "a", tmp_path / "b")) == (6, 2)
    assert merge([tmp_path / "a", tmp_path / "b"], tmp_path / "again") == 8
    with DatasetReader(whole) as one, DatasetReader(tmp_path / "again") as other:
        assert sorted(e.rewards.sum() for e in one) == sorted(e.rewards.sum() for e in other)
        assert [e.context for e in one] != []
        assert one.steps == other.steps


def test_a_merge_of_one_is_the_same_bytes(tmp_path):
    whole = written(tmp_path / "whole")
    merge([whole], tmp_path / "copy")
    assert files(whole) == files(tmp_path / "copy")


def test_another_version_is_not_merged(tmp_path):
    one, other = written(tmp_path / "one"), written(tmp_path / "other", layout=OTHER)
    with pytest.raises(LayoutError, match="other: made for another task or preset: layout version is 2 there"):
        merge([one, other], tmp_path / "both")
    assert not (tmp_path / "both").exists()


@pytest.mark.parametrize(
    ("one", "other", "sentence"),
    [
        ({"preset": "reach"}, {"preset": "park"}, "preset is park there and reach here"),
        ({"reward": ""}, {"reward": "progress"}, "reward is progress there and as the preset has it here"),
        ({"notes": {"number kept_m": "4"}}, {}, "number kept_m is the task's own there and 4 here"),
    ],
)
def test_what_was_recorded_with_other_settings_is_not_merged(tmp_path, one, other, sentence):
    one, other = written(tmp_path / "one", **one), written(tmp_path / "other", **other)
    with pytest.raises(DatasetError) as refused:
        merge([one, other], tmp_path / "both")
    assert str(refused.value) == f"{other}: recorded with other settings than {one}: {sentence}"
    assert not (tmp_path / "both").exists()


def test_conditions_may_differ_and_are_noted(tmp_path):
    one = written(tmp_path / "one", has_estimator=True, split="train", notes={"from": "here"})
    other = written(tmp_path / "other", (3,), has_estimator=False, split="train", notes={"by": "hand"})
    assert merge([one, other], tmp_path / "both") == 4
    with DatasetReader(tmp_path / "both") as reader:
        assert reader.origin.notes == {"from": "here", "by": "hand", "setting has_estimator": "True, False"}


def test_a_merged_set_that_is_merged_again_keeps_what_it_was_made_of(tmp_path):
    parts = [written(tmp_path / name, split=name) for name in ("train", "test", "validation")]
    merge(parts[:2], tmp_path / "two")
    merge([tmp_path / "two", parts[2]], tmp_path / "three")
    with DatasetReader(tmp_path / "three") as reader:
        assert reader.origin.notes == {"setting split": "train, test, validation"}


def test_a_filter_keeps_what_passes_and_refuses_to_keep_nothing(tmp_path):
    whole = written(tmp_path / "whole", range(5))
    assert keep(whole, tmp_path / "good", lambda each: each.is_success) == 3
    with pytest.raises(DatasetError, match="no episode passes"):
        keep(whole, tmp_path / "none", lambda _: False)
    assert not (tmp_path / "none").exists()


def test_a_split_that_leaves_a_part_empty_is_refused(tmp_path):
    whole = written(tmp_path / "whole")
    with pytest.raises(DatasetError, match="leaves one part without any"):
        split(whole, 0.01, 0, (tmp_path / "a", tmp_path / "b"))


def test_a_split_into_one_folder_is_refused_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = written(tmp_path / "whole")
    for twice in ((Path("part"), Path("part")), (Path("part"), tmp_path / "part")):
        with pytest.raises(DatasetError, match="part: a split makes two folders, and this one is named twice"):
            split(whole, 0.5, 0, twice)
    assert [path.name for path in tmp_path.iterdir()] == ["whole"]


def test_a_folder_that_is_no_dataset_is_refused(tmp_path):
    with pytest.raises(DatasetError, match="is no dataset"):
        DatasetReader(tmp_path)


def test_statistics_are_those_of_all_rows(tmp_path):
    whole = written(tmp_path / "whole")
    rows = np.concatenate([episode(5 + seed, seed).observations for seed in range(3)]).astype(np.float64)
    with DatasetReader(whole) as reader:
        found = statistics_of(reader)
    assert found.outcomes == {"success": 2, "timeout": 1}
    np.testing.assert_allclose(found.observations.mean, rows.mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(found.observations.std, rows.std(axis=0), atol=1e-9)
    assert found.observations.histogram.sum() == rows.size


def test_d4rl_has_all_steps_in_a_row(tmp_path):
    whole = written(tmp_path / "whole")
    assert export_d4rl(whole, tmp_path / "flat.hdf5") == 18
    with h5py.File(tmp_path / "flat.hdf5") as file:
        assert np.flatnonzero(file["terminals"][()] | file["timeouts"][()]).tolist() == [4, 10, 17]
        assert np.array_equal(file["observations"][:5], episode(5, 0).observations[:-1])
        assert np.array_equal(file["next_observations"][:5], episode(5, 0).observations[1:])


def test_collected_episodes_are_the_same_for_a_seed_and_worse_with_noise(tmp_path):
    def gathered(name, noise):
        task = build_task("RollerBall", 4)
        driver = NoisyDriver(build_expert("RollerBall"), noise, 1)
        with DatasetWriter(tmp_path / name, DatasetOrigin(task.layout, {}, "expert")) as writer:
            writer.add_all(collected(task, driver, 12, 1))
        return files(tmp_path / name), writer.steps

    one, steps = gathered("one", 0.0)
    again, _ = gathered("again", 0.0)
    _, noisy_steps = gathered("noisy", 1.0)
    assert one == again
    assert noisy_steps > steps
