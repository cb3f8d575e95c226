"""Tasks as Gymnasium environments, held against Gymnasium's own vector environments, wrappers and checker."""

import copy
import pickle
import re

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeObservation, NormalizeReward, RecordEpisodeStatistics

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import CATALOGUE, UnknownTask, settings_class
from policies.tasks.episode import Outcome
from policies.tasks.gym import TaskEnv, TaskVectorEnv
from policies.tasks.gym_task import GymTask
from policies.tasks.task_params import NumberError, Sampler

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


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(("name", "settings"), TASKS)
def test_a_batch_does_what_gymnasiums_batch_of_single_environments_does(name, settings, mode):
    """Bit for bit, resets, last observations and masks included."""
    theirs = SyncVectorEnv([lambda: TaskEnv(name, **settings)] * ENVS, autoreset_mode=mode)
    ours = TaskVectorEnv(name, ENVS, autoreset_mode=mode, **settings)
    assert ours.metadata["autoreset_mode"] is mode
    seeds = [3, 1, 4, 1, 5]
    assert np.array_equal(theirs.reset(seed=seeds)[0], ours.reset(seed=seeds)[0])
    ends = 0
    for actions in actions_of(theirs, 2, 60):
        there, here = theirs.step(actions), ours.step(actions)
        for one, other in zip(there[:4], here[:4], strict=True):
            assert np.array_equal(one, other)
        is_over = here[2] | here[3]
        ends += is_over.sum()
        if mode is AutoresetMode.SAME_STEP and is_over.any():
            assert np.array_equal(there[4]["_final_obs"], here[4]["_final_obs"])
            assert np.array_equal(np.stack(list(there[4]["final_obs"][is_over])), here[4]["final_obs"][is_over])
        if mode is AutoresetMode.DISABLED and is_over.any():
            observations, _ = theirs.reset(options={"reset_mask": is_over})
            assert np.array_equal(observations, ours.reset(options={"reset_mask": is_over})[0])
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
    seeds, ends = [1, 2, 3], 0
    assert np.array_equal(theirs.reset(seed=seeds)[0], ours.reset(seed=seeds)[0])
    for actions in actions_of(theirs, 2, 80):
        there, here = theirs.step(actions), ours.step(actions)
        for one, other in zip(there[:4], here[:4], strict=True):
            assert np.array_equal(one, other)
        is_over = here[2] | here[3]
        ends += is_over.sum()
        if mode is AutoresetMode.DISABLED and is_over.any():
            observations, _ = theirs.reset(options={"reset_mask": is_over})
            assert np.array_equal(observations, ours.reset(options={"reset_mask": is_over})[0])
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


def test_a_reset_mask_begins_its_rows_and_leaves_the_others():
    envs = TaskVectorEnv("RollerBall", 4)
    envs.reset(seed=1)
    before = envs.step(np.ones((4, 2)))[0]
    mask = np.array([False, True, False, True])
    after, _ = envs.reset(options={"reset_mask": mask})
    assert np.array_equal(after[~mask], before[~mask])
    assert (after[mask] != before[mask]).any(axis=1).all()
    seeded, _ = envs.reset(seed=[9, 9, 9, 9], options={"reset_mask": mask})
    assert np.array_equal(seeded[1], TaskEnv("RollerBall").reset(seed=9)[0])
    assert np.array_equal(seeded[~mask], before[~mask])


@pytest.mark.parametrize(
    ("mask", "error", "says"),
    [
        ([True, False], TypeError, "must be a NumPy array of booleans"),
        (np.ones(2), TypeError, "must be a NumPy array of booleans"),
        (np.ones(3, dtype=bool), ValueError, r"must have shape \(2,\)"),
        (np.zeros(2, dtype=bool), ValueError, "choose one at least"),
    ],
)
def test_masks_that_cannot_be_are_refused(mask, error, says):
    envs = TaskVectorEnv("RollerBall", 2)
    envs.reset(seed=1)
    with pytest.raises(error, match=says):
        envs.reset(options={"reset_mask": mask})


def test_nothing_steps_before_its_first_reset_or_after_its_end():
    env = TaskEnv("RollerBall", numbers={"step_limit": 2})
    with pytest.raises(ResetNeeded, match="no episode is running"):
        env.step(np.zeros(2))
    env.reset(seed=1)
    env.step(np.zeros(2))
    assert env.step(np.zeros(2))[3]
    with pytest.raises(ResetNeeded, match="no episode is running"):
        env.step(np.zeros(2))
    env.reset()
    env.step(np.zeros(2))
    envs = TaskVectorEnv("RollerBall", 2, autoreset_mode="Disabled", numbers={"step_limit": 1})
    with pytest.raises(ResetNeeded, match="in 2 of the environments"):
        envs.step(np.zeros((2, 2)))
    with pytest.raises(ResetNeeded, match="reset all environments first"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    envs.reset(seed=1)
    envs.step(np.zeros((2, 2)))
    envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ResetNeeded, match="in 1 of the environments"):
        envs.step(np.zeros((2, 2)))


