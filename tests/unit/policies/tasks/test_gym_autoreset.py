"""Vector environments that begin episodes by themselves, held against Gymnasium's single ones."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.classic_control.cartpole import CartPoleVectorEnv
from gymnasium.spaces import Box, Dict, Discrete
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from policies.experts.episode_recording import Recorder
from policies.tasks.catalogue import UnknownTask, build_task, settings_of
from policies.tasks.episode import Outcome
from policies.tasks.gym import TaskVectorEnv
from policies.tasks.gym_task import GymTask

ENVS = 4


MODES = {"Several": AutoresetMode.NEXT_STEP, "SameStep": AutoresetMode.SAME_STEP}


def several(env_id, mode):
    """A vector entry point: Gymnasium's own batch of single environments."""
    return lambda num_envs, **settings: SyncVectorEnv(
        [lambda: gymnasium.make(env_id, **settings)] * num_envs, autoreset_mode=mode
    )


@pytest.fixture(autouse=True)
def registered():
    names = [(kind, env_id) for kind in MODES for env_id in ("CartPole-v1", "Pendulum-v1")]
    for kind, env_id in names:
        gymnasium.register(f"{kind}{env_id}", vector_entry_point=several(env_id, MODES[kind]))
    yield
    for kind, env_id in names:
        gymnasium.registry.pop(f"{kind}{env_id}")


def lean(task):
    """Pushes the cart to where the pole leans, the pendulum by its sine; some pushes are wrong: episodes differ."""
    seen = task.buffers.observations.numpy()[:, -task.layout.frame_size :]
    if task.layout.branches:
        task.buffers.branches.assign(((seen[:, 2:3] > 0) ^ (seen[:, :1] > 0.02)).astype(np.int32))
    else:
        task.buffers.continuous.assign(seen[:, 1:2].astype(np.float32))


def episodes_of(task, count):
    """So many episodes of each row."""
    found, recorder = [[] for _ in range(task.env_count)], Recorder(task)
    task.reset(7)
    while min(map(len, found)) < count:
        lean(task)
        recorder.note()
        task.step()
        for i, episode in recorder.ended():
            found[i].append(episode)
    return [row[:count] for row in found]


@pytest.mark.parametrize("kind", MODES)
@pytest.mark.parametrize(("env_id", "stack"), [("CartPole-v1", 0), ("CartPole-v1", 3), ("Pendulum-v1", 0)])
def test_episodes_are_those_of_environments_that_are_reset(env_id, stack, kind):
    """Each decision of each row, bit for bit: nothing of the steps in between is in them."""
    names = (f"gym:{env_id}", f"gym:{kind}{env_id}")
    single, several = (build_task(name, ENVS, settings_of(name, [f"stack={stack}"])) for name in names)
    assert single.is_skipped is None
    for own, theirs in zip(episodes_of(several, 4), episodes_of(single, 4), strict=True):
        for a, b in zip(own, theirs, strict=True):
            assert np.array_equal(a.observations, b.observations)
            assert np.array_equal(a.rewards, b.rewards)
            assert np.array_equal(a.branches, b.branches)
            assert (a.outcome, a.is_truncated) == (b.outcome, b.is_truncated)


def test_returns_and_lengths_are_those_of_gymnasiums_vector_environment():
    """CartPole's own vector environment, stepped with the same actions: 400 steps of it, and what they came to."""
    name = "gym:CartPole-v1"
    task = build_task(name, ENVS, settings_of(name, ["vectorization=vector_entry_point", "max_episode_steps=25"]))
    theirs = CartPoleVectorEnv(ENVS, max_episode_steps=25)
    assert isinstance(task.envs, CartPoleVectorEnv)
    task.reset(3)
    theirs.reset(seed=3)
    was_over, reward_sum, decisions, ends, truncations = np.zeros(ENVS, dtype=bool), 0.0, 0, 0, 0
    for _ in range(400):
        lean(task)
        seen, rewards, is_terminated, is_truncated, _ = theirs.step(task.buffers.branches.numpy()[:, 0].astype(int))
        task.step()
        assert np.array_equal(task.is_skipped, was_over)
        assert np.array_equal(task.buffers.observations.numpy(), seen)
        assert np.array_equal(task.buffers.rewards.numpy(), rewards)
        assert np.array_equal(task.buffers.is_terminated.numpy(), is_terminated)
        assert np.array_equal(task.buffers.is_truncated.numpy(), is_truncated & ~is_terminated)
        decisions += int((~was_over).sum())
        was_over = is_terminated | is_truncated
        assert np.array_equal(task.buffers.final_observations.numpy()[was_over], seen[was_over])
        reward_sum += rewards.sum()
        ends, truncations = ends + int(was_over.sum()), truncations + int((is_truncated & ~is_terminated).sum())
    scores, buffers = task.take_scores(), task.buffers
    assert (scores.episode_count, scores.count(Outcome.TIMEOUT)) == (ends, truncations)
    assert ends > truncations > 0
    assert scores.length_sum + buffers.steps.numpy().sum() == decisions
    assert scores.return_sum + buffers.returns.numpy().sum() == reward_sum == decisions


