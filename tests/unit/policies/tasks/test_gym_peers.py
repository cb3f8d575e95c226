"""Tasks as Gymnasium environments, held against Gymnasium's own vector environments, wrappers and checker."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeObservation, NormalizeReward, RecordEpisodeStatistics

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.episode import Outcome
from policies.tasks.gym import TaskEnv, TaskVectorEnv
from policies.tasks.gym_task import GymTask

ENVS = 5
SHORT = {"step_limit": (6.0, 12.0)}
TASKS = [
    ("RollerBall", {"numbers": {**SHORT, "half_floor_m": 1.2}}),  # falls and is late; the ball rolls on after a reach
    ("Parking1", {"numbers": SHORT}),  # as coded: a crash keeps goal and velocity
    ("Parking2", {"preset": "improved", "numbers": SHORT}),
    ("ReachTarget", {"numbers": SHORT, "stack": 2}),
]


def actions_of(env, seed, count):
    env.action_space.seed(seed)
    return [env.action_space.sample() for _ in range(count)]


def stepped_alike(theirs, ours, seeds, count):
    """Steps Gymnasium's batch and ours, alike bit for bit, masked resets too; the infos of each step, and its ends."""
    assert np.array_equal(theirs.reset(seed=seeds)[0], ours.reset(seed=seeds)[0])
    for actions in actions_of(theirs, 2, count):
        there, here = theirs.step(actions), ours.step(actions)
        for one, other in zip(there[:4], here[:4], strict=True):
            assert np.array_equal(one, other)
        is_over = here[2] | here[3]
        yield there[4], here[4], is_over
        if ours.metadata["autoreset_mode"] is AutoresetMode.DISABLED and is_over.any():
            observations, _ = theirs.reset(options={"reset_mask": is_over})
            assert np.array_equal(observations, ours.reset(options={"reset_mask": is_over})[0])


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(("name", "settings"), TASKS)
def test_a_batch_does_what_gymnasiums_batch_of_single_environments_does(name, settings, mode):
    """Bit for bit, resets, last observations and masks included."""
    theirs = SyncVectorEnv([lambda: TaskEnv(name, **settings)] * ENVS, autoreset_mode=mode)
    ours = TaskVectorEnv(name, ENVS, autoreset_mode=mode, **settings)
    assert ours.metadata["autoreset_mode"] is mode
    ends = 0
    for there, here, is_over in stepped_alike(theirs, ours, [3, 1, 4, 1, 5], 60):
        ends += is_over.sum()
        if mode is AutoresetMode.SAME_STEP and is_over.any():
            assert np.array_equal(there["_final_obs"], here["_final_obs"])
            assert np.array_equal(np.stack(list(there["final_obs"][is_over])), here["final_obs"][is_over])
    assert ends > ENVS


class Pole(GymTask):
    env_id = "CartPole-v1"


class ShortPole(GymTask):
    """Ends at once where the cart begins on the right: in a row that is held, too."""

    env_id = "CartPole-v1"

    def outcome(self, decision):
        return np.where(decision.next_observations[:, -4] > 0.03, Outcome.LOST, decision.outcomes)


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("task", [Pole, ShortPole])
@pytest.mark.parametrize("settings", [{"stack": 2}, {"max_episode_steps": 7}])
def test_environments_of_gymnasium_in_a_batch_do_what_gymnasiums_batch_does(task, settings, mode):
    theirs = SyncVectorEnv([lambda: TaskEnv(task, **settings)] * 3, autoreset_mode=mode)
    ours = TaskVectorEnv(task, 3, autoreset_mode=mode, **settings)
    ends = sum(is_over.sum() for *_, is_over in stepped_alike(theirs, ours, [1, 2, 3], 80))
    assert ends > 6


def test_environments_in_processes_are_held_too():
    ours = TaskVectorEnv(Pole, 2, autoreset_mode="NextStep", vectorization="async")
    theirs = SyncVectorEnv([lambda: TaskEnv(Pole)] * 2, autoreset_mode=AutoresetMode.NEXT_STEP)
    try:
        assert np.array_equal(theirs.reset(seed=[1, 2])[0], ours.reset(seed=[1, 2])[0])
        for _ in range(30):
            assert np.array_equal(theirs.step(np.ones(2, dtype=int))[0], ours.step(np.ones(2, dtype=int))[0])
    finally:
        ours.close()


