"""Logged decisions become episodes: cut at gaps and ends, judged by the task's functions, actions that were flown."""

import numpy as np
import pytest
import warp as wp

from policies.companion.tracked_recorder import RECORD_LAYOUT
from policies.datasets.decisions import DecisionRows, TruthRows, episodes_of, runs_of, stacked
from policies.datasets.episodes import DatasetError
from policies.datasets.follow_me import FollowMeJudge, command_rows_of, quats
from policies.datasets.follow_me_rows import action_rows
from policies.datasets.goal_tasks import DriveJudge, NavigateJudge
from policies.datasets.hover import HoverBuilder, HoverLog
from policies.datasets.judges import judge_of
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.follow_me.tracked.vector import next_command_rows


def task_of(name, *pairs):
    return build_task(name, 1, settings_of(name, pairs))


def decisions(layout, n=12, *, goal=(20.0, 0.0, -2.0), speed=2.0, **columns):
    """A vehicle that goes north at a speed, decided on each 0.1 s."""
    time_us = 100_000 * np.arange(1, n + 1, dtype=np.uint64)
    pos = np.zeros((n, 3), np.float32)
    pos[:, 0], pos[:, 2] = 0.1 * speed * np.arange(n), -2.0
    width = len(layout.continuous)
    made = {
        "time_us": time_us,
        "frame": np.zeros((n, layout.frame_size), np.float32),
        "action": np.full((n, width), np.nan, np.float32),
        "flown": np.tile(np.array([speed, 0.0, 0.0, 0.0], np.float32), (n, 1)),
        "pos_ned": pos,
        "vel_ned": np.tile(np.array([speed, 0.0, 0.0], np.float32), (n, 1)),
        "goal": np.tile(np.array(goal, np.float32), (n, 1)),
        "yaw": np.zeros(n, np.float32),
        "i_image": np.full(n, -1),
        "is_flying": np.ones(n, np.uint8),
        "is_first": np.zeros(n, np.uint8),
        "is_struck": np.zeros(n, np.bool_),
    }
    made |= columns
    return DecisionRows("run/flight.ulg", layout, "somebody", **({"seen": made["frame"]} | made))


@pytest.fixture(scope="module")
def navigate():
    return NavigateJudge(task_of("Navigate"))


def test_a_gap_cuts_an_episode_and_is_reported():
    rows = decisions(RECORD_LAYOUT)
    rows.time_us[6:] += 900_000
    found = runs_of(rows, has_others=False)
    assert [(each.start, each.stop) for each in found.slices] == [(0, 6), (6, 12)]
    assert found.gaps == ((pytest.approx(0.6), pytest.approx(1.0)),)


@pytest.mark.parametrize(("task", "judge"), [("Navigate", NavigateJudge), ("Drive", DriveJudge)])
@pytest.mark.parametrize("at", [6, 11])  # the last: it was struck after it
def test_a_blow_ends_an_episode_as_a_collision_and_is_paid_for(task, judge, at):
    made, struck = judge(task_of(task)), np.zeros(12, np.bool_)
    struck[at] = True
    (unharmed,) = episodes_of(decisions(made.layout), made, None)
    (episode,) = episodes_of(decisions(made.layout, is_struck=struck), made, None)
    steps = min(at + 1, 11)
    assert (episode.outcome, episode.is_terminated, len(episode)) == ("hit_obstacle", True, steps)
    assert episode.rewards[:-1] == pytest.approx(unharmed.rewards[: steps - 1])
    assert episode.rewards[-1] < unharmed.rewards[steps - 1] - 4.0  # the task's cost of a collision


def test_what_another_flew_counts_only_if_it_is_asked_for(navigate):
    rows = decisions(navigate.layout, is_flying=np.array([0] * 5 + [1] * 7, np.uint8))
    assert [len(each) for each in episodes_of(rows, navigate, None)] == [6]
    both = list(episodes_of(rows, navigate, None, has_others=True))
    assert [(len(each), each.context["pilot"]) for each in both] == [(4, "other"), (6, "somebody")]


def test_a_log_without_two_decisions_in_a_row_is_refused(navigate):
    rows = decisions(navigate.layout, 1)
    with pytest.raises(DatasetError, match=r"run/flight.ulg: policy_decision holds no two decisions in a row"):
        list(episodes_of(rows, navigate, None))


def test_frames_are_stacked_as_an_episode_begins_with_zeros():
    frames = np.arange(1.0, 4.0, dtype=np.float32)[:, None]
    assert stacked(frames, 3).tolist() == [[0, 0, 1], [0, 1, 2], [1, 2, 3]]