def test_numbers_are_set_and_drawn_through_gymnasiums_make():
    env = gymnasium.make("policies:honeyguide/RollerBall-v0", numbers={"mass_kg": 3.0, "force_n": (5.0, 6.0)})
    params = env.unwrapped.task
    env.reset(seed=1)
    values = dict(zip(params.param_table.names, params.buffers.params.numpy()[0], strict=True))
    assert values["mass_kg"] == 3.0
    assert 5.0 <= values["force_n"] <= 6.0
    with pytest.raises(NumberError, match="weight: this task has no such number"):
        gymnasium.make("honeyguide/RollerBall-v0", numbers={"weight": 3.0})
    with pytest.raises(UnknownTask, match="RollerBall: speed: no such setting"):
        gymnasium.make("honeyguide/RollerBall-v0", speed=3.0)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_registered_task_has_a_limit_of_steps(name):
    assert gymnasium.spec(f"honeyguide/{name}-v0").max_episode_steps == CATALOGUE[name].max_episode_steps > 0
    assert settings_class(name)().split == "train"


def test_a_task_without_a_limit_is_cut_alone_and_in_a_batch():
    env = gymnasium.make("honeyguide/Parking1-v0", max_episode_steps=20)
    envs = gymnasium.make_vec("honeyguide/Parking1-v0", num_envs=3, max_episode_steps=20)
    env.reset(seed=1)
    envs.reset(seed=1)
    turn = [(env.step(1), envs.step(np.ones(3, dtype=int))) for _ in range(20)]
    assert [one[3] for one, _ in turn] == [False] * 19 + [True]
    assert [many[3].tolist() for _, many in turn] == [[False] * 3] * 19 + [[True] * 3]
    info = turn[-1][1][4]
    assert info["_final_obs"].all()
    assert not np.array_equal(info["final_obs"], turn[-1][1][0])
    assert envs.unwrapped.task.take_scores().length_sum == 60


def test_minus_one_is_no_limit_and_other_limits_below_one_are_refused():
    envs = gymnasium.make_vec("honeyguide/Parking1-v0", num_envs=2, max_episode_steps=-1)
    envs.reset(seed=1)
    assert not any(envs.step(np.zeros(2, dtype=int))[3].any() for _ in range(5))
    for limit in (0, -2):
        with pytest.raises(
            NumberError, match=f"max_episode_steps: must be at least 1, or -1 for no limit, not {limit}"
        ):
            TaskVectorEnv("Parking1", 2, max_episode_steps=limit)


def test_an_end_by_gymnasiums_limit_is_named_in_a_batch_alone():
    """`make` cuts an episode outside of the environment, which cannot say so."""
    env = gymnasium.make("honeyguide/RollerBall-v0", max_episode_steps=1)
    envs = gymnasium.make_vec("honeyguide/RollerBall-v0", num_envs=1, max_episode_steps=1)
    env.reset(seed=1)
    envs.reset(seed=1)
    assert env.step(np.zeros(2, dtype=np.float32))[3:] == (True, {})
    *_, is_truncated, info = envs.step(np.zeros((1, 2)))
    assert (bool(is_truncated[0]), info["outcome"].tolist()) == (True, [Outcome.TIMEOUT])


@pytest.mark.parametrize(
    ("name", "action", "says"),
    [
        ("RollerBall", 0.5, r"action: must have shape \(2,\), not \(\)"),
        ("RollerBall", [1.0], r"action: must have shape \(2,\), not \(1,\)"),
        ("RollerBall", [[1.0, 1.0]], r"action: must have shape \(2,\), not \(1, 2\)"),
        ("RollerBall", ["a", "b"], "action: must be numbers, not <U1"),
        ("Parking1", 1.7, "action: must be whole numbers, not float64"),
        ("Parking1", np.nan, "action: must be whole numbers, not float64"),
        ("Parking1", [0, 1], r"action: must have shape \(\), not \(2,\)"),
        ("Parking2", 1, r"action: must have shape \(2,\), not \(\)"),
    ],
)
def test_actions_of_another_shape_or_kind_are_refused(name, action, says):
    env = TaskEnv(name)
    env.reset(seed=1)
    with pytest.raises(ValueError, match=says):
        env.step(action)


@pytest.mark.parametrize(
    ("name", "count", "shape", "expected"),
    [
        ("RollerBall", 2, (2,), "(2, 2)"),
        ("RollerBall", 4, (2,), "(4, 2)"),
        ("RollerBall", 4, (4, 1), "(4, 2)"),
        ("RollerBall", 2, (3, 2), "(2, 2)"),
        ("Parking1", 2, (3,), "(2,)"),
        ("Parking2", 3, (2, 3), "(3, 2)"),
    ],
)
def test_actions_of_a_batch_are_not_stretched(name, count, shape, expected):
    envs = TaskVectorEnv(name, count)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match=re.escape(f"action: must have shape {expected}, not {shape}")):
        envs.step(np.zeros(shape, dtype=int))


