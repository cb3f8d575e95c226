"""Tasks changed by subclassing, without a kernel: elements, rewards and endings."""

import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.gym import TaskVectorEnv
from policies.tasks.hover.hover import Hover
from policies.tasks.layout import Element
from policies.tasks.roller_ball import RollerBall
from policies.tasks.task import TaskSettings
from policies.tasks.task_error import TaskError

EDGE_M = 4.5


class GentleBall(RollerBall):
    added = (Element("distance", "m"),)

    def observe(self, frames):
        return np.linalg.norm(frames[:, 0:3] - frames[:, 3:6], axis=1, keepdims=True)

    def outcome(self, decision):
        is_near_edge = np.abs(decision.next_observations[:, [3, 5]]).max(axis=1) > EDGE_M
        return np.where(is_near_edge, Outcome.HIT_WALL, decision.outcomes)

    def reward(self, decision):
        return np.where(decision.outcomes == Outcome.HIT_WALL, -1.0, decision.rewards - 0.01)


class Still(RollerBall):
    """Overrides, and changes nothing."""

    def outcome(self, decision):
        return decision.outcomes

    def reward(self, decision):
        return decision.rewards


def played(task, steps=200, seed=1):
    """Each step's arrays, under actions that depend on the row alone."""
    task.reset(seed)
    rng = np.random.default_rng(seed)
    names = ("observations", "final_observations", "rewards", "outcomes", "is_terminated", "is_truncated")
    for _ in range(steps):
        task.buffers.continuous.assign(rng.uniform(-1.0, 1.0, task.buffers.continuous.shape).astype(np.float32))
        task.step()
        yield {name: getattr(task.buffers, name).numpy().copy() for name in names}


def test_overriding_with_the_same_changes_nothing():
    one, other = RollerBall(TaskSettings(), 16), Still(TaskSettings(), 16)
    for here, there in zip(played(one), played(other), strict=True):
        assert all(here[name].tobytes() == there[name].tobytes() for name in here)
    assert one.take_scores() == other.take_scores()


@pytest.mark.parametrize("stack", [1, 3])
def test_added_elements_end_each_frame_and_are_true_of_it(stack):
    task = GentleBall(TaskSettings(stack=stack), 16)
    assert task.layout.frame[-1].name == "distance"
    assert task.layout.frame_size == 9
    ends = 0
    for arrays in played(task):
        is_over = arrays["outcomes"] != Outcome.RUNNING
        ends += is_over.sum()
        for frames in (arrays["observations"], arrays["final_observations"][is_over]):
            newest = frames[:, -9:]
            distance = np.linalg.norm(newest[:, 0:3] - newest[:, 3:6], axis=1)
            assert np.allclose(newest[:, 8], distance)
        if stack > 1:
            older = arrays["observations"].reshape(16, stack, 9)[:, :-1]
            held = older[older.any(axis=2)]
            assert np.allclose(held[:, 8], np.linalg.norm(held[:, 0:3] - held[:, 3:6], axis=1))
    assert ends > 16


def test_endings_of_its_own_keep_what_was_seen_last_and_begin_the_next():
    task = GentleBall(TaskSettings(), 32)
    hits = 0
    for arrays in played(task):
        is_hit = arrays["outcomes"] == Outcome.HIT_WALL
        hits += is_hit.sum()
        assert (np.abs(arrays["final_observations"][is_hit][:, [3, 5]]).max(axis=1) > EDGE_M).all()
        assert np.allclose(arrays["observations"][is_hit][:, [3, 5]], 0.0)  # placed anew
        assert arrays["is_terminated"][is_hit].all()
        assert (arrays["rewards"][is_hit] == -1.0).all()
        running = arrays["outcomes"] == Outcome.RUNNING
        assert np.allclose(arrays["rewards"][running], -0.01)
        assert not (arrays["outcomes"] == Outcome.FELL).any()  # it is stopped before
    assert hits > 10


def test_scores_are_those_of_the_changed_rewards_and_ends():
    task = GentleBall(TaskSettings(), 32)
    counts, paid, length = np.zeros(len(Outcome), dtype=int), 0.0, 0
    running_pay, running_steps = np.zeros(32), np.zeros(32, dtype=int)
    for arrays in played(task):
        running_pay += arrays["rewards"]
        running_steps += 1
        is_over = arrays["outcomes"] != Outcome.RUNNING
        counts += np.bincount(arrays["outcomes"][is_over], minlength=len(Outcome))
        paid += running_pay[is_over].sum()
        length += running_steps[is_over].sum()
        running_pay[is_over] = running_steps[is_over] = 0
    scores = task.take_scores()
    assert scores.outcomes == tuple(counts.tolist())
    assert scores.return_sum == pytest.approx(paid, abs=1e-3)
    assert scores.length_sum == length


