"""Tasks as Gymnasium environments: what their arguments mean, what is refused, and what copies keep."""

import copy
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import CATALOGUE, UnknownTask, settings_class
from policies.tasks.episode import Outcome
from policies.tasks.gym import TaskEnv, TaskVectorEnv
from policies.tasks.task_params import NumberError, Sampler

ROOT = Path(__file__).parents[4]


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


INSTALLED = """
import sys
import gymnasium
import policies
assert "gentle_tasks" not in sys.modules
assert "honeyguide/Broken-v0" in gymnasium.registry
observation, _ = gymnasium.make("honeyguide/Gentle-v0").reset(seed=1)
assert observation.shape == gymnasium.make("honeyguide/RollerBall-v0").reset(seed=1)[0].shape
"""


def test_tasks_of_installed_packages_are_environments_too_and_a_broken_one_breaks_nothing_else(tmp_path):
    package = tmp_path / "gentle-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: gentle\nVersion: 1.0\n")
    given = ("Gentle = gentle_tasks:Gentle", "Broken = broken_tasks:Nothing", "no ID = gentle_tasks:Gentle")
    (package / "entry_points.txt").write_text("\n".join(["[honeyguide.tasks]", *given]))
    (tmp_path / "gentle_tasks.py").write_text("from policies.tasks.roller_ball import RollerBall as Gentle\n")
    (tmp_path / "broken_tasks.py").write_text("raise RuntimeError\n")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [sys.executable, "-c", INSTALLED]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
