"""How often episodes of the hardened followers are without depth, among others, or with a phone that is silent."""

import numpy as np
import pytest

from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.curriculum import Curriculum
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_params import FollowParams

ENVS = 512


@pytest.fixture(scope="module", params=["follow-me-late", "follow-me-tracked"])
def drawn(request):
    """The numbers of the first episodes of a recipe's training, a row each; its images are not drawn."""
    config = load_config(recipe(request.param)).config
    settings = dict(argument.split("=", 1) for argument in config.env_settings.env_args)
    is_tracked = settings.get("observation") == "tracked"
    cheap = {"has_estimator": "false", "airframe": "x500"} | ({} if is_tracked else {"observation": "state"})
    task = build_task("FollowMe", ENVS, task_settings("FollowMe", settings | cheap))
    assert isinstance(task, FollowMe)
    task.set_params(Curriculum(config.environment_parameters).params())
    task.reset(3)
    return request.param, {name: task.follow.params.numpy()[name] for name in FollowParams.vars}


def test_others_are_about_in_half_of_the_episodes_all_three_in_some(drawn):
    _, numbers = drawn
    assert np.mean(numbers["bystanders"] >= 0.5) == pytest.approx(0.5, abs=0.07)
    assert np.mean(numbers["bystanders"] >= 2.5) > 0.05


def test_no_depth_short_depth_and_images_late_are_all_met(drawn):
    _, numbers = drawn
    assert np.mean(numbers["depth_max_m"] <= 1.0) > 0.08
    assert np.mean((numbers["depth_max_m"] > 1.0) & (numbers["depth_max_m"] < 15.0)) > 0.4
    assert np.mean(numbers["image_lag_s"] > 0.1) > 0.3


def test_a_phone_is_usual_in_half_of_the_episodes_and_silent_for_long_in_a_quarter(drawn):
    name, numbers = drawn
    is_heard = name == "follow-me-late"  # a tracker is told nothing of a phone: its is the usual one
    assert np.mean(numbers["phone_error"] > 1.5) == pytest.approx(0.45 * is_heard, abs=0.07)
    assert np.mean(numbers["phone_dropout_scale"] > 5.0) == pytest.approx(0.25 * is_heard, abs=0.06)