def test_an_end_of_the_tasks_own_may_be_called_otherwise_but_not_be_undone():
    class Patient(RollerBall):
        def outcome(self, decision):
            late = decision.outcomes == Outcome.TIMEOUT
            return np.where(late, Outcome.SUCCESS, Outcome.RUNNING)

    task = Patient(TaskSettings(), 8)
    task.set_params({"step_limit": 5.0, "half_floor_m": 1.0})
    outcomes = np.concatenate([arrays["outcomes"] for arrays in played(task, 60)])
    terminated = np.concatenate([arrays["is_terminated"] for arrays in played(task, 60)])
    assert set(outcomes[terminated]) == {Outcome.SUCCESS, Outcome.FELL}
    assert not (outcomes == Outcome.TIMEOUT).any()


def test_what_is_flown_is_changed_in_the_same_way():
    class LowHover(Hover):
        added = (Element("height", "m"),)

        def observe(self, frames):
            return -frames[:, 2:3]

        def outcome(self, decision):
            return np.where(decision.observations[:, 15] > 0.0, Outcome.LOST, decision.outcomes)

    task = LowHover(task_settings("Hover", {"has_estimator": False}), 8)
    ends = sum((arrays["outcomes"] == Outcome.LOST).sum() for arrays in played(task, 40))
    assert ends > 0
    assert task.take_scores().count(Outcome.LOST) == ends


def test_images_of_endings_of_its_own_are_kept():
    class Short(FollowMe):
        def outcome(self, decision):
            return np.where(self.buffers.steps.numpy() >= 2, Outcome.TIMEOUT, decision.outcomes)

    task = Short(task_settings("FollowMe", {"image_size": 8, "has_estimator": False}), 2)
    task.reset(1)
    task.step()
    task.step()
    assert (task.buffers.outcomes.numpy() == Outcome.TIMEOUT).all()
    assert task.buffers.is_truncated.numpy().all()
    assert task.buffers.final_images.numpy().any(axis=(1, 2, 3)).all()
    assert task.buffers.final_privileged.numpy().any(axis=1).all()


def test_gymnasium_takes_the_class():
    observations, _ = TaskVectorEnv(GentleBall, 4).reset(seed=1)
    assert observations.shape == (4, 9)


def test_methods_that_return_something_else_are_told_so():
    class Wrong(RollerBall):
        def reward(self, decision):
            return decision.rewards.mean()

    class Wordless(RollerBall):
        added = (Element("distance", "m"),)

    task = Wrong(TaskSettings(), 3)
    task.reset(1)
    with pytest.raises(ValueError, match=r"reward: must return an array of shape \(3,\), not \(\)"):
        task.step()
    with pytest.raises(TaskError, match="Wordless: elements are added, but there is no method observe"):
        Wordless(TaskSettings(), 3).reset(1)
    assert build_task("RollerBall", 1).layout.frame_size == 8


@pytest.mark.parametrize(
    ("method", "returned", "says"),
    [
        ("reward", np.ones((3, 1)), r"reward: must return an array of shape \(3,\), not \(3, 1\)"),
        ("reward", np.array([0.0, np.nan, 0.0]), "reward: must return finite numbers"),
        ("reward", np.array([0.0, 1e300, 0.0]), "reward: must return finite numbers"),
        ("reward", np.array(["much", "little", "none"]), "reward: must return numbers, not <U6"),
        ("outcome", np.full(3, 42), "outcome: must return Outcome numbers, 0 to 8, not 42"),
        ("outcome", np.full(3, -1), "outcome: must return Outcome numbers, 0 to 8, not -1"),
        ("outcome", np.full(3, 0.5), r"outcome: must return Outcome numbers, 0 to 8, not 0\.5"),
        ("outcome", np.full(3, np.nan), "outcome: must return Outcome numbers, 0 to 8, not nan"),
        ("outcome", np.array(["fell"] * 3), "outcome: must return numbers, not <U4"),
        ("observe", np.full((3, 1), np.nan), "observe: must return finite numbers"),
        ("observe", np.zeros(3), r"observe: must return an array of shape \(3, 1\), not \(3,\)"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow encountered in cast:RuntimeWarning")
def test_values_that_nothing_can_be_learnt_from_are_refused(method, returned, says):
    added = {"added": GentleBall.added} if method == "observe" else {}
    task = type("Wrong", (RollerBall,), {method: lambda _self, _given: returned, **added})(TaskSettings(), 3)
    with pytest.raises(TaskError, match=says):
        task.reset(1)
        task.step()
