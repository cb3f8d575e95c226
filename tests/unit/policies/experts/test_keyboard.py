"""The keyboard: every action of every task has its keys."""

from typing import get_args

import numpy as np
import pytest

from policies.experts.keyboard import Control, KeyboardDriver, NoKeys
from policies.tasks.catalogue import CATALOGUE, build_task, settings_class
from policies.tasks.layout import Branch, Element, Layout


@pytest.mark.parametrize(
    ("name", "preset"),
    [(n, p) for n in CATALOGUE for p in get_args(settings_class(n).model_fields["preset"].annotation)],
)
def test_every_task_can_be_driven(name, preset):
    task = build_task(name, 2, settings_class(name)(preset=preset))
    driver = KeyboardDriver(task.layout)
    actions = set()
    for control in Control:
        driver.held = {control}
        driver.act(task)
        actions.add((*task.buffers.continuous.numpy()[0], *task.buffers.branches.numpy()[0]))
    assert len(actions) >= 3  # at least left, right and ahead differ


def test_opposite_keys_cancel():
    task = build_task("RollerBall", 1)
    driver = KeyboardDriver(task.layout)
    driver.held = {Control.LEFT, Control.RIGHT, Control.FORWARD}
    driver.act(task)
    np.testing.assert_array_equal(task.buffers.continuous.numpy(), [[0.0, 1.0]])


def test_steering_goes_before_pushing_where_both_are_one_action():
    layout = Layout("Car", 1, (Element("x", "m"),), branches=(Branch("move", ("push", "right", "left")),))
    driver = KeyboardDriver(layout)
    driver.held = {Control.FORWARD, Control.LEFT}
    assert driver._chosen(driver._branches[0]) == 2


@pytest.mark.parametrize(
    "layout",
    [
        Layout("Kite", 1, (), continuous=(Element("pull", "1"),)),
        Layout("Kite", 1, (), branches=(Branch("pull", ("slack", "taut")),)),
    ],
)
def test_action_that_no_key_is_known_for_is_named(layout):
    with pytest.raises(NoKeys, match="Kite: no key is known for its action pull"):
        KeyboardDriver(layout)
