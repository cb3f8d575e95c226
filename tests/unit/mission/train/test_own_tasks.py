"""`honeyguide train`, `eval`, `play` and `export` on tasks of the user's own and on environments of Gymnasium."""

import multiprocessing
import os
import re
import shlex
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime
import pytest
import yaml

from policies.learn.config import recipes
from policies.learn.evaluate import evaluate
from policies.learn.export.policy_file import load_policy
from policies.tasks import catalogue
from tests.documents import ROOT, blocks
from tests.unit.mission.train.training_run import honeyguide

MODULE = """
import numpy as np

from policies.tasks.layout import Element
from policies.tasks.roller_ball import RollerBall


class GentleBall(RollerBall):
    added = (Element("distance", "m"),)

    def observe(self, frames):
        return np.linalg.norm(frames[:, 0:3] - frames[:, 3:6], axis=1, keepdims=True)

    def reward(self, decision):
        return decision.rewards - 0.01 * np.square(decision.actions).sum(axis=1)


class NoTask:
    pass
"""
LIGHTS = """
import gymnasium
import numpy as np


class Lights(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(0, 255, (32, 32, 3), np.uint8)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return self.seen(), {}

    def step(self, action):
        reward, self.steps = float(action == self.is_on), self.steps + 1
        return self.seen(), reward, False, self.steps == 10, {}

    def seen(self):
        self.is_on = int(self.np_random.integers(2))
        return np.full((32, 32, 3), 200 if self.is_on else 20, np.uint8)


gymnasium.register("Lights-v0", entry_point=Lights)
"""
FAULTS = """
import numpy as np

from lights import Lights, gymnasium
from policies.tasks.gym_task import GymTask
from policies.tasks.layout import Element
from policies.tasks.roller_ball import RollerBall


class Unpaid(Lights):
    def step(self, action):
        seen, _, *rest = super().step(action)
        return seen, np.nan, *rest


class NanPaid(RollerBall):
    def reward(self, decision):
        return decision.rewards * np.nan


class NoSuchOutcome(RollerBall):
    def outcome(self, decision):
        return np.full(len(decision.rewards), 42)


class Unobserved(RollerBall):
    added = (Element("distance", "m"),)


class Nameless(GymTask):
    pass


gymnasium.register("Unpaid-v0", entry_point=Unpaid, disable_env_checker=True)
"""
FEW = {"hyperparameters": {"batch_size": 128, "buffer_size": 512}, "network_settings": {"hidden_units": 16}}


