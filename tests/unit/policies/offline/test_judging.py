"""Estimates from recorded decisions: weights and corrections computed by hand, a chain in closed form, the command."""

import json
import math

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from policies.offline.dataset_files import row_width
from policies.offline.evaluation.behavior_model import BehaviorModel
from policies.offline.evaluation.judge import Judge, JudgeSettings
from policies.offline.evaluation.weighted_returns import (
    PaddedEpisodes,
    doubly_robust,
    effective_sample_size,
    importance_weighted,
)
from policies.offline.fitted_q import FittedQ
from policies.offline.store import OfflineStore
from tests.unit.policies.offline.datasets import PUSHED, STEERED, store_of
from tests.unit.policies.offline.test_fitted_q import GAMMA, LAYOUT, always, store

# Two episodes of two decisions. Ratios 2, 3 and 1/2, 1: weights 2, 6 and 1/2, 1/2.
RATIOS = np.log([[2.0, 3.0], [0.5, 1.0]])
REWARDS = np.array([[1.0, 2.0], [3.0, 4.0]])
NONE = np.zeros((2, 2))


def test_weights_are_products_and_none_is_above_the_clip():
    episodes = PaddedEpisodes(RATIOS, REWARDS, NONE, NONE)
    np.testing.assert_allclose(episodes.weights(100.0), [[2.0, 6.0], [0.5, 0.5]])
    np.testing.assert_allclose(episodes.weights(3.0), [[2.0, 3.0], [0.5, 0.5]])


def test_importance_weighted_return_is_that_by_hand():
    found = importance_weighted(PaddedEpisodes(RATIOS, REWARDS, NONE, NONE), 0.5, 100.0)
    first = (2.0 * 1.0 + 0.5 * 3.0) / 2.5
    second = (6.0 * 2.0 + 0.5 * 4.0) / 6.5
    assert found.value == pytest.approx(first + 0.5 * second)
    assert found.low <= found.value <= found.high


def test_effective_episodes_are_those_by_hand():
    episodes = PaddedEpisodes(RATIOS, REWARDS, NONE, NONE)
    assert effective_sample_size(episodes) == pytest.approx(6.5**2 / (36.0 + 0.25))


def test_long_episodes_that_one_outweighs_are_worth_one_whatever_the_clip():
    episodes = PaddedEpisodes(np.full((3, 100), 0.5) + np.array([[0.0], [0.1], [0.3]]), np.zeros((3, 100)), NONE, NONE)
    assert len(np.unique(episodes.weights(1000.0)[:, -1])) == 1
    assert effective_sample_size(episodes) == pytest.approx(1.0, abs=1e-6)


def test_doubly_robust_return_is_that_by_hand():
    taken, values = np.array([[1.0, 1.0], [2.0, 3.0]]), np.array([[2.0, 1.0], [4.0, 5.0]])
    found = doubly_robust(PaddedEpisodes(RATIOS, REWARDS, taken, values), 0.5, 100.0)
    first = (2.0 * 0.0 + 0.5 * 1.0) / 2.5 + (2.0 + 4.0) / 2.0
    second = (6.0 * 1.0 + 0.5 * 1.0) / 6.5 + (2.0 * 1.0 + 0.5 * 5.0) / 2.5
    assert found.value == pytest.approx(first + 0.5 * second)


def test_with_true_values_weights_do_not_matter():
    """Where rewards are what was expected, the correction is nothing whatever the weights are."""
    values = np.array([[1.0 + 0.5 * 2.0, 2.0], [3.0 + 0.5 * 4.0, 4.0]])
    episodes = PaddedEpisodes(np.zeros((2, 2)), REWARDS, values, values)
    assert doubly_robust(episodes, 0.5, 100.0).value == pytest.approx((2.0 + 5.0) / 2.0)


