import gymnasium
import numpy as np
import pytest

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.layout import Layout, LayoutError
from policies.tasks.task_params import NumberError, Sampler

NAME = "RollerBall"


def stepped(env_count, seed, count, settings=None):
    """Observations, rewards and outcomes of `count` steps with actions that each row derives from its observation."""
    task = build_task(NAME, env_count, settings)
    task.reset(seed)
    seen = []
    for _ in range(count):
        observations = task.buffers.observations.numpy()
        task.buffers.continuous.numpy()[:] = np.sin(observations[:, -2:] * 7.0 + 1.0)
        task.step()
        seen.append((observations.copy(), task.buffers.rewards.numpy().copy(), task.buffers.outcomes.numpy().copy()))
    return [np.stack(parts) for parts in zip(*seen, strict=True)]


def test_the_same_seed_gives_the_same_bytes():
    for a, b in zip(stepped(32, 5, 100), stepped(32, 5, 100), strict=True):
        assert a.tobytes() == b.tobytes()


def test_a_row_does_not_depend_on_who_else_is_in_the_batch():
    few, many = stepped(3, 5, 100)[0], stepped(64, 5, 100)[0]
    assert few.tobytes() == many[:, :3].tobytes()


def test_a_restored_task_continues_bit_for_bit():
    task = build_task(NAME, 8)
    task.reset(2)
    task.buffers.continuous.numpy()[:] = 0.3
    for _ in range(10):
        task.step()
    state = task.state()
    ends = []
    for _ in range(2):
        task.load_state(state)
        for _ in range(20):
            task.step()
        ends.append(task.state())
    assert all(ends[0][name].tobytes() == ends[1][name].tobytes() for name in ends[0])


def test_beginning_one_row_touches_only_that_row():
    task = build_task(NAME, 4)
    task.reset(2)
    before = task.state()
    task.begin(np.array([False, True, False, False]))
    after = task.state()
    assert after["episodes"].tolist() == [1, 2, 1, 1]
    for name in ("observations", "target", "numbers"):
        assert np.array_equal(before[name][[0, 2, 3]], after[name][[0, 2, 3]])
    assert not np.array_equal(before["target"][1], after["target"][1])


def test_stacked_frames_hold_the_last_observations_oldest_first_after_zeros():
    task = build_task(NAME, 1, task_settings(NAME, {"stack": 3}))
    task.reset(1)
    task.buffers.continuous.numpy()[:] = 0.5
    frames = [task.buffers.observations.numpy()[0, -8:].copy()]
    assert not task.buffers.observations.numpy()[0, :16].any()
    for _ in range(2):
        task.step()
        frames.append(task.buffers.observations.numpy()[0, -8:].copy())
    assert np.array_equal(task.buffers.observations.numpy()[0], np.concatenate(frames))


def test_numbers_are_drawn_anew_for_each_episode_from_their_samplers():
    task = build_task(NAME, 4096)
    task.set_params(
        {
            "mass_kg": Sampler(intervals=((0.5, 1.0), (2.0, 3.0))),
            "force_n": Sampler(mean=10.0, st_dev=1.0),
            "reach_m": 1.5,
        }
    )
    task.reset(0)
    mass, force, *_ = task.buffers.params.numpy().T
    is_low = mass <= 1.0
    assert ((mass >= 0.5) & is_low | (mass >= 2.0) & (mass <= 3.0)).all()
    assert abs(is_low.mean() - 1 / 3) < 0.03  # 4 sigma of 4,096 draws
    assert abs(force.mean() - 10.0) < 0.07
    assert abs(force.std() - 1.0) < 0.05
    assert (task.buffers.params.numpy()[:, task.param_table.names.index("reach_m")] == 1.5).all()


def test_a_number_that_does_not_exist_or_is_out_of_bounds_is_refused_in_one_sentence():
    task = build_task(NAME, 1)
    with pytest.raises(NumberError, match="weight: this task has no such number"):
        task.set_params({"weight": 1.0})
    with pytest.raises(NumberError, match="mass_kg: 900 is not between"):
        task.set_params({"mass_kg": Sampler(intervals=((1.0, 900.0),))})


def test_unknown_tasks_and_settings_are_refused_by_name():
    with pytest.raises(UnknownTask, match="RollerBalls: no such task; there are RollerBall"):
        build_task("RollerBalls", 1)
    with pytest.raises(UnknownTask, match="RollerBall: speed"):
        task_settings(NAME, {"speed": 3})


def test_a_layout_survives_its_record_and_refuses_another():
    layout = build_task(NAME, 1).layout
    assert Layout.from_record(layout.record()) == layout
    other = build_task(NAME, 1, task_settings(NAME, {"stack": 2})).layout
    with pytest.raises(
        LayoutError, match=r"ball\.pt: made for another task or preset: stacked frames is 2 there and 1 here"
    ):
        layout.require(other, "ball.pt")


def test_the_batch_gives_the_last_observation_of_an_episode_that_ended_and_begins_the_next():
    envs = gymnasium.make_vec("honeyguide/RollerBall-v0", num_envs=8)
    envs.reset(seed=0)
    while True:
        observations, _, is_terminated, _, info = envs.step(np.ones((8, 2)))
        if is_terminated.any():
            break
    i = int(np.flatnonzero(info["_final_obs"])[0])
    assert not np.array_equal(info["final_obs"][i], observations[i])


def test_a_single_environment_carries_over_what_the_task_does():
    env = gymnasium.make("honeyguide/RollerBall-v0").unwrapped
    observation, _ = env.reset(seed=3)
    is_over = False
    while not is_over:
        ball, cube = observation[[3, 5]], observation[[0, 2]]
        action = np.clip(0.5 * (cube - ball) - 0.5 * observation[6:8], -1.0, 1.0)
        observation, _, is_over, _, info = env.step(action)
    assert info["outcome"] == "success"
    next_observation, _ = env.reset()
    assert next_observation[3:].tolist() == observation[3:].tolist()  # the ball rolls on
    assert next_observation[:3].tolist() != observation[:3].tolist()
    assert env.reset()[0][[3, 5]].tolist() == [0.0, 0.0]  # given up: placed anew


@pytest.mark.parametrize(
    ("name", "action"),
    [("Parking1", 3), ("Parking1", -1), ("Parking2", [0, 2]), ("RollerBall", [np.nan, 0.0])],
)
def test_actions_outside_their_space_are_refused(name, action):
    env = gymnasium.make(f"policies:honeyguide/{name}-v0").unwrapped
    observation, _ = env.reset(seed=1)
    with pytest.raises(ValueError, match=r"^action: "):
        env.step(action)
    assert env.task.buffers.observations.numpy()[0].tolist() == observation.tolist()  # nothing has moved


@pytest.mark.parametrize("name", ["RollerBall", "ReachTarget", "Parking1", "Parking2"])
def test_presets_and_splits_that_do_not_exist_are_refused(name):
    with pytest.raises(UnknownTask, match=r"split: must be train(, validation)? or test"):
        task_settings(name, {"split": "all"})
    with pytest.raises(UnknownTask, match="preset: must be as-documented, as-coded or improved"):
        task_settings(name, {"preset": "as-dreamt"})