@pytest.fixture(autouse=True)
def own_module(tmp_path, monkeypatch):
    """A folder with a module of the user's, which is where they work."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "own_tasks.py").write_text(MODULE)
    yield
    for module in ("own_tasks", "lights", "faults"):
        sys.modules.pop(module, None)
    for env_id in ("Lights-v0", "Unpaid-v0"):
        gymnasium.registry.pop(env_id, None)


def config(max_steps=1000, network=None, **settings):
    behavior = {"trainer_type": "ppo", **FEW, "max_steps": max_steps, "summary_freq": 512}
    behavior["network_settings"] = FEW["network_settings"] | (network or {})
    block = {"behaviors": {"Own": behavior}, "env_settings": {"num_areas": 8, **settings}}
    Path("few.yaml").write_text(yaml.safe_dump(block), encoding="utf-8")
    return "few.yaml"


def trained(*words):
    result = honeyguide("train", *words, "--seed", "1")
    assert result.exit_code == 0, result.output
    return result.output


def test_a_task_of_ones_own_is_trained_judged_shown_and_exported():
    trained(config(), "--env", "own_tasks:GentleBall", "--run-id", "gentle")
    policy, card = load_policy(Path("results/gentle/Own.pt"))
    assert card.task == "own_tasks:GentleBall"
    assert policy.layout.frame[-1].name == "distance"
    result = honeyguide("eval", "gentle", "--task", "own_tasks:GentleBall", "--episodes", "20")
    assert result.exit_code == 0, result.output
    assert "success rate" in result.output
    result = honeyguide("play", "own_tasks:GentleBall", "--policy", "gentle", "--episodes", "1", "--mp4", "own.mp4")
    assert result.exit_code == 0, result.output
    assert Path("own.mp4").stat().st_size > 0
    assert honeyguide("export", "gentle").exit_code == 0


def test_the_tutorial(tmp_path, monkeypatch):
    """Its first block is the module, and its commands are run, with few steps in the recipes."""
    page = ROOT / "docs/how-to/own-task.md"
    Path("my_tasks.py").write_text(blocks(page, "python")[0], encoding="utf-8")
    for recipe in (ROOT / "policies/recipes").glob("*.yaml"):
        short = re.sub("max_steps: .*", "max_steps: 2000", recipe.read_text(encoding="utf-8"))
        (tmp_path / recipe.name).write_text(short, encoding="utf-8")
    monkeypatch.setattr(recipes, "_folder", lambda: tmp_path)
    lines = [shlex.split(line)[1:] for block in blocks(page, "sh") for line in block.splitlines()]
    assert len(lines) == 8
    for words in lines:
        result = honeyguide(*words, *(["--episodes", "2"] if words[0] != "train" else []))
        assert result.exit_code == 0, result.output
    assert Path("gentle.mp4").exists()
    assert Path("pole.mp4").exists()
    sys.modules.pop("my_tasks")


def test_a_file_alone_runs_no_code_of_a_module_that_it_names():
    trained(config(512), "--env", "own_tasks:GentleBall", "--run-id", "gentle")
    sys.modules.pop("own_tasks")
    for command in (("eval", "gentle"), ("play", "gentle", "--mp4", "a.mp4")):
        result = honeyguide(*command)
        assert result.exit_code == 2
        assert "whose code is not run because a file names it: name it yourself, as" in result.stderr
        assert "own_tasks:GentleBall" in result.stderr
    assert "own_tasks" not in sys.modules


def test_an_environment_of_gymnasium_is_trained_judged_shown_and_exported():
    output = trained(config(), "--gym", "CartPole-v1", "--run-id", "pole")
    assert "success" not in output  # nobody says whether an episode was one
    result = honeyguide("eval", "pole", "--episodes", "10")
    assert result.exit_code == 0, result.output
    assert "success" not in result.output
    assert "ended" in result.output
    result = honeyguide("play", "pole", "--episodes", "1", "--mp4", "pole.mp4")
    assert result.exit_code == 0, result.output
    result = honeyguide("play", "gym:CartPole-v1", "--random", "--episodes", "1", "--mp4", "chance.mp4")
    assert result.exit_code == 0, result.output
    network = onnxruntime.InferenceSession("results/pole/Own.onnx")
    inputs = {"obs_0": np.zeros((1, 4), np.float32), "action_masks": np.ones((1, 2), np.float32)}
    outputs = network.run(["deterministic_discrete_actions"], inputs)
    assert outputs[0].ravel()[0] in {0, 1}


def test_an_environment_that_shows_an_image_alone_is_learned():
    Path("lights.py").write_text(LIGHTS, encoding="utf-8")
    network = {"vis_encode_type": "compact", "normalize": True}
    trained(config(6000, network), "--gym", "lights:Lights-v0", "--run-id", "lights")
    result = honeyguide("eval", "lights", "--task", "gym:lights:Lights-v0", "--episodes", "10")
    assert result.exit_code == 0, result.output
    assert re.search(r"mean reward\W+10\.0", result.output)  # the button of every light
    result = honeyguide("eval", "lights")
    assert result.exit_code == 2
    assert "name it yourself, as --task gym:lights:Lights-v0" in result.stderr


def test_its_arguments_are_settings_that_the_policy_remembers():
    trained(config(512), "--gym", "Pendulum-v1", "--env-args", "g=2.5", "--run-id", "moon")
    assert load_policy(Path("results/moon/Own.pt"))[1].settings["g"] == 2.5
    result = honeyguide("eval", "moon", "--episodes", "3")
    assert "g=2.5" in result.output


def test_a_run_is_resumed():
    trained(config(512), "--gym", "CartPole-v1", "--run-id", "pole")
    output = trained(config(2000), "--gym", "CartPole-v1", "--run-id", "pole", "--resume")
    assert "2,048 steps" in output


def test_names_alone_take_the_recipes_for_them(monkeypatch):
    from mission.train import training

    def chosen(*words):
        shown = []
        monkeypatch.setattr(training, "train", lambda config, _watcher: shown.append(config) or pytest.skip())
        with pytest.raises(pytest.skip.Exception):
            raise honeyguide("train", *words).exception
        return shown[0]

    run = chosen("--gym", "CartPole-v1")
    assert (run.env_settings.env_path, run.checkpoint_settings.run_id) == ("gym:CartPole-v1", "cart-pole-v1")
    assert run.env_settings.env_count == 16
    run = chosen("gym-sac", "--gym", "Pendulum-v1")
    assert (run.env_settings.env_path, run.behavior.trainer_type) == ("gym:Pendulum-v1", "sac")
    run = chosen("own_tasks:GentleBall")
    assert (run.env_settings.env_path, run.checkpoint_settings.run_id) == ("own_tasks:GentleBall", "gentle-ball")
    assert run.env_settings.env_count == 512
    run = chosen("roller-ball", "--env", "own_tasks:GentleBall")
    assert (run.env_settings.env_path, run.behavior.success_target) == ("own_tasks:GentleBall", 0.99)


def test_tasks_of_installed_packages_are_called_by_their_names(monkeypatch):
    entries = (EntryPoint("Gentle", "own_tasks:GentleBall", catalogue.ENTRY_POINTS),)
    monkeypatch.setattr(catalogue, "entry_points", lambda group: entries if group == catalogue.ENTRY_POINTS else ())
    trained(config(512), "--env", "Gentle", "--run-id", "package")
    assert honeyguide("eval", "package", "--episodes", "5").exit_code == 0  # an installed package's name is no code
    result = honeyguide("train", "Gentler")
    assert result.exit_code == 2
    result = honeyguide("demonstrate", "Gentler", "--out", "x")
    assert "there are RollerBall" in result.stderr
    assert "Gentle," in result.stderr


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["nothing_here:Task"], "nothing_here:Task: there is no module nothing_here"),
        (["own_tasks:Nope"], "own_tasks:Nope: own_tasks has no Nope"),
        (["own_tasks:NoTask"], "own_tasks:NoTask: is no task: it must be a subclass of policies.tasks.task.Task"),
        (["--gym", "Nope-v1"], "gym:Nope-v1: Environment `Nope` doesn't exist"),
        (["gym:Blackjack-v2"], "gym:Blackjack-v2: Environment version"),
        (["--gym", "CartPole-v1", "--env-args", "speed=3"], "gym:CartPole-v1: cannot be made"),
        (["--gym", "CartPole-v1", "--env", "RollerBall"], "--gym: not with --env"),
        (["own_tasks:GentleBall", "--env-args", "speed=3"], "own_tasks:GentleBall: speed: no such setting"),
        (["own"], "give --env, one of RollerBall"),
        ([], "give a task, a recipe, a .yaml file, or --gym"),
    ],
)
def test_what_cannot_be_trained_is_refused_in_one_sentence(words, says):
    result = honeyguide("train", *words)
    assert result.exit_code == 2, result.output
    assert says in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not Path("results").exists()


def test_a_task_without_a_view_is_told_before_a_film_is_begun():
    Path("own_tasks.py").write_text(
        MODULE + "\nclass Unseen(RollerBall):\n    def top_view(self, i_env, height_px=480):\n"
        "        raise NotImplementedError('Unseen: draws no view of itself')\n"
    )
    result = honeyguide("play", "own_tasks:Unseen", "--random", "--mp4", "a.mp4")
    assert result.exit_code == 2
    assert "Unseen: draws no view of itself" in result.stderr
    assert not Path("a.mp4").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--gym", "faults:Unpaid-v0"), "gym:faults:Unpaid-v0: a reward is not finite"),
        (("--env", "faults:NanPaid"), "reward: must return finite numbers"),
        (("--env", "faults:NoSuchOutcome"), "outcome: must return Outcome numbers, 0 to 8, not 42"),
        (("--env", "faults:Unobserved"), "Unobserved: elements are added, but there is no method observe"),
        (("--env", "faults:Nameless"), "Nameless: names no env_id, the ID of its environments"),
        (("--gym", "FrozenLake-v1", "--env-args", "map_name=9x9"), "gym:FrozenLake-v1: cannot be made: KeyError"),
    ],
)
def test_faults_of_tasks_of_ones_own_end_a_training_with_one_sentence(words, says):
    Path("lights.py").write_text(LIGHTS, encoding="utf-8")
    Path("faults.py").write_text(FAULTS, encoding="utf-8")
    result = honeyguide("train", config(600, {"vis_encode_type": "compact"}), *words, "--run-id", "faulty")
    assert result.exit_code == 2, result.output
    assert says in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not Path("results/faulty/Own.pt").exists()


def test_processes_are_ended_with_what_they_were_made_for(capfd):
    pole = ("--gym", "CartPole-v1", "--env-args", "vectorization=async")
    trained(config(512, num_areas=2), *pole, "--run-id", "pole")
    assert not multiprocessing.active_children()
    most = []
    policy, card = load_policy(Path("results/pole/Own.pt"))
    settings = catalogue.settings_of(card.task, [], card.settings)
    evaluate(
        policy,
        card.task,
        settings,
        episodes=20,
        seed=1,
        progress=lambda _: most.append(len(multiprocessing.active_children())),
    )
    assert max(most) == min(20, len(os.sched_getaffinity(0)))
    assert not multiprocessing.active_children()
    result = honeyguide("play", "gym:CartPole-v1", "--env-args", "vectorization=async", "--random", "--mp4", "a.mp4")
    assert result.exit_code == 0, result.output
    assert not multiprocessing.active_children()
    assert "Traceback" not in capfd.readouterr().err


def test_an_environment_that_renders_nothing_is_told_before_a_film_is_begun():
    Path("lights.py").write_text(LIGHTS, encoding="utf-8")
    result = honeyguide("play", "gym:lights:Lights-v0", "--random", "--mp4", "a.mp4")
    assert result.exit_code == 2
    assert "gym:lights:Lights-v0: renders no rgb_array" in result.stderr
    assert not Path("a.mp4").exists()
