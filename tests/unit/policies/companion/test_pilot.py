"""Which policies may fly."""

import numpy as np
import pytest
import torch

from policies.companion.belief import IN_VIEW, PLACE
from policies.companion.pilot import LAYOUT_VERSION, TASK, PilotError, load_pilot
from policies.experts.follower import ScriptedFollower
from policies.learn.config.network import NetworkSettings
from policies.learn.export.policy_file import PolicyCard, save_policy
from policies.learn.networks.policy import Policy
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.follow_me import _layout
from policies.tasks.follow_me.observe import EGO, EGO_BLIND, IMAGE_CHANNELS, IMAGE_SIZE, vector_elements
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.layout import ImageElement, Layout

IMAGE = ImageElement(IMAGE_SIZE, IMAGE_SIZE, IMAGE_CHANNELS)


def policy_file(folder, *, task=TASK, version=LAYOUT_VERSION, kind=EGO, actions=ACTIONS, image=IMAGE, layout=None):
    layout = layout or Layout(task, version, vector_elements(int(kind)), actions, image=image)
    return saved(folder, policy(layout), task)


def policy(layout, perceives=()):
    settings = NetworkSettings.model_validate(
        {
            "hidden_units": 16,
            "num_layers": 1,
            "memory": {"memory_size": 16, "sequence_length": 8},
            "perceives": [*perceives],
        }
    )
    return Policy(layout, settings, torch.Generator().manual_seed(1))


def saved(folder, made, task=TASK):
    path = folder / "policy.pt"
    save_policy(path, made, PolicyCard(task, {}, 0, 0))
    return path


def believer(folder, preset="improved", position=(3.0, -1.0, 1.5), in_view=5.0):
    """A pilot that always believes the same: the owner at a place [m], in view with these log odds."""
    layout = _layout(FollowSettings(preset=preset))
    made = policy(layout, (IN_VIEW, *PLACE))
    scales = [next(e.scale for e in layout.privileged if e.name == name) for name in PLACE]
    with torch.no_grad():
        made.perception.layer.weight.zero_()
        made.perception.layer.bias[:4] = torch.tensor([in_view, *np.divide(position, scales)])
    return load_pilot(str(saved(folder, made)))


def shown(pilot, image=100):
    pilot.act(np.zeros(len(vector_elements(pilot.kind)), np.float32), np.full(pilot.image_shape, image, np.uint8))
    return pilot.owner_hfrd


def test_the_owner_is_where_the_policy_believes_them_to_be(tmp_path):
    pilot = believer(tmp_path)
    assert pilot.owner_hfrd is None
    assert shown(pilot) == pytest.approx((3.0, -1.0, 1.5))
    pilot.reset()
    assert pilot.owner_hfrd is None


def test_an_owner_believed_out_of_sight_is_nowhere(tmp_path):
    assert shown(believer(tmp_path, in_view=-0.1)) is None


def test_a_policy_without_beliefs_goes_by_the_shirt(tmp_path):
    pilot = load_pilot(str(policy_file(tmp_path)))
    assert shown(pilot) is None
    image = np.full(pilot.image_shape, 100, np.uint8)
    image[28:36, 28:36] = (20, 40, 120, 85)  # in the middle of a camera that looks 10 degrees down; 85: 2 m away
    pilot.act(np.zeros(len(vector_elements(pilot.kind)), np.float32), image)
    ahead, right, down = pilot.owner_hfrd
    assert (ahead, right, down) == pytest.approx((2.1, 0.0, 0.55), abs=0.06)


@pytest.mark.parametrize("kind", [EGO, EGO_BLIND])
def test_a_policy_of_the_task_flies_and_remembers(tmp_path, kind):
    pilot = load_pilot(str(policy_file(tmp_path, kind=kind)))
    assert pilot.kind == int(kind)
    vector = np.full(len(vector_elements(int(kind))), 0.1, np.float32)
    image = np.full(pilot.image_shape, 100, np.uint8)
    first = pilot.act(vector, image)
    second = pilot.act(vector, image)
    pilot.reset()
    assert first.shape == (4,)
    assert not np.array_equal(first, second)
    assert np.array_equal(first, pilot.act(vector, image))


@pytest.mark.parametrize("preset", ["improved", "vision-only"])
def test_what_the_task_shows_is_what_the_pilot_takes(tmp_path, preset):
    assert load_pilot(str(policy_file(tmp_path, layout=_layout(FollowSettings(preset=preset)))))


@pytest.mark.parametrize("settings", [{"preset": "as-documented"}, {"observation": "state"}])
def test_what_a_companion_cannot_know_or_say_is_refused(tmp_path, settings):
    with pytest.raises(PilotError, match="made for another task or preset"):
        load_pilot(str(policy_file(tmp_path, layout=_layout(FollowSettings(**settings)))))


def test_scripted_needs_no_file():
    assert isinstance(load_pilot("scripted"), ScriptedFollower)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"task": "Parking1"}, "made for Parking1"),
        ({"version": LAYOUT_VERSION + 1}, "layout version"),
        ({"actions": ACTIONS[:3]}, "continuous actions"),
        ({"image": None}, "image"),
    ],
)
def test_other_policies_are_refused_in_one_sentence(tmp_path, changes, sentence):
    path = policy_file(tmp_path, **changes)
    with pytest.raises(PilotError, match=sentence) as refusal:
        load_pilot(str(path))
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_file_that_is_not_there_is_refused():
    with pytest.raises(PilotError, match="no such policy file"):
        load_pilot("nowhere.pt")


def test_a_file_that_is_no_policy_is_refused(tmp_path):
    path = tmp_path / "policy.pt"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(PilotError, match="damaged"):
        load_pilot(str(path))


def test_a_policy_without_images_is_told_its_last_frames_and_none_after_a_reset(tmp_path):
    layout = _layout(FollowSettings(observation="tracked", stack=3))
    pilot = load_pilot(str(saved(tmp_path, policy(layout))))
    size = layout.observation_size // 3
    image, told = np.zeros(pilot.image_shape, np.uint8), []

    def listening(observation, memory):
        told.append(observation.vector[0].numpy()[::size].tolist())
        return act(observation, memory)

    act, pilot._policy.act = pilot._policy.act, listening
    for k in (1.0, 2.0, 3.0, 4.0):
        pilot.act(np.full(size, k, np.float32), image)
    pilot.reset()
    pilot.act(np.full(size, 5.0, np.float32), image)
    assert told == [[0.0, 0.0, 1.0], [0.0, 1.0, 2.0], [1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [0.0, 0.0, 5.0]]
