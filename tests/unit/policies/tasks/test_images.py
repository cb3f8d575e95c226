"""Images of tasks: in the buffers, in layouts, and in Gymnasium. The task is `tests/unit/policies/learn/squares.py`."""

import gymnasium
import numpy as np
import pytest

from policies.tasks.catalogue import CATALOGUE, Entry
from policies.tasks.gym import TaskEnv, TaskVectorEnv
from policies.tasks.layout import Element, ImageElement, Layout, LayoutError
from tests.unit.policies.learn.squares import SIDE, Squares

LAYOUT = Squares(1).layout


@pytest.fixture
def named(monkeypatch):
    """The task in the catalogue."""
    monkeypatch.setitem(CATALOGUE, "Squares", Entry(lambda _settings, count, _device: Squares(count)))


def test_an_image_survives_the_layouts_record():
    assert Layout.from_record(LAYOUT.record()) == LAYOUT


def test_a_layout_that_was_saved_before_there_were_images_has_none():
    record = Layout("T", 1, (Element("a", "1"),)).record()
    del record["image"], record["privileged"]
    assert Layout.from_record(record).image is None


def test_another_image_is_refused_and_other_privileged_elements_are_not():
    frame = (Element("side", "1", is_goal=True),)
    image = ImageElement(SIDE, SIDE, ("red", "green", "blue"))
    smaller = Layout("Squares", 1, frame, LAYOUT.continuous, image=ImageElement(SIDE, 12, ("red",)))
    with pytest.raises(LayoutError, match="image is 32 x 12 of red there and 32 x 32 of red, green, blue here"):
        LAYOUT.require(smaller, "policy")
    with pytest.raises(LayoutError, match="image is none there"):
        LAYOUT.require(Layout("Squares", 1, frame, LAYOUT.continuous), "policy")
    LAYOUT.require(Layout("Squares", 1, frame, LAYOUT.continuous, image=image), "policy")


def test_what_an_episode_saw_last_is_kept_and_the_next_is_shown():
    task = Squares(3)
    task.reset(0)
    buffers = task.buffers
    for t in range(1, 13):
        task.step()
        rows = buffers.images.numpy()[:, 0, 0].astype(int).tolist()
        assert rows == [[i, 1 + t // 4, t % 4] for i in range(3)]
        if t % 4 == 0:
            assert buffers.final_images.numpy()[:, 0, 0].astype(int).tolist() == [[i, t // 4, 4] for i in range(3)]
            assert (buffers.final_privileged.numpy() != buffers.privileged.numpy()).all()


def test_images_are_part_of_the_state():
    task, other = Squares(3), Squares(3)
    task.reset(0)
    other.reset(1)
    task.step()
    other.load_state(task.state())
    assert np.array_equal(other.buffers.images.numpy(), task.buffers.images.numpy())
    assert np.array_equal(other.buffers.final_images.numpy(), task.buffers.final_images.numpy())
    other.buffers.continuous.assign(task.buffers.continuous.numpy())
    task.step()
    other.step()
    assert np.array_equal(other.buffers.images.numpy(), task.buffers.images.numpy())


def test_one_environment_sees_what_the_first_of_many_sees():
    alone, many = Squares(1), Squares(5)
    alone.reset(7)
    many.reset(7)
    for _ in range(6):
        alone.step()
        many.step()
        assert np.array_equal(alone.buffers.images.numpy()[0], many.buffers.images.numpy()[0])


def test_gymnasium_gets_image_and_vector(named):
    env = TaskEnv("Squares")
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    assert observation["image"].shape == (SIDE, SIDE, 3)
    assert observation["image"].dtype == np.uint8
    assert observation["vector"].shape == (1,)
    assert isinstance(env.observation_space, gymnasium.spaces.Dict)


def test_the_batch_gives_the_last_image_of_an_episode_that_ended_and_begins_the_next(named):
    envs = TaskVectorEnv("Squares", num_envs=2)
    observations, _ = envs.reset(seed=0)
    assert observations in envs.observation_space
    for _ in range(4):
        observations, _, _, is_truncated, info = envs.step(np.zeros((2, 1)))
    assert is_truncated.all()
    assert [last["image"][0, 0, 2] for last in info["final_obs"]] == [4, 4]
    assert observations["image"][:, 0, 0, 2].tolist() == [0, 0]
    assert observations["vector"].shape == (2, 1)