@pytest.mark.parametrize("kind", MODES)
def test_an_episode_that_the_task_ends_waits_for_the_environments_own_end(kind):
    class Tilted(GymTask):
        env_id = f"{kind}CartPole-v1"

        def outcome(self, decision):
            return np.where(np.abs(decision.next_observations[:, 2]) > 0.1, Outcome.FELL, decision.outcomes)

        def reward(self, decision):
            return np.full(len(decision.rewards), 2.0)

    task = build_task(Tilted, ENVS)
    for row in episodes_of(task, 3):
        for episode in row:
            angles = np.abs(episode.observations[:, 2])
            assert episode.outcome is Outcome.FELL
            assert angles[-1] > 0.1 >= angles[:-1].max()
            assert angles[0] < 0.05
            assert (episode.rewards == 2.0).all()
    scores = task.take_scores()
    assert scores.return_sum == 2.0 * scores.length_sum


@pytest.mark.parametrize("kind", MODES)
def test_rows_that_all_wait_are_reset_together(kind):
    task = build_task(f"gym:{kind}CartPole-v1", 2)
    task.reset(1)
    lean(task)
    task.step()
    for i in range(2):
        assert task.buffers.episodes.numpy().tolist() == [1, 1]
        task.begin(np.arange(2) == i)
    assert task.buffers.episodes.numpy().tolist() == [2, 2]
    task.step()
    assert not task.is_skipped.any()
    assert task.buffers.steps.numpy().tolist() == [1, 1]


def test_the_seed_is_what_the_episodes_depend_on():
    starts = []
    for seed in (5, 5, 6):
        task = build_task("gym:CartPole-v1", 3, settings_of("gym:CartPole-v1", ["vectorization=vector_entry_point"]))
        task.reset(seed)
        starts.append(task.buffers.observations.numpy().copy())
    assert np.array_equal(starts[0], starts[1])
    assert not np.array_equal(starts[0], starts[2])


def test_what_begins_by_itself_is_no_environment_of_ours():
    with pytest.raises(UnknownTask, match=r"gym:SeveralCartPole-v1: begins episodes by itself: take it from gym"):
        TaskVectorEnv("gym:SeveralCartPole-v1", 2)


@pytest.fixture
def batch():
    gymnasium.register("Batch-v0", vector_entry_point="policies.tasks.gym:TaskVectorEnv", kwargs={"task": "RollerBall"})
    yield "gym:Batch-v0"
    gymnasium.registry.pop("Batch-v0")


def test_a_batch_of_ours_that_begins_episodes_in_the_same_step_is_the_task_itself(batch):
    """What each episode saw last too, which `final_obs` tells as a batch."""
    task, own = build_task(batch, 8), build_task("RollerBall", 8)
    assert task.envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    task.reset(1)
    own.load_state(task.envs.task.state())
    rng, ends = np.random.default_rng(2), 0
    for _ in range(200):
        actions = rng.uniform(-1.0, 1.0, (8, 2)).astype(np.float32)
        for each in (task, own):
            each.buffers.continuous.assign(actions)
            each.step()
        for name in ("observations", "rewards", "final_observations", "is_terminated", "is_truncated", "steps"):
            theirs = getattr(own.buffers, name).numpy()
            assert np.allclose(getattr(task.buffers, name).numpy(), theirs, atol=1e-4), name  # actions are rounded
        ends += int((own.buffers.outcomes.numpy() != Outcome.RUNNING).sum())
    assert task.take_scores().episode_count == ends > 3