def test_what_a_vector_environment_steps_begins_another_episode_with_the_step_after_its_end():
    arguments = {"task": "RollerBall", "autoreset_mode": "Disabled", "numbers": {"step_limit": 3}}
    gymnasium.register("Batch-v0", vector_entry_point=TaskVectorEnv, kwargs=arguments)
    try:
        envs = TaskVectorEnv("gym:Batch-v0", 2, autoreset_mode="NextStep")
    finally:
        gymnasium.registry.pop("Batch-v0")
    envs.reset(seed=1)
    seen = [envs.step(np.zeros((2, 2))) for _ in range(8)]
    assert [bool(step[3].all()) for step in seen] == [False, False, True, False, False, False, True, False]
    assert not seen[3][1].any()
    assert not np.array_equal(seen[3][0], seen[2][0])


@pytest.mark.parametrize("make", [lambda **how: TaskEnv(Pole, **how), lambda **how: TaskVectorEnv(Pole, 2, **how)])
def test_closing_it_closes_what_runs_elsewhere(make):
    env = make(vectorization="async")
    env.reset(seed=1)
    processes = env.task.envs.processes
    assert all(process.is_alive() for process in processes)
    env.close()
    assert not any(process.is_alive() for process in processes)
    env.close()


def test_what_flies_begins_with_the_step_after_its_end_too():
    envs = TaskVectorEnv("Hover", 3, autoreset_mode="NextStep", has_estimator="false", numbers={"step_limit": 3})
    envs.reset(seed=1)
    seen = [envs.step(np.zeros((3, 4), dtype=np.float32)) for _ in range(8)]
    assert [bool(step[3].all()) for step in seen] == [False, False, True, False, False, False, True, False]
    assert not seen[3][1].any()  # the reset is paid nothing
    assert not np.array_equal(seen[3][0], seen[2][0])


def test_rows_of_a_list_of_seeds_are_the_single_environments_with_these_seeds():
    envs = TaskVectorEnv("RollerBall", 3)
    observations, _ = envs.reset(seed=[7, 8, 7])
    singles = [TaskEnv("RollerBall").reset(seed=seed)[0] for seed in (7, 8, 7)]
    assert np.array_equal(observations, singles)
    free, _ = envs.reset(seed=[7, None, None])
    assert np.array_equal(free[0], singles[0])
    assert not np.array_equal(free[1], free[2])
    with pytest.raises(ValueError, match="reset: seed: there are 2 for 3 environments"):
        envs.reset(seed=[1, 2])


def test_one_seed_gives_the_same_batch_again():
    envs = TaskVectorEnv("RollerBall", 3)
    first, _ = envs.reset(seed=5)
    assert not np.array_equal(envs.reset()[0], first)
    assert np.array_equal(envs.reset(seed=5)[0], first)


@pytest.mark.parametrize("name", ["RollerBall", Pole])
def test_seeds_are_dealt_out_and_carried_on_as_by_gymnasiums_batch(name):
    """One seed, a list with gaps, none, and masks with each of these."""
    theirs = SyncVectorEnv([lambda: TaskEnv(name)] * 3, autoreset_mode=AutoresetMode.DISABLED)
    ours = TaskVectorEnv(name, 3, autoreset_mode="Disabled")
    everyone, first = np.ones(3, dtype=bool), np.array([True, False, False])
    resets = [
        (5, None),
        (None, None),
        ([1, 2, 3], None),
        (None, None),
        (5, everyone),
        ([9, None, None], first),
        (None, ~first),
        (None, None),
        ([4, None, 4], None),
        (None, everyone),
    ]
    for seed, mask in resets:
        seen = [
            envs.reset(seed=seed, options=None if mask is None else {"reset_mask": mask})[0] for envs in (theirs, ours)
        ]
        assert np.array_equal(*seen), (seed, mask)


