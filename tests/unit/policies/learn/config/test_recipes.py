import pytest

from common.config.yaml_locations import ConfigError
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe, recipe_names
from policies.tasks.catalogue import CATALOGUE, task_settings

FOR_ANY = {"gym", "gym-sac", "own"}  # task, that the command names


@pytest.mark.parametrize("name", recipe_names())
def test_every_recipe_loads_without_a_warning_for_a_task_that_exists(name):
    loaded = load_config(recipe(name))
    assert loaded.warnings == ()
    env = loaded.config.env_settings
    if name in FOR_ANY:
        assert env.env_path is None
        return
    assert env.env_path in CATALOGUE
    task_settings(env.env_path, dict(argument.split("=", 1) for argument in env.env_args))


def test_a_recipe_is_found_by_its_task_and_by_its_own_name():
    assert recipe("RollerBall") == recipe("roller-ball")


def test_the_tutorial_has_its_numbers():
    behavior = load_config(recipe("roller-ball-tutorial")).config.behavior
    params = behavior.hyperparameters
    assert (params.batch_size, params.buffer_size, params.learning_rate) == (10, 100, 3e-4)
    assert (params.beta, params.lambd, params.num_epoch) == (5e-4, 0.99, 3)
    assert (behavior.network_settings.num_layers, behavior.network_settings.hidden_units) == (2, 128)
    assert behavior.reward_signals.extrinsic.gamma == 0.99


def test_an_unknown_recipe_is_refused_with_the_names_of_the_others():
    with pytest.raises(ConfigError, match=r"Submarine: there is no recipe of this name; there are .*roller-ball"):
        recipe("Submarine")
