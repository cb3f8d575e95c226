"""A model of dynamics learnt from decisions, and the task that it is."""

import numpy as np
import pytest
import torch

from policies.offline.dynamics.model_file import ModelError, fit_model, load_model, save_model
from policies.tasks.catalogue import UnknownTask, build_task, is_task_name, runs_code
from policies.tasks.episode import Outcome
from tests.unit.policies.offline.datasets import PUSHED, store_of


def pushed_store():
    """Speed grows by a tenth of the push, the place by a tenth of the speed; each decision pays minus the place."""
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(60):
        place, speed = rng.uniform(-0.5, 0.5, 2)
        for k in range(20):
            push = rng.uniform(-1, 1)
            rows.append([place, speed, push, -place, 0.0, float(k == 19)])
            place, speed = place + 0.1 * speed, speed + 0.1 * push
        rows.append([place, speed, 0.0, 0.0, 0.0, 0.0])
    return store_of(PUSHED, rows)


@pytest.fixture(scope="module")
def model_path(tmp_path_factory):
    torch.set_num_threads(1)
    path = tmp_path_factory.mktemp("model") / "pushed.pt"
    save_model(fit_model(pushed_store(), steps=1500, hidden=32), path)
    return path


def test_the_model_says_what_comes(model_path):
    model = load_model(model_path)
    seen, push = torch.tensor([[0.2, 0.4], [-0.1, -0.3]]), torch.tensor([[0.5], [-1.0]])
    with torch.no_grad():
        found = model.networks.predict(seen, push).mean.mean(0)
    change = found * model.networks.scales["target_deviation"] + model.networks.scales["target_mean"]
    expected = torch.tensor([[0.04, 0.05, -0.2], [-0.03, -0.1, 0.1]])
    assert torch.allclose(change, expected, atol=0.02)


def test_episodes_in_the_model_begin_where_recorded_ones_did_and_end(model_path):
    task = build_task(f"model:{model_path}", 8)
    task.reset(3)
    first = task.buffers.observations.numpy().copy()
    starts = load_model(model_path).starts.numpy()
    assert all((np.abs(starts - row).max(1) < 1e-6).any() for row in first)
    for _ in range(20):
        task.step()
    assert (task.buffers.outcomes.numpy() == Outcome.TIMEOUT).any()
    assert task.take_scores().episode_count >= 1


def test_the_same_seed_gives_the_same_episodes(model_path):
    shown = []
    for _ in range(2):
        task = build_task(f"model:{model_path}", 4)
        task.reset(5)
        task.step()
        task.step()
        shown.append(task.buffers.observations.numpy().copy())
    np.testing.assert_array_equal(*shown)


def test_far_from_the_data_the_members_disagree_and_the_episode_ends(model_path):
    task = build_task(f"model:{model_path}", 4)
    task.reset(1)
    task.buffers.observations.fill_(4.0)
    task.step()
    assert (task.buffers.outcomes.numpy() == Outcome.LOST).all()
    assert (task.buffers.rewards.numpy() < 0.0).all()


def test_what_is_no_model_is_refused(tmp_path):
    with pytest.raises(UnknownTask, match="no such file"):
        build_task(f"model:{tmp_path / 'none.pt'}", 1)
    path = tmp_path / "text.pt"
    path.write_text("text")
    with pytest.raises(UnknownTask, match="is no model"):
        build_task(f"model:{path}", 1)


def test_models_of_choices_are_refused(choices):
    with pytest.raises(ModelError, match="continuous actions"):
        fit_model(choices, steps=1)


def test_the_name_of_a_model_is_a_tasks_and_runs_no_code(model_path):
    assert is_task_name(f"model:{model_path}")
    assert not runs_code(f"model:{model_path}")