def test_fitted_q_finds_the_value_of_a_chain():
    """Four places, each a step nearer to the end, which alone pays: gamma to the power of the steps before it."""
    rows = []
    for _ in range(20):
        for k in range(4):
            is_last = float(k == 3)
            rows.append([k / 3.0, 0.0, 0.0, is_last, is_last, is_last])
        rows.append([4.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    fitted = FittedQ(store_of(PUSHED, rows), _still(), 0.8, hidden=32)
    fitted.fit(1500)
    assert fitted.estimate().mean == pytest.approx(0.8**3, abs=0.03)


def _still():
    from policies.learn.config.network import NetworkSettings
    from policies.learn.networks.policy import Policy

    policy = Policy(PUSHED, NetworkSettings(hidden_units=8, num_layers=1), torch.Generator().manual_seed(0))
    with torch.no_grad():
        for parameter in policy.heads.mean.parameters():
            parameter.zero_()
    return policy


def test_the_behaviour_is_found():
    """Pushes are half of the first element, give or take 0.2."""
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(1500):
        seen = rng.uniform(-1, 1, 2)
        rows += [[*seen, 0.5 * seen[0] + rng.normal(0.0, 0.2), 0.0, 1.0, 1.0], [*seen, 0.0, 0.0, 0.0, 0.0]]
    model = BehaviorModel(store_of(PUSHED, rows), hidden=16, steps=600)
    mean, log_deviation = model(torch.tensor([[0.8, 0.0], [-0.8, 0.5]]))
    assert mean[:, 0].tolist() == pytest.approx([0.4, -0.4], abs=0.08)
    assert log_deviation.exp().mean().item() == pytest.approx(0.2, abs=0.05)


def _stepped(step, lengths, reward):
    """Episodes of steps give or take 0.05 from one place, whose last decision pays and ends them."""
    rng = np.random.default_rng(2)
    episodes = []
    for length in lengths:
        episode = np.zeros((length + 1, row_width(LAYOUT)), np.float32)
        episode[:-1, 1] = step + rng.normal(0.0, 0.05, length)
        episode[length - 1, 2:5] = reward, 1.0, 1.0
        episodes.append(episode)
    return episodes


def test_of_two_pilots_the_one_alike_counts_and_no_more_the_longer_it_flies():
    """One steps by 0.5, and pays after one or two decisions; the other by -0.5, for nothing: half pay at once."""
    lengths = (1, 2) * 20
    rows = np.concatenate([*_stepped(0.5, lengths, 1.0), *_stepped(-0.5, lengths, 0.0)])
    settings = JudgeSettings(0.8, width=0.05, steps=50, hidden=8)
    verdict = Judge(OfflineStore(LAYOUT, rows), settings, (40, 40)).judge(always(0.5))
    assert verdict.importance.value == pytest.approx(0.5 + 0.8 * 0.5, abs=0.05)
    assert 25.0 < verdict.effective_episodes < 41.0


def test_what_follows_a_recording_that_was_cut_counts():
    """Steps pay their size for ever, the recording ends after twenty: a third of what they return lies behind it."""
    judge = Judge(store(), JudgeSettings(0.95, width=0.3, steps=2500, hidden=32))
    assert judge.judge(always(0.5)).robust.value == pytest.approx(0.5 / (1.0 - 0.95), rel=0.2)


def test_a_policy_off_the_data_is_said_to_be():
    """Recorded steps lie in -0.3 to 0.3: 0.9 is outside everywhere, 0.1 nowhere."""
    table = store()
    table.rows[:, 1:3] *= 0.3
    judge = Judge(table, JudgeSettings(GAMMA, steps=100, hidden=8))
    near, far = judge.judge(always(0.1)), judge.judge(always(0.9))
    assert near.outside_fraction < 0.02
    assert far.outside_fraction > 0.98
    assert near.effective_episodes > 1.0
    assert math.isfinite(near.robust.value)


def test_choices_are_refused(choices):
    with pytest.raises(ValueError, match="Steered: only recordings of continuous actions"):
        Judge(choices, JudgeSettings(GAMMA))
    assert choices.layout is STEERED


def test_the_command_judges_and_writes(roller_ball, tmp_path):
    from mission.dataset.commands import app

    words = ["judge", roller_ball, "--policy", "roller-ball", "--steps", "20", "--json", str(tmp_path / "found.json")]
    ended = CliRunner().invoke(app, [*words, "--picture", str(tmp_path / "found.png")])
    assert ended.exit_code == 0, ended.output
    record = json.loads((tmp_path / "found.json").read_text())[0]
    assert record["policy"] == "roller-ball"
    assert record["fitted_q"]["low"] <= record["fitted_q"]["value"] <= record["fitted_q"]["high"]
    assert 0 < (tmp_path / "found.png").stat().st_size < 300_000


def test_an_unknown_policy_is_refused_in_a_sentence(roller_ball):
    from mission.dataset.commands import app

    ended = CliRunner().invoke(app, ["judge", roller_ball, "--policy", "nobody"])
    assert ended.exit_code == 2
    assert "nobody" in ended.output