def test_an_action_leads_to_what_was_flown():
    """Whatever the last command, the action's own kernel function leads from it to the next."""
    rng = np.random.default_rng(2)
    n = 500
    last = rng.uniform(-1.5, 1.5, (n, 4)).astype(np.float32)
    yaw = rng.uniform(-3.0, 3.0, n).astype(np.float32)
    flown = last + rng.uniform(-0.2, 0.2, (n, 4)).astype(np.float32)
    q, out = wp.array(quats(yaw), dtype=wp.quat), wp.zeros(n, dtype=wp.vec4)
    before, after = (wp.array(command_rows_of(rows), dtype=Command) for rows in (last, flown))
    asked = wp.array(np.full((n, 4), np.nan, np.float32), dtype=wp.vec4)
    wp.launch(action_rows, n, [asked, q, before, after, out])
    is_within = (abs(out.numpy()) < 1.0).all(axis=1)
    assert is_within.mean() > 0.8
    own = wp.zeros(n, dtype=OwnState)
    own.numpy()["q_ned_from_frd"] = quats(yaw)
    wp.launch(next_command_rows, n, [out, own, before])
    led = before.numpy()
    assert np.allclose(led["vel_ned"][is_within], flown[is_within, :3], atol=2e-4)
    assert np.allclose(led["yaw_rate"][is_within], flown[is_within, 3], atol=2e-4)


def test_navigate_pays_the_way_and_ends_at_the_goal(navigate):
    rows = decisions(navigate.layout, 80, speed=4.0)  # 17 m to its radius: 43 steps; room all round
    episode = next(iter(episodes_of(rows, navigate, None)))
    assert episode.outcome == "success"
    assert episode.is_terminated
    assert len(episode) == 43
    assert episode.rewards[-1] > episode.rewards[:-1].max()
    assert np.allclose(episode.actions[:, 0], 4.0 / 7.0)


def stays(judge, n, **columns):
    """Navigate's vehicle goes north at 4 m/s from 20 m before its goal, and from 3 m before it rests there."""
    rows = decisions(judge.layout, n, speed=4.0, **columns)
    rows.pos_ned[43:, 0] = rows.pos_ned[43, 0]
    return rows


def test_what_stays_at_its_goal_begins_no_episode_there(navigate):
    (episode,) = episodes_of(stays(navigate, 200), navigate, None)
    assert (episode.outcome, len(episode)) == ("success", 43)
    jittering = stays(navigate, 200)
    jittering.pos_ned[60::2, 0] -= 1.0  # out of the radius and in again
    assert [len(each) for each in episodes_of(jittering, navigate, None)] == [43]
    interrupted = stays(navigate, 200)
    interrupted.time_us[100:] += 900_000  # decisions are missing: it stands there still
    assert [len(each) for each in episodes_of(interrupted, navigate, None)] == [43]


def test_another_goal_begins_an_episode(navigate):
    rows = stays(navigate, 200)
    rows.goal[120:, 0] = 60.0
    first, second = episodes_of(rows, navigate, None)
    assert (first.outcome, len(first)) == ("success", 43)
    assert (second.outcome, len(second), second.context["start_us"]) == ("timeout", 79, rows.time_us[120])


def test_what_is_sent_to_where_it_stands_is_there_in_one_step(navigate):
    rows = stays(navigate, 200)
    rows.is_first[120] = 1
    assert [(each.outcome, len(each)) for each in episodes_of(rows, navigate, None)] == [
        ("success", 43),
        ("success", 1),
    ]


def test_what_keeps_up_with_a_goal_that_walks_begins_an_episode_when_it_falls_behind(navigate):
    rows = decisions(navigate.layout, 100, speed=2.0)
    rows.goal[:, 0] = rows.pos_ned[:, 0] + 1.0
    rows.goal[60:, 0] += 10.0
    first, second = episodes_of(rows, navigate, None)
    assert (first.outcome, len(first)) == ("success", 1)
    assert (second.outcome, second.context["start_us"]) == ("timeout", rows.time_us[60])


def test_what_a_rover_ignores_of_an_action_stays_as_it_was_asked():
    judge = NavigateJudge(task_of("NavigateRover"))
    asked = np.tile(np.array([2.0 / 7.0, 0.0, 0.3, -0.4], np.float32), (12, 1))
    level = np.tile(np.array([2.0, 0.0, 0.0, np.nan], np.float32), (12, 1))
    assert np.array_equal(judge.actions(decisions(judge.layout, action=asked, flown=level)), asked)
    slower = judge.actions(decisions(judge.layout, action=asked, flown=0.5 * level))
    assert np.allclose(slower, asked * (0.5, 1.0, 1.0, 1.0))


def test_navigate_without_a_goal_is_refused(navigate):
    rows = decisions(navigate.layout, goal=(np.nan, 0.0, 0.0))
    with pytest.raises(DatasetError, match="decisions without a goal"):
        list(episodes_of(rows, navigate, None))


