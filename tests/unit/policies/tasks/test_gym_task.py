"""Environments of Gymnasium as tasks, held against Gymnasium's own stepping of them."""

import gc
import os
import signal

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Text, Tuple, flatten
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from policies.tasks.catalogue import (
    UnknownTask,
    build_task,
    file_stem,
    is_task_name,
    runs_code,
    settings_of,
    task_settings,
)
from policies.tasks.episode import Outcome
from policies.tasks.gym_spaces import ActionWriter, ObservationReader, UnfitSpace
from policies.tasks.gym_task import GymTask
from policies.tasks.task_error import TaskError


class Corridor(gymnasium.Env):
    """Walks to 3; says whether it has succeeded, and shows everything that can be seen."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012

    def __init__(self, space="plain", render_mode=None):
        self.render_mode = render_mode
        picture = Box(0, 255, (3, 12, 10), np.uint8)
        self.observation_space = {
            "plain": Dict({"at": Box(-9, 9, (2,)), "choice": Discrete(3, start=1), "picture": picture}),
            "text": Text(4),
            "pictures": Tuple((picture, picture)),
        }[space]
        self.action_space = MultiDiscrete([2, 3], start=[5, 0])

    def _seen(self):
        picture = np.full((3, 12, 10), self.at, np.uint8)
        return {
            "at": np.array([self.at, -self.at], np.float32),
            "choice": np.int64(1 + self.at % 3),
            "picture": picture,
        }

    def reset(self, *, seed=None, options=None):  # noqa: ARG002  (as Gymnasium calls it)
        super().reset(seed=seed)
        self.at, self.steps = 0, 0
        return self._seen(), {}

    def step(self, action):
        assert self.action_space.contains(action)
        self.at += int(action[0] == 6)
        self.steps += 1
        is_there = self.at == 3
        return self._seen(), float(action[1]), is_there, self.steps == 5, {"is_success": is_there}

    def render(self):
        return np.full((20, 30, 3), 7, np.uint8)

    def signals(self):
        """Its process, the group of that, and what it does when it is interrupted or to end."""
        handlers = tuple(signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
        return os.getpid(), os.getpgrp(), handlers


class Faulty(gymnasium.Env):
    """Shows or pays in the third step what is not finite, or raises where it is made."""

    observation_space = Box(-1, 1, (1,))
    action_space = Discrete(2)

    def __init__(self, seen=0.0, paid=0.0, raises=""):
        self.seen, self.paid, self.steps = seen, paid, 0
        if raises == "key":
            raise KeyError("9x9")
        if raises == "file":
            raise FileNotFoundError(2, "No such file or directory", "map.txt")
        if raises == "runtime":
            raise RuntimeError("no display")

    def reset(self, *, seed=None, options=None):  # noqa: ARG002  (as Gymnasium calls it)
        super().reset(seed=seed)
        return np.zeros(1, np.float32), {}

    def step(self, action):  # noqa: ARG002  (as Gymnasium calls it)
        self.steps += 1
        is_third = self.steps == 3
        return np.full(1, self.seen if is_third else 0.0, np.float32), self.paid if is_third else 0.0, False, False, {}


@pytest.fixture(autouse=True)
def registered():
    gymnasium.register("Corridor-v0", entry_point=Corridor)
    gymnasium.register("Faulty-v0", entry_point=Faulty, disable_env_checker=True)
    yield
    gymnasium.registry.pop("Corridor-v0")
    gymnasium.registry.pop("Faulty-v0")


@pytest.mark.parametrize("env_id", ["CartPole-v1", "Pendulum-v1", "FrozenLake-v1"])
def test_it_does_what_gymnasiums_own_batch_does(env_id):
    """Observations, rewards and ends of 300 decisions, and what ended episodes saw last."""
    theirs = SyncVectorEnv([lambda: gymnasium.make(env_id)] * 3, autoreset_mode=AutoresetMode.SAME_STEP)
    task = build_task(f"gym:{env_id}", 3)
    task.reset(5)
    single = theirs.single_observation_space

    def flat(observations):
        return np.array([flatten(single, each) for each in observations], dtype=np.float32)

    assert np.array_equal(flat(theirs.reset(seed=5)[0]), task.buffers.observations.numpy())
    rng, ends, returns = np.random.default_rng(1), 0, 0.0
    for _ in range(300):
        if task.layout.branches:
            choices = rng.integers(task.layout.branch_sizes[0], size=3)
            task.buffers.branches.assign(choices[:, None].astype(np.int32))
        else:
            choices = rng.uniform(-1.0, 1.0, (3, 1)).astype(np.float32)
            task.buffers.continuous.assign(choices)
            choices = np.float32(2.0) * choices  # of Pendulum: torques to 2 N m
        observations, rewards, is_terminated, is_truncated, info = theirs.step(choices)
        task.step()
        buffers = task.buffers
        assert np.allclose(buffers.observations.numpy(), flat(observations), atol=1e-5)
        assert np.allclose(buffers.rewards.numpy(), rewards, atol=1e-5)
        assert np.array_equal(buffers.is_terminated.numpy(), is_terminated)
        assert np.array_equal(buffers.is_truncated.numpy(), is_truncated & ~is_terminated)
        is_over = is_terminated | is_truncated
        ends += is_over.sum()
        returns += rewards.sum()
        for i in np.flatnonzero(is_over):
            seen_last = flatten(single, info["final_obs"][i])
            assert np.allclose(buffers.final_observations.numpy()[i], seen_last, atol=1e-5)
    scores = task.take_scores()
    assert scores.episode_count == ends >= 3
    assert scores.return_sum + task.buffers.returns.numpy().sum() == pytest.approx(returns, rel=1e-4)


def test_dicts_images_choices_and_success_are_understood():
    task = build_task("gym:Corridor-v0", 2, settings_of("gym:Corridor-v0", ["stack=2"]))
    layout = task.layout
    assert [element.name for element in layout.frame] == ["at_0", "at_1", "choice_0", "choice_1", "choice_2"]
    assert layout.image.shape == (12, 10, 3)
    assert layout.branch_sizes == (2, 3)
    assert task.decision_s == 0.1
    assert not task.says_success
    task.reset(1)
    assert task.buffers.observations.numpy()[0].tolist() == [0] * 5 + [0, 0, 1, 0, 0]
    for step, (goes_0, goes_1) in enumerate([(1, 1), (1, 0), (1, 1)]):
        task.buffers.branches.assign(np.array([[goes_0, 2], [goes_1, step]], dtype=np.int32))
        task.step()
    assert task.says_success
    assert task.buffers.outcomes.numpy().tolist() == [Outcome.SUCCESS, Outcome.RUNNING]
    assert task.buffers.final_observations.numpy()[0].tolist() == [2, -2, 0, 0, 1, 3, -3, 1, 0, 0]
    assert task.buffers.final_images.numpy()[0, 0, 0].tolist() == [3, 3, 3]
    assert task.buffers.images.numpy()[:, 0, 0, 0].tolist() == [0, 2]
    assert task.buffers.observations.numpy()[0].tolist() == [0] * 5 + [0, 0, 1, 0, 0]
    assert task.top_view(1).shape == (20, 30, 3)


def test_beginning_one_row_touches_only_that_row():
    task = build_task("gym:CartPole-v1", 3)
    task.reset(1)
    task.step()
    before = task.buffers.observations.numpy().copy()
    task.begin(np.array([False, True, False]))
    after = task.buffers.observations.numpy()
    assert np.array_equal(before[[0, 2]], after[[0, 2]])
    assert not np.array_equal(before[1], after[1])
    assert task.buffers.steps.numpy().tolist() == [1, 0, 1]


def test_a_restored_task_begins_anew_and_in_the_same_way_each_time():
    task = build_task("gym:CartPole-v1", 3)
    task.reset(1)
    task.step()
    state = task.state()
    starts = []
    for _ in range(2):
        task.load_state(state)
        starts.append(task.buffers.observations.numpy().copy())
    assert np.array_equal(*starts)
    assert task.buffers.steps.numpy().tolist() == [0, 0, 0]


def test_arguments_of_the_environment_are_settings():
    task = build_task("gym:Pendulum-v1", 1, settings_of("gym:Pendulum-v1", ["g=1.5"]))
    assert task.envs.envs[0].unwrapped.g == 1.5
    with pytest.raises(UnknownTask, match=r"gym:Pendulum-v1: cannot be made: .*unexpected keyword argument 'gravity'"):
        build_task("gym:Pendulum-v1", 1, settings_of("gym:Pendulum-v1", ["gravity=1.5"]))
    with pytest.raises(UnknownTask, match="vectorization: must be sync, async or vector_entry_point"):
        settings_of("gym:Pendulum-v1", ["vectorization=both"])
    with pytest.raises(UnknownTask, match="gym:Pendulum-v1: preset: there are none, and no improved"):
        settings_of("gym:Pendulum-v1", ["preset=improved"])


def test_processes_do_what_one_does():
    one, many = (
        build_task("gym:CartPole-v1", 2, settings_of("gym:CartPole-v1", [f"vectorization={how}"]))
        for how in ("sync", "async")
    )
    try:
        for task in (one, many):
            task.reset(3)
            for _ in range(30):
                task.step()
        assert np.array_equal(one.buffers.observations.numpy(), many.buffers.observations.numpy())
        assert one.take_scores() == many.take_scores()
    finally:
        many.envs.close()


def test_a_subclass_changes_what_it_pays():
    class Upright(GymTask):
        env_id = "CartPole-v1"

        def reward(self, decision):
            return 1.0 - np.abs(decision.next_observations[:, 2])

    task = build_task(Upright, 2)
    task.reset(1)
    task.step()
    assert np.allclose(task.buffers.rewards.numpy(), 1.0 - np.abs(task.buffers.observations.numpy()[:, 2]))


def test_a_vector_environment_without_a_single_one_is_taken_if_it_waits_for_resets():
    gymnasium.register("Batch-v0", vector_entry_point="policies.tasks.gym:TaskVectorEnv", kwargs={"task": "RollerBall"})
    try:
        settings = settings_of("gym:Batch-v0", ["autoreset_mode=Disabled", "numbers={'step_limit': 2}"])
        task, own = build_task("gym:Batch-v0", 4, settings), build_task("RollerBall", 4)
        task.reset(1)
        for _ in range(2):
            task.step()
        assert (task.buffers.outcomes.numpy() == Outcome.TIMEOUT).all()
        assert task.layout.observation_size == own.layout.observation_size
    finally:
        gymnasium.registry.pop("Batch-v0")


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("gym:Nope-v1", "gym:Nope-v1: Environment `Nope` doesn't exist"),
        ("gym:nope:Nope-v1", "gym:nope:Nope-v1: there is no module nope"),
        ("Nope", "Nope: no such task; there are RollerBall.* module:Class for your own"),
        ("nope:Nope", "nope:Nope: there is no module nope"),
        ("policies.tasks.roller_ball:Nope", "policies.tasks.roller_ball has no Nope"),
        (
            "policies.tasks.roller_ball:RollerBallParams",
            "is no task: it must be a subclass of policies.tasks.task.Task",
        ),
        (":Nope", "nothing cannot be the name of a module"),
    ],
)
def test_what_is_no_task_is_refused_in_one_sentence(name, says):
    with pytest.raises(UnknownTask, match=says) as refused:
        build_task(name, 1)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("space", "says"), [("text", "its observation space is Text; a Box"), ("pictures", "shows 2 images; one at most")]
)
def test_observations_that_nothing_can_see_are_refused(space, says):
    with pytest.raises(UnknownTask, match=f"gym:Corridor-v0: .*{says}"):
        build_task("gym:Corridor-v0", 1, settings_of("gym:Corridor-v0", [f"space={space}"]))


@pytest.mark.parametrize(
    ("space", "says"),
    [
        (Box(-np.inf, np.inf, (2,)), "has no bounds"),
        (Box(0, 5, (2,), np.int32), "a Box of int32; a Box of floats"),
        (Dict({"a": Discrete(2)}), "a Dict; a Box of floats"),
    ],
)
def test_actions_that_no_policy_can_take_are_refused(space, says):
    with pytest.raises(UnfitSpace, match=says):
        ActionWriter(space)


@pytest.mark.parametrize("space", [Box(-1, 3, (2, 2)), Discrete(4, start=2), MultiDiscrete([2, 3]), MultiBinary(3)])
def test_actions_lie_in_their_space_and_reach_its_ends(space):
    writer = ActionWriter(space)
    sizes = [len(branch.choices) for branch in writer.branches]
    ends = [(-1.0, np.zeros(len(sizes), int)), (1.0, np.array(sizes, int) - 1)]
    for end, choices in ends:
        actions = writer.actions(np.full((2, len(writer.continuous)), end, np.float32), np.tile(choices, (2, 1)))
        assert all(space.contains(action) for action in actions)
        if isinstance(space, Box):
            assert (actions == (space.low if end < 0 else space.high)).all()


@pytest.mark.parametrize(
    "space",
    [
        Box(-1, 1, (2, 3)),
        Discrete(4, start=2),
        MultiBinary(3),
        MultiDiscrete([2, 3]),
        Dict({"b": Discrete(3), "a": Tuple((Box(0, 1, (2,)), MultiBinary(2)))}),
    ],
)
def test_floats_are_those_of_gymnasiums_flatten(space):
    space.seed(1)
    samples = [space.sample() for _ in range(5)]
    batch = gymnasium.vector.utils.create_empty_array(space, 5)
    batch = gymnasium.vector.utils.concatenate(space, samples, batch)
    expected = np.array([flatten(space, sample) for sample in samples], dtype=np.float32)
    reader = ObservationReader(space)
    assert np.array_equal(reader.floats(batch), expected)
    assert len(reader.elements) == expected.shape[1]


def test_names_say_whether_their_code_is_run():
    assert is_task_name("gym:CartPole-v1")
    assert is_task_name("a.b:C")
    assert not is_task_name("results/run")
    assert not runs_code("gym:CartPole-v1")
    assert not runs_code("Parking1")
    assert runs_code("gym:mine:CartPole-v1")
    assert runs_code("mine:Task")
    assert [file_stem(name) for name in ("gym:CartPole-v1", "a.b:MyTask")] == ["cart-pole-v1", "my-task"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"paid": np.nan}, "gym:Faulty-v0: a reward is not finite"),
        ({"paid": -np.inf}, "gym:Faulty-v0: a reward is not finite"),
        ({"seen": np.nan}, "gym:Faulty-v0: an observation holds a number that is not finite"),
    ],
)
def test_what_is_not_finite_is_refused_before_anything_learns_from_it(arguments, says):
    task = build_task("gym:Faulty-v0", 2, task_settings("gym:Faulty-v0", arguments))
    task.reset(1)
    task.step()
    task.step()
    with pytest.raises(TaskError, match=says):
        task.step()


@pytest.mark.parametrize(
    ("raises", "says"),
    [
        ("key", "gym:Faulty-v0: cannot be made: KeyError: '9x9'"),
        ("file", "gym:Faulty-v0: cannot be made: FileNotFoundError: .*map.txt"),
        ("runtime", "gym:Faulty-v0: cannot be made: RuntimeError: no display"),
    ],
)
def test_whatever_a_constructor_raises_is_told_in_one_sentence(raises, says):
    with pytest.raises(UnknownTask, match=says):
        build_task("gym:Faulty-v0", 1, settings_of("gym:Faulty-v0", [f"raises={raises}"]))


def test_a_subclass_without_an_id_is_refused():
    with pytest.raises(UnknownTask, match="Nameless: names no env_id"):
        build_task(type("Nameless", (GymTask,), {}), 1)


def test_processes_leave_signals_to_the_one_that_made_them():
    before = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        task = build_task("gym:Corridor-v0", 2, settings_of("gym:Corridor-v0", ["vectorization=async"]))
    finally:
        signal.signal(signal.SIGTERM, before)
    try:
        for pid, group, handlers in task.envs.call("signals"):
            assert group == pid != os.getpid()
            assert handlers == (signal.SIG_DFL,) * 3
    finally:
        task.close()


def test_processes_end_with_the_task_that_nobody_has_closed():
    task = build_task("gym:CartPole-v1", 2, settings_of("gym:CartPole-v1", ["vectorization=async"]))
    processes = task.envs.processes
    del task
    gc.collect()
    assert not any(process.is_alive() for process in processes)


def test_closing_it_closes_each_environment():
    closed = []
    task = build_task("gym:Corridor-v0", 2)
    for env in task.envs.envs:
        env.unwrapped.close = lambda: closed.append(True)
    task.close()
    task.close()
    assert closed == [True, True]


def test_an_environment_that_cannot_be_closed_is_told_of_and_costs_nothing():
    def refuse():
        raise RuntimeError("window gone")

    task = build_task("gym:Corridor-v0", 1)
    task.envs.envs[0].unwrapped.close = refuse
    with pytest.warns(UserWarning, match="not closed: RuntimeError: window gone"):
        task.close()


@pytest.mark.parametrize("how", ["sync", "async"])
def test_an_environment_that_renders_nothing_says_so(how):
    task = build_task("gym:Faulty-v0", 2, settings_of("gym:Faulty-v0", [f"vectorization={how}"]))
    task.reset(1)
    try:
        with pytest.raises(NotImplementedError, match="gym:Faulty-v0: renders no rgb_array"):
            task.top_view(1)
    finally:
        task.close()


def test_a_reset_of_some_rows_seeds_these_alone():
    def third_starts():
        task = build_task("gym:CartPole-v1", 3)
        task.reset([1, 2, 3])
        task.reset([9, 9, 9], np.array([True, False, False]))
        task.begin(np.array([False, True, True]))
        return task.buffers.observations.numpy().copy()

    theirs = SyncVectorEnv([lambda: gymnasium.make("CartPole-v1")] * 3, autoreset_mode=AutoresetMode.DISABLED)
    theirs.reset(seed=[1, 2, 3])
    theirs.reset(seed=[9, None, None], options={"reset_mask": np.array([True, False, False])})
    expected, _ = theirs.reset(options={"reset_mask": np.array([False, True, True])})
    assert np.array_equal(third_starts(), expected)
