"""Demonstrations: whole episodes of an expert, as a Minari dataset that is there whole or not at all."""

import json

import gymnasium
import numpy as np
import pytest
from minari import MinariDataset

from policies.experts.catalogue import NoExpert, build_expert
from policies.experts.demonstration_file import (
    LAYOUT_KEY,
    SETTINGS_KEY,
    DemonstrationFileError,
    Origin,
    write_demonstrations,
)
from policies.experts.episode_recording import RecordingError, record_episodes
from policies.experts.expert import RandomDriver
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.layout import Layout


def recorded(count=7, rows=3, seed=5, **options):
    task = build_task("RollerBall", rows)
    return task, record_episodes(task, build_expert("RollerBall"), count, seed, **options)


def test_expert_of_roller_ball_reaches_the_cube_nearly_always():
    task = build_task("RollerBall", 256)
    task.reset(1)
    expert = build_expert("RollerBall")
    for _ in range(100):
        expert.act(task)
        task.step()
    scores = task.take_scores()
    assert scores.episode_count > 1000
    assert scores.count(Outcome.SUCCESS) > 0.99 * scores.episode_count


def test_recorded_actions_lead_from_observation_to_observation():
    task, episodes = recorded(count=1, rows=1)
    (episode,) = episodes
    task.reset(5)
    for k, action in enumerate(episode.continuous):
        np.testing.assert_array_equal(task.buffers.observations.numpy()[0], episode.observations[k])
        task.buffers.continuous.assign(action[None])
        task.step()
        assert task.buffers.rewards.numpy()[0] == episode.rewards[k]
    np.testing.assert_array_equal(task.buffers.final_observations.numpy()[0], episode.observations[-1])
    assert episode.outcome is Outcome.SUCCESS


def test_every_row_gives_its_share():
    _, episodes = recorded(count=7, rows=3)
    firsts = [tuple(episode.observations[0]) for episode in episodes]
    assert len(episodes) == len(set(firsts)) == 7


def test_same_seed_records_the_same_episodes():
    _, first = recorded()
    _, again = recorded()
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.observations, b.observations)
        np.testing.assert_array_equal(a.continuous, b.continuous)


def test_driver_that_never_succeeds_is_given_up():
    task = build_task("RollerBall", 8)
    task.set_params({"reach_m": 0.1, "half_floor_m": 1.0})
    with pytest.raises(RecordingError, match=r"RollerBall: only 0 of \d+ episodes succeeded"):
        record_episodes(task, RandomDriver(), 8, seed=0)


def test_failures_are_kept_on_request():
    task = build_task("RollerBall", 8)
    task.set_params({"step_limit": 3.0})
    episodes = record_episodes(task, RandomDriver(), 8, seed=0, has_failures=True)
    assert {episode.outcome for episode in episodes} & {Outcome.TIMEOUT}


def test_minari_reads_what_was_written(tmp_path):
    task, episodes = recorded()
    settings = task_settings("RollerBall", {})
    write_demonstrations(tmp_path / "demo", Origin(task.layout, settings, "scripted", 5), episodes)
    assert [path.name for path in tmp_path.iterdir()] == ["demo"]
    dataset = MinariDataset(tmp_path / "demo")
    assert dataset.total_episodes == 7
    assert dataset.total_steps == sum(len(episode.rewards) for episode in episodes)
    for written, episode in zip(dataset.iterate_episodes(), episodes, strict=True):
        np.testing.assert_array_equal(written.observations, episode.observations)
        np.testing.assert_array_equal(written.actions, episode.continuous)
        assert written.terminations[-1]
        assert not written.truncations.any()
        assert dataset.observation_space.contains(written.observations[0])
        assert dataset.action_space.contains(written.actions[0])
    metadata = dataset.storage.metadata
    assert Layout.from_record(json.loads(metadata[LAYOUT_KEY])) == task.layout
    assert json.loads(metadata[SETTINGS_KEY]) == settings.model_dump()
    assert all(row["success"] for row in dataset.storage.get_episode_metadata(range(7)))
    assert dataset.recover_environment().unwrapped.task.layout == task.layout


def test_recording_changes_nothing_of_what_gymnasium_has_registered(tmp_path):
    task, episodes = recorded()
    write_demonstrations(
        tmp_path / "demo", Origin(task.layout, task_settings("RollerBall", {}), "scripted", 5), episodes
    )
    assert gymnasium.spec("honeyguide/RollerBall-v0").kwargs == {"task": "RollerBall"}


def test_demonstrations_are_read_as_they_were_written(tmp_path):
    from policies.learn.rollout.demonstrations import load_demonstrations

    task = build_task("Parking2", 2, task_settings("Parking2", {}))
    episodes = record_episodes(task, build_expert("Parking2"), 2, seed=0)
    write_demonstrations(tmp_path / "demo", Origin(task.layout, task_settings("Parking2", {}), "scripted", 0), episodes)
    read = load_demonstrations(str(tmp_path / "demo"), task.layout)
    written = np.concatenate([episode.branches for episode in episodes])
    np.testing.assert_array_equal(read.branches.numpy(), written)
    np.testing.assert_array_equal(read.observations.numpy()[0], episodes[0].observations[0])


def test_gymnasium_collects_the_pictures_of_an_episode():
    env = gymnasium.wrappers.RenderCollection(gymnasium.make("honeyguide/Parking1-v0", render_mode="rgb_array"))
    env.reset(seed=1)
    for _ in range(3):
        env.step(env.action_space.sample())
    images = env.render()
    assert len(images) == 4
    assert all(image.shape == images[0].shape and image.dtype == np.uint8 for image in images)


def test_existing_folder_is_left_alone(tmp_path):
    (tmp_path / "demo").mkdir()
    task, episodes = recorded(count=1, rows=1)
    with pytest.raises(DemonstrationFileError, match="demo: there is something of that name already"):
        write_demonstrations(tmp_path / "demo", Origin(task.layout, task_settings("RollerBall", {}), "", 0), episodes)
    assert list((tmp_path / "demo").iterdir()) == []


def test_task_without_an_expert_is_named():
    with pytest.raises(NoExpert, match="Navigate: no scripted expert"):
        build_expert("Navigate")