def test_the_choice_of_one_branch_may_have_an_axis_of_its_own():
    env, envs = TaskEnv("Parking1"), TaskVectorEnv("Parking1", 2)
    env.reset(seed=1)
    envs.reset(seed=1)
    for action in (1, [1], np.int64(1), np.array([1], dtype=np.uint8)):
        env.step(action)
        envs.step(np.stack([action, action]))
        assert envs.task.buffers.branches.numpy().tolist() == [[1], [1]]


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ((1, 2, 3), r"mass_kg: a range is a pair of numbers, not \(1, 2, 3\)"),
        ((1,), r"mass_kg: a range is a pair of numbers, not \(1,\)"),
        (("a", "b"), "mass_kg: a range is a pair of numbers"),
        ("heavy", "mass_kg: must be a number, or what it is drawn from, not 'heavy'"),
        (None, "mass_kg: must be a number, or what it is drawn from, not None"),
        (np.array([1.0, 2.0]), "mass_kg: must be a number, or what it is drawn from"),
        (Sampler(mean=1.0, st_dev=-1.0), "mass_kg: st_dev: must be at least 0 and finite, not -1.0"),
        (Sampler(mean=1.0, st_dev=np.nan), "mass_kg: st_dev: must be at least 0 and finite, not nan"),
        (Sampler(mean=1.0, st_dev=np.inf), "mass_kg: st_dev: must be at least 0 and finite, not inf"),
        (Sampler(intervals=((1.0,),)), "mass_kg: an interval is a pair of numbers"),
    ],
)
def test_numbers_that_cannot_be_are_refused(value, says):
    with pytest.raises(NumberError, match=says):
        TaskEnv("RollerBall", numbers={"mass_kg": value})


def test_numbers_are_a_dictionary():
    with pytest.raises(NumberError, match="numbers: must be a dictionary"):
        TaskEnv("RollerBall", numbers=["mass_kg"])


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


@pytest.mark.parametrize("make", [lambda: TaskEnv("RollerBall"), lambda: TaskVectorEnv("RollerBall", 2)])
def test_a_copy_keeps_seed_and_generators_of_its_spaces(make):
    env = make()
    env.reset(seed=3)
    env.action_space.seed(4)
    env.action_space.sample()
    for twin in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        original = copy.deepcopy(env)
        assert twin.np_random_seed == 3
        assert np.array_equal(twin.action_space.sample(), original.action_space.sample())


@pytest.mark.parametrize("make", [lambda: TaskEnv("RollerBall"), lambda: TaskVectorEnv("RollerBall", 1)])
def test_a_pickle_goes_on_where_it_was(make):
    env = make()
    env.reset(seed=3)
    push = np.full(env.action_space.shape, 0.3, dtype=np.float32)
    for _ in range(4):
        env.step(push)
    for twin in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        original = pickle.loads(pickle.dumps(env))
        for _ in range(40):
            one, other = original.step(push), twin.step(push)
            assert np.array_equal(one[0], other[0])
            if isinstance(env, TaskEnv) and (one[2] or one[3]):
                assert np.array_equal(original.reset()[0], twin.reset()[0])
        assert np.array_equal(original.reset()[0], twin.reset()[0])  # their generators, too


def test_made_environments_are_pickled_with_their_wrappers():
    env = gymnasium.make("honeyguide/RollerBall-v0", numbers={"mass_kg": 2.0})
    env.reset(seed=1)
    twin = pickle.loads(pickle.dumps(env))
    assert twin.spec.id == env.spec.id
    push = np.array([0.1, 0.2], dtype=np.float32)
    assert np.array_equal(env.step(push)[0], twin.step(push)[0])


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


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_what_critics_may_see_is_shown_where_it_is_asked_for():
    settings = {"image_size": 8, "has_estimator": False}
    env = TaskEnv("FollowMe", has_privileged=True, **settings)
    observation, _ = env.reset(seed=1)
    assert set(observation) == {"image", "vector", "privileged"}
    assert np.array_equal(observation["privileged"], env.task.buffers.privileged.numpy()[0])
    assert env.observation_space["privileged"].shape == (len(env.task.layout.privileged),)
    assert env.observation_space.contains(env.step(env.action_space.sample())[0])
    plain, _ = TaskEnv("FollowMe", **settings).reset(seed=1)
    assert set(plain) == {"image", "vector"}
    assert np.array_equal(plain["vector"], observation["vector"])
    with pytest.raises(UnknownTask, match="RollerBall: has_privileged: as it is set it has no privileged elements"):
        TaskEnv("RollerBall", has_privileged=True)
