"""What only the task can say of a configuration: whether it has these settings and numbers, and can learn in this way.

In: a configuration, and where its keys stand. Out: nothing, or one sentence with file, line and key, before a run
begins; every lesson is looked at, so that none is refused hours later.
"""

from collections.abc import Iterator
from contextlib import closing, contextmanager

from policies.learn.algorithms.teacher import load_teacher
from policies.learn.config.behavior import Behavior, DaggerHyperparameters, PpoHyperparameters
from policies.learn.config.environment import Curriculum, lessons_of
from policies.learn.config.load import Loaded
from policies.learn.config.signals import GailSettings
from policies.learn.export.policy_path import CheckpointError
from policies.learn.networks.perception import require_privileged
from policies.learn.networks.vision import LEAST_SIDES
from policies.learn.rollout.demonstrations import DemonstrationError, check_demonstrations, check_settings
from policies.tasks.catalogue import UnknownTask, build_task, settings_of, task_settings
from policies.tasks.layout import Layout, LayoutError
from policies.tasks.task import Task
from policies.tasks.task_params import NumberError


def check_against_task(loaded: Loaded) -> None:
    """Refuses what the task that is named has not.

    Raises:
        ConfigError: `FILE:LINE: key: …`, or the flag.
    """
    name = loaded.config.env_settings.env_path or ""
    with _refused_at(loaded, "env_settings", "env_path"):
        task_settings(name, {})
    with _refused_at(loaded, "env_settings", "env_args"):
        task = build_task(name, 1, settings_of(name, loaded.config.env_settings.env_args))
    with closing(task):
        for loc, sentence in _unseen(loaded.config.behavior, task.layout):
            raise loaded.error(("behaviors", loaded.config.behavior_name, *loc), sentence)
        _check_params(loaded, task)
        _check_demonstrations(loaded, task)
        _check_teacher(loaded, task)


def _unseen(behavior: Behavior, layout: Layout) -> Iterator[tuple[tuple[str, ...], str]]:
    """What the networks would have to see and cannot: keys below the behaviour, and what is wrong with each."""
    hyperparameters, kind = behavior.hyperparameters, behavior.network_settings.vis_encode_type
    if isinstance(hyperparameters, PpoHyperparameters) and hyperparameters.privileged_critic and not layout.privileged:
        yield ("hyperparameters", "privileged_critic"), f"{layout.task} as it is set has no privileged elements"
    if layout.image is None:
        return
    height, width, _ = layout.image.shape
    least = LEAST_SIDES[kind]
    if min(height, width) < least:
        sentence = f"{kind} needs images of {least} x {least} at least; those of {layout.task} are {height} x {width}"
        yield ("network_settings", "vis_encode_type"), sentence
    blind = f"sees no images, and {layout.task} as it is set shows one"
    if behavior.trainer_type == "sac":
        yield ("trainer_type",), f"sac {blind}"
    for name in behavior.reward_signals.in_use:
        if name != "extrinsic":
            yield ("reward_signals", name), blind
    if behavior.behavioral_cloning is not None:
        yield ("behavioral_cloning",), blind


def _check_params(loaded: Loaded, task: Task) -> None:
    for name, parameter in loaded.config.environment_parameters.items():
        for k, lesson in enumerate(lessons_of(name, parameter)):
            below = ("curriculum", k, "value") if isinstance(parameter, Curriculum) else ()
            with _refused_at(loaded, "environment_parameters", name, *below):
                task.set_params({name: lesson.sampler})


def _check_demonstrations(loaded: Loaded, task: Task) -> None:
    behavior = loaded.config.behavior
    paths: dict[tuple[str, ...], str] = {
        ("reward_signals", name): signal.demo_path
        for name, signal in behavior.reward_signals.in_use.items()
        if isinstance(signal, GailSettings)
    }
    if behavior.behavioral_cloning is not None:
        paths["behavioral_cloning",] = behavior.behavioral_cloning.demo_path
    if behavior.offline is not None:
        with _refused_at(loaded, "behaviors", loaded.config.behavior_name, "offline", "dataset"):
            name, pairs = loaded.config.env_settings.env_path or "", loaded.config.env_settings.env_args
            settings = settings_of(name, pairs).model_dump(mode="json")
            for path in behavior.offline.dataset:
                check_demonstrations(path, task.layout)
                check_settings(path, name, settings)
    for block, path in paths.items():
        with _refused_at(loaded, "behaviors", loaded.config.behavior_name, *block, "demo_path"):
            check_demonstrations(path, task.layout)


def _check_teacher(loaded: Loaded, task: Task) -> None:
    behavior = loaded.config.behavior
    location = ("behaviors", loaded.config.behavior_name)
    with _refused_at(loaded, *location, "network_settings", "perceives"):
        require_privileged(task.layout, behavior.network_settings.perceives)
    if isinstance(behavior.hyperparameters, DaggerHyperparameters):
        with _refused_at(loaded, *location, "hyperparameters", "teacher"):
            load_teacher(behavior.hyperparameters.teacher, task.layout)


@contextmanager
def _refused_at(loaded: Loaded, *loc: int | str) -> Iterator[None]:
    """What the task refuses, with the location of the key that asks for it."""
    try:
        yield
    except (UnknownTask, NumberError, DemonstrationError, LayoutError, CheckpointError) as error:
        raise loaded.error(loc, str(error).removeprefix(f"{loc[1]}: ")) from None