class Door(gymnasium.Env):
    """Ends after three decisions, now with success, now without; what is seen are a place and a picture."""

    observation_space = Dict({"at": Box(-9, 9, (2,)), "picture": Box(0, 255, (12, 10, 3), np.uint8)})
    action_space = Discrete(2)
    episodes = 0

    def _seen(self):
        return {"at": np.full(2, self.at, np.float32), "picture": np.full((12, 10, 3), self.at, np.uint8)}

    def reset(self, *, seed=None, options=None):  # noqa: ARG002  (as Gymnasium calls it)
        super().reset(seed=seed)
        self.at, self.episodes = 0, self.episodes + 1
        return self._seen(), {}

    def step(self, action):  # noqa: ARG002
        self.at += 1
        return self._seen(), 1.0, self.at == 3, False, {"is_success": self.at == 3 and self.episodes == 2}


def test_dicts_pictures_and_success_of_the_same_step_are_understood():
    gymnasium.register(
        "Doors-v0",
        vector_entry_point=lambda num_envs: SyncVectorEnv([Door] * num_envs, autoreset_mode=AutoresetMode.SAME_STEP),
    )
    try:
        task = build_task("gym:Doors-v0", 2)
        task.reset(1)
        outcomes = []
        for _ in range(6):
            task.step()
            outcomes.append(Outcome(int(task.buffers.outcomes.numpy()[0])))
        running = [Outcome.RUNNING] * 2
        assert outcomes == [*running, Outcome.ENDED, *running, Outcome.SUCCESS]
        assert (task.buffers.final_observations.numpy() == 3.0).all()
        assert (task.buffers.final_images.numpy() == 3).all()
        assert not task.buffers.images.numpy().any()
        assert task.says_success
    finally:
        gymnasium.registry.pop("Doors-v0")


def test_who_does_not_tell_what_was_seen_last_is_refused_at_the_first_end():
    class Silent(SyncVectorEnv):
        def step(self, actions):
            *seen, info = super().step(actions)
            return *seen, {key: value for key, value in info.items() if "final_obs" not in key}

    gymnasium.register(
        "Silent-v0",
        vector_entry_point=lambda num_envs: Silent(
            [lambda: gymnasium.make("CartPole-v1")] * num_envs, autoreset_mode=AutoresetMode.SAME_STEP
        ),
    )
    try:
        task = build_task("gym:Silent-v0", 2)
        task.reset(1)
        with pytest.raises(ValueError, match=r"^gym:Silent-v0: an episode has ended without a final_obs in info"):
            for _ in range(200):
                task.step()
    finally:
        gymnasium.registry.pop("Silent-v0")


class OneSeed(VectorEnv):
    """Waits for resets, and takes one seed alone, as `VectorEnv` has it."""

    metadata = {"autoreset_mode": AutoresetMode.DISABLED}  # noqa: RUF012

    def __init__(self, num_envs=1):
        self.num_envs = num_envs
        one = gymnasium.make("CartPole-v1")
        self.single_observation_space, self.single_action_space = one.observation_space, one.action_space
        self.action_space = gymnasium.vector.utils.batch_space(one.action_space, num_envs)
        self.at = np.zeros((num_envs, 4), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mask = options["reset_mask"]
        self.at[mask] = self.np_random.uniform(size=(mask.sum(), 4))
        return self.at.copy(), {}

    def step(self, actions):  # noqa: ARG002
        over = self.at[:, 0] > 0.5
        return self.at.copy(), np.ones(self.num_envs), over, np.zeros(self.num_envs, bool), {}


def test_one_that_waits_for_resets_may_take_one_seed_alone():
    gymnasium.register("OneSeed-v0", vector_entry_point=OneSeed)
    try:
        starts = []
        for _ in range(2):
            task = build_task("gym:OneSeed-v0", 8)
            task.reset(3)
            before = task.buffers.observations.numpy().copy()
            task.step()
            is_over = task.buffers.outcomes.numpy() == Outcome.ENDED
            assert np.array_equal(is_over, before[:, 0] > 0.5)
            assert 0 < is_over.sum() < 8
            assert np.array_equal((task.buffers.observations.numpy() != before).all(axis=1), is_over)
            starts.append(before)
        assert np.array_equal(*starts)
    finally:
        gymnasium.registry.pop("OneSeed-v0")


def test_an_environment_without_an_end_is_refused_before_a_training_waits_for_ever(monkeypatch):
    class Early(GymTask):
        env_id = "SeveralPendulum-v1"

        def outcome(self, decision):
            return np.where(np.arange(2) == 0, Outcome.FELL, decision.outcomes)

    monkeypatch.setattr("policies.tasks.gym_autoreset.WAIT_STEPS", 50)
    task = build_task(Early, 2)
    task.reset(1)
    with pytest.raises(ValueError, match="gym:SeveralPendulum-v1: an episode that was ended early has gone on for 50"):
        for _ in range(60):
            task.step()