def test_a_reset_leaves_the_info_of_the_last_step_as_it_was():
    envs = TaskVectorEnv("RollerBall", 2, autoreset_mode="Disabled", numbers={"step_limit": 1})
    envs.reset(seed=1)
    *_, info = envs.step(np.zeros((2, 2)))
    envs.reset(options={"reset_mask": np.array([True, False])})
    assert info["_outcome"].tolist() == [True, True]


def test_a_batch_says_at_which_rate_it_is_rendered():
    assert TaskVectorEnv("RollerBall", 2).metadata["render_fps"] == TaskEnv("RollerBall").metadata["render_fps"] == 5


def test_last_observations_with_parts_are_those_of_gymnasiums_batch():
    settings = {"has_estimator": False, "image_size": 8, "has_privileged": True}
    ours = TaskVectorEnv("FollowMe", 2, max_episode_steps=2, **settings)
    theirs = SyncVectorEnv(
        [lambda: gymnasium.wrappers.TimeLimit(TaskEnv("FollowMe", **settings), 2)] * 2,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    for envs in (ours, theirs):
        envs.reset(seed=1)
    for actions in actions_of(ours, 1, 2):
        here, there = (envs.step(actions)[4] for envs in (ours, theirs))
    assert here["final_obs"].dtype == there["final_obs"].dtype == object
    assert [set(last) for last in here["final_obs"]] == [set(last) for last in there["final_obs"]]
    assert np.array_equal(here["final_obs"][0]["image"], there["final_obs"][0]["image"])


@pytest.mark.parametrize("context", ["spawn"])
def test_workers_of_other_processes_step_it(context):
    """Gymnasium's own: the environment itself is sent to the spawned processes, which have not imported the tasks."""
    env = TaskEnv("RollerBall")
    here = SyncVectorEnv([lambda: TaskEnv("RollerBall")] * 2)
    there = AsyncVectorEnv([Maker(env), Maker(env)], context=context)
    try:
        assert np.array_equal(here.reset(seed=1)[0], there.reset(seed=1)[0])
        for actions in actions_of(here, 1, 5):
            assert np.array_equal(here.step(actions)[0], there.step(actions)[0])
    finally:
        there.close()


class Maker:
    """Hands out an environment that was made elsewhere."""

    def __init__(self, env):
        self.env = env

    def __call__(self):
        return self.env


def test_gymnasiums_wrappers_of_batches_take_it():
    envs = TaskVectorEnv("RollerBall", 8, autoreset_mode=AutoresetMode.NEXT_STEP, numbers={"step_limit": 10})
    raw = TaskVectorEnv("RollerBall", 8, autoreset_mode=AutoresetMode.NEXT_STEP, numbers={"step_limit": 10})
    wrapped = NormalizeReward(NormalizeObservation(RecordEpisodeStatistics(envs)))
    wrapped.reset(seed=1)
    raw.reset(seed=1)
    returns, paid, normal = [], np.zeros(8), []
    for actions in actions_of(envs, 3, 100):
        seen, _, _, _, info = wrapped.step(actions)
        _, rewards, is_terminated, is_truncated, _ = raw.step(actions)
        paid += rewards
        normal.append(seen)
        for i in np.flatnonzero(is_terminated | is_truncated):
            assert info["episode"]["r"][i] == pytest.approx(paid[i])
            returns.append(paid[i])
            paid[i] = 0.0
    assert len(returns) >= 8 * 8
    assert np.abs(np.std(normal[20:], axis=(0, 1))[[0, 2]] - 1.0).max() < 0.3


def test_same_step_statistics_count_every_decision():
    envs = RecordEpisodeStatistics(TaskVectorEnv("RollerBall", 4, numbers={"step_limit": 5, "half_floor_m": 100.0}))
    envs.reset(seed=2)
    lengths = [envs.step(np.zeros((4, 2)))[4].get("episode", {}).get("l") for _ in range(10)]
    assert [length is not None and length.tolist() for length in lengths].count([5] * 4) == 2


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
@pytest.mark.parametrize(("name", "settings"), TASKS)
def test_gymnasiums_checker_finds_nothing(name, settings):
    check_env(gymnasium.make(f"honeyguide/{name}-v0", **settings).unwrapped, skip_render_check=True)
