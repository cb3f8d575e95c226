"""Which policies may navigate."""

import numpy as np
import pytest

from policies.companion.pilot import PilotError
from policies.companion.skills.load_skill import load_skill
from policies.companion.skills.navigating import Navigating
from policies.companion.vector_pilot import NAVIGATE, NavigationPilot
from policies.learn.export.policy_file import load_policy
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.layout import Layout
from policies.tasks.navigate.navigate import _layout
from policies.tasks.navigate.observe import LAYOUT_VERSION, RAY_STACK, frame_elements
from policies.tasks.navigate.settings import NavigateSettings
from tests.unit.policies.companion.test_pilot import policy_file

CAMERA = "tcp://127.0.0.1:1"


def layout(**changes):
    fields = {"version": LAYOUT_VERSION, "frame": frame_elements(has_rays=True), "stack": RAY_STACK} | changes
    return Layout(NAVIGATE, fields["version"], fields["frame"], ACTIONS, stack=fields["stack"])


def loaded(path):
    return load_skill(str(path), CAMERA, is_ordered_by_goto=False)


def test_the_shipped_policy_navigates():
    assert isinstance(loaded("navigate"), Navigating)


def test_the_shipped_policy_of_rovers_drives_and_the_drones_flies():
    assert loaded("navigate-rover").drives
    assert not loaded("navigate").drives


def test_what_the_task_shows_is_what_the_pilot_takes(tmp_path):
    path = policy_file(tmp_path, task=NAVIGATE, layout=_layout(NAVIGATE, NavigateSettings(stack=3)))
    assert isinstance(loaded(path), Navigating)


def test_a_pilot_that_is_reset_decides_as_at_the_start():
    path = pretrained(NAVIGATE)
    pilot = NavigationPilot(load_policy(path)[0], str(path))
    vector = np.full(pilot.stack * pilot.frame_size, 0.1, np.float32)
    first = pilot.act(vector)
    pilot.act(vector)
    pilot.reset()
    assert first.shape == (4,)
    assert np.array_equal(first, pilot.act(vector))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"version": 1}, "layout version is 1 there and 2 here"),
        ({"frame": frame_elements(has_rays=True)[:-1]}, "observation size"),
    ],
)
def test_a_policy_of_another_layout_is_refused_in_one_sentence(tmp_path, changes, sentence):
    path = policy_file(tmp_path, task=NAVIGATE, layout=layout(**changes))
    with pytest.raises(PilotError, match=sentence) as refusal:
        loaded(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_policy_on_depth_images_is_refused(tmp_path):
    path = policy_file(tmp_path, task=NAVIGATE, layout=_layout(NAVIGATE, NavigateSettings(observation="depth")))
    with pytest.raises(PilotError, match="made for another task or preset"):
        loaded(path)


def test_a_policy_of_another_task_is_refused(tmp_path):
    with pytest.raises(PilotError, match="made for Parking1; a companion flies policies of FollowMe, Navigate, "):
        loaded(policy_file(tmp_path, task="Parking1"))