def test_the_truth_judges_and_is_in_no_observation(navigate):
    rows = decisions(navigate.layout)
    rows.frame[:, [each.name for each in navigate.layout.frame].index("height")] = 2.0 / 5.0
    still = TruthRows(0.0 * rows.pos_ned, 0.0 * rows.vel_ned, quats(rows.yaw), np.full(12, 2.0), np.zeros(12, int))
    (by_truth,), (by_estimate,) = (list(episodes_of(rows, navigate, truth)) for truth in (still, None))
    assert (by_truth.rewards < by_estimate.rewards).all()  # it truly stood
    assert np.array_equal(by_truth.observations, by_estimate.observations)


def test_drive_ends_standing_in_its_pose():
    judge = DriveJudge(task_of("Drive"))
    n = 20
    rows = decisions(judge.layout, n, goal=(0.0, 0.0, 0.0), speed=0.0)
    rows.pos_ned[:, 2] = 0.0
    (episode,) = episodes_of(rows, judge, None)
    assert (episode.outcome, len(episode)) == ("success", 1)
    rows = decisions(judge.layout, n, goal=(50.0, 0.0, 0.0), speed=1.0)
    (episode,) = episodes_of(rows, judge, None)
    assert (episode.outcome, len(episode)) == ("timeout", n - 1)
    assert np.allclose(episode.actions[:, 0], 0.5)
    assert not episode.is_terminated


def test_a_follower_that_loses_its_owner_ends():
    judge = FollowMeJudge(task_of("FollowMe", "observation=tracked"))
    names = [element.name for element in judge.layout.frame]
    rows = decisions(judge.layout, 200)
    rows.frame[:20, names.index("is_owner_seen")] = 1.0
    rows.frame[:, names.index("seen_distance")] = 2.0 / 3.0
    rows.frame[:, names.index("seen_owner_pos_hfrd_x")] = 2.0 / 3.0
    episode = next(iter(episodes_of(rows, judge, None)))
    assert episode.outcome == "lost"
    assert episode.rewards[:18].min() > episode.rewards[-1]


@pytest.mark.parametrize("pairs", [("observation=tracked",), ("observation=camera",)])
def test_a_follower_that_struck_something_collided(pairs):
    judge = judge_of(task_of("FollowMe", *pairs))
    names = [element.name for element in RECORD_LAYOUT.frame]
    struck = np.zeros(12, np.bool_)
    struck[6] = True
    rows = decisions(RECORD_LAYOUT, is_struck=struck)
    for name, value in {"is_owner_seen": 1.0, "seen_distance": 2.0 / 3.0, "seen_owner_pos_hfrd_x": 2.0 / 3.0}.items():
        rows.frame[:, names.index(name)] = value
    episode = next(iter(episodes_of(rows, judge, None)))
    assert (episode.outcome, episode.is_terminated, len(episode)) == ("hit_obstacle", True, 7)
    assert episode.rewards[-1] < episode.rewards[:-1].min() - 1.0


def test_actions_of_who_looks_at_images_ask_for_what_was_flown():
    judge = judge_of(task_of("FollowMe", "observation=camera"))
    asked = np.full((12, 4), np.nan, np.float32)
    asked[:6] = 2.0 / 7.0, 0.0, 0.0, 0.0  # of 7 m/s: it flies at 2
    asked[6:9] = 1.0, 0.0, 0.0, 0.0  # what a guard did not let pass; the rest another flew
    actions = judge.actions(decisions(RECORD_LAYOUT, action=asked))
    assert np.array_equal(actions[:6], asked[:6])
    assert np.allclose(actions, [2.0 / 7.0, 0.0, 0.0, 0.0])


def test_hover_is_paid_for_staying():
    n = 300
    none = np.zeros((n, 3))
    away = none + np.array([1.0, 0.0, 0.0])
    log = HoverLog(
        "run/flight.ulg",
        20_000 * np.arange(n),
        pos_ned=none,
        vel_ned=none,
        q_ned_from_frd=np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)),
        omega_frd=none,
        pos_ned_sp=away,
        omega_frd_sp=none + np.array([1.5, 0.0, 0.0]),
        thrust=np.full(n, 0.75),
        is_airborne=np.arange(n) < 250,
        is_fresh=np.ones(n, bool),
    )
    (episode,) = HoverBuilder(task_of("Hover")).episodes(log)
    assert len(episode) == 249
    assert np.allclose(episode.observations[:, 0], 1.0)
    assert np.allclose(episode.actions, [0.5, 0.0, 0.0, 0.5])
    assert np.allclose(episode.observations[1:, -4:], episode.actions[0])
    assert np.allclose(episode.rewards, 1.0 - 1.0 / 3.0)
