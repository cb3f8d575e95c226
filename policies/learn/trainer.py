"""The training loop: iterations, lessons, curves, checkpoints, and when to stop.

In: a configuration and somebody who watches. Out: a run folder with the trained policy. A run that was killed goes on
from its newest checkpoint bit for bit: all that an iteration depends on is in the checkpoint.
"""

import secrets
from collections import deque
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import torch

from common.clock import wall_time_s
from common.intervals import wilson_interval
from policies.learn import checkpoint
from policies.learn.best_policy import BestPolicy
from policies.learn.build_learner import build_learner, remarks
from policies.learn.checkpoint_compatibility import flat, require_fit, settings_that_must_fit
from policies.learn.config.network import NetworkSettings
from policies.learn.config.run import RunConfig
from policies.learn.curriculum import Curriculum, RecentEpisodes
from policies.learn.evaluate import Evaluation
from policies.learn.export.onnx_export import ParityError, export_policy
from policies.learn.export.policy_file import CHECKPOINT, POLICY, PolicyCard, policy_record, save_policy
from policies.learn.export.policy_path import CheckpointError
from policies.learn.export.provenance import code_record, data_records, teacher_record
from policies.learn.networks.policy import Policy
from policies.learn.processes import check_processes, together
from policies.learn.success_target import target_of
from policies.learn.torch_threads import few_threads
from policies.learn.training_curves import EventFile, Period
from policies.learn.training_run_folder import RunError, RunFolder, starting_point
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.episode import Outcome
from policies.tasks.layout import Layout
from policies.tasks.task import Scores
from policies.tasks.task_params import NumberError

RECENT_EPISODES = 1000  # over which success rate and mean reward are shown
_RATE_ITERATIONS = 20  # over which steps per second are shown


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a training has come."""

    steps: int
    max_steps: int
    steps_per_s: float
    elapsed_s: float  # of training, also before it was resumed
    scores: Scores  # of the last episodes
    says_success: bool = True  # whether the task does

    @property
    def left_s(self) -> float:
        """Until max_steps, at this pace."""
        return max(0, self.max_steps - self.steps) / self.steps_per_s if self.steps_per_s else 0.0

    @property
    def success_rate(self) -> float | None:
        count = self.scores.episode_count
        return self.scores.count(Outcome.SUCCESS) / count if count and self.says_success else None

    @property
    def mean_reward(self) -> float | None:
        count = self.scores.episode_count
        return self.scores.return_sum / count if count else None


class Watcher(Protocol):
    """Who watches a training."""

    @property
    def is_stopped(self) -> bool:
        """Whether the training is to end after this iteration."""
        ...

    def show(self, progress: Progress) -> None:
        """Is called after each iteration."""
        ...

    def note(self, line: str) -> None:
        """Is called when something is worth a line."""
        ...


@dataclass(frozen=True, slots=True)
class Result:
    """What a training came to."""

    end: str  # "max_steps", "success_target" or "stopped"
    progress: Progress
    judged: Evaluation | None  # of the trained policy, if it was held against the success target
    policy: Path
    network: Path


def train(config: RunConfig, watcher: Watcher) -> Result:
    """Trains until max_steps, success_target, or until the watcher stops it.

    Raises:
        RunError: the run exists already, or does not exist, its files cannot be written, or one of its processes ended.
        CheckpointError: a checkpoint cannot be written or read, or is of a run with other settings.
        ExportError: a network cannot be written.
        LayoutError: a checkpoint of another task.
        NumberError: an environment parameter that the task has not.
        UnknownTask, TaskError: no such task, a setting that it has not, or something that nothing can be learnt from.
    """
    try:
        check_processes(config)
        training = Training(config, watcher)
        count = config.torch_settings.processes
        with (
            few_threads(has_images=training.task.layout.image is not None, processes=count),
            together(training.config, training.learner),
        ):
            return training.run()
    except OSError as error:
        folder = RunFolder.of(config).path
        raise RunError(f"{error.filename or folder}: cannot be read or written: {error.strerror}") from error


class Training:
    """One run."""

    def __init__(self, config: RunConfig, watcher: Watcher) -> None:
        """Prepares everything and writes nothing."""
        self.folder = RunFolder.of(config)
        self.behavior = config.behavior
        self.watcher = watcher
        settings = config.checkpoint_settings
        self._is_resumed = settings.resume
        self.folder.check(is_resumed=settings.resume, is_forced=settings.force)
        self.task_name = config.env_settings.env_path or ""
        self.task_settings = settings_of(self.task_name, config.env_settings.env_args)
        newest = self.folder.newest_checkpoint() if settings.resume else None
        content = checkpoint.load(newest, CHECKPOINT) if newest else None
        self.seed = _seed(config, content)
        self.config = config.model_copy(
            update={"env_settings": config.env_settings.model_copy(update={"seed": self.seed})}
        )
        device = _device(config.torch_settings.device or "cpu")
        self.task = build_task(self.task_name, config.env_settings.env_count, self.task_settings, device)
        self.curriculum = Curriculum(config.environment_parameters)
        self._set_params()
        self.learner = build_learner(self.config, self.task, self.seed)
        self.period = Period()
        self.recent = RecentEpisodes(max(RECENT_EPISODES, 2 * self.task.env_count))  # slow episodes count too
        self._elapsed_before_s = 0.0
        self._events_position: dict[str, Any] | None = None
        self._saved: list[dict[str, Any]] = []
        self._parents: list[dict[str, Any]] = []
        self._teacher, self._data = teacher_record(self.behavior), data_records(self.behavior)
        self._target = target_of(self.behavior, self.task_name, self.task_settings)
        self._judged: Evaluation | None = None
        self._best = BestPolicy()
        self._moments: deque[tuple[float, int]] = deque(maxlen=_RATE_ITERATIONS + 1)
        if newest is not None and content is not None:
            self._restore(newest, content)
        elif start := starting_point(config):
            self._initialize(start)

    def run(self) -> Result:
        """Iterates until the end."""
        self.folder.begin(self.config, is_resumed=self._is_resumed)
        self.watcher.note(f"training {self.folder.behavior} on {self.task_name}, seed {self.seed}: {self.folder.path}")
        for line in remarks(self.behavior, self.task.env_count):
            self.watcher.note(line)
        self._begin_s = wall_time_s()
        self._moments.append((self._begin_s, self.learner.steps))
        self._events = EventFile(self.folder.training, self._events_position)
        try:
            end = self._iterate()
            if not self._saved or self._saved[-1]["steps"] != self.learner.steps:
                self._save()
            return self._finish(end)
        finally:
            self._events.close()
            self.task.close()

    def _iterate(self) -> str:
        while self.learner.steps < self.behavior.max_steps:
            before = self.learner.steps
            self._judged = None  # that was another policy
            iteration = self.learner.iterate()
            steps = self.learner.steps
            self.period.add(iteration.scores, iteration.statistics)
            if (evaluation := iteration.evaluation) is not None:
                self.recent.clear()
            self.recent.add(iteration.scores)
            if evaluation is not None and self.behavior.keep_best and self._target is None:
                self._best.offer(self.learner.policy, self._card(), evaluation, (False, evaluation.mean_return))
            self._moments.append((wall_time_s(), steps))
            self.watcher.show(self._progress())
            self._advance(iteration.scores)
            is_reached = _has_passed(before, steps, self.behavior.summary_freq) and self._summarize()
            if is_reached:
                return "success_target"
            if self.watcher.is_stopped:
                return "stopped"
            if _has_passed(before, steps, self.behavior.checkpoint_steps):
                self._save()
        return "max_steps"

    def _advance(self, scores: Scores) -> None:
        """Moves the curriculum on."""
        lines, is_reset = self.curriculum.advance(scores, self.learner.steps / self.behavior.max_steps)
        if not lines:
            return
        self._set_params()
        self.recent.clear()
        for line in lines:
            self.watcher.note(line)
        if is_reset:
            self.learner.restart()

    def _summarize(self) -> bool:
        """Writes one point of each curve; true if the success target is reached."""
        values = self.period.values() | self.curriculum.tags() | {"Is Training": 1.0}
        self.period = Period()
        is_reached = False
        if self._target is not None:
            episodes_seed = (self.seed + self.learner.steps) % 2**31  # another at each summary, and never training's
            self._judged = self._target.judge(self.learner.policy, self.recent, self.curriculum, episodes_seed)
            if self._judged is not None:
                values["Environment/Judged Success Rate"] = self._judged.success_rate
                is_reached = self._target.is_reached(self._judged)
                if self.behavior.keep_best:
                    self._best.offer(self.learner.policy, self._card(), self._judged, self._judged.worth)
        self._events.write(self.learner.steps, values)
        return is_reached

    def _save(self) -> None:
        """Writes a checkpoint and what belongs to it, then removes the oldest."""
        steps = self.learner.steps
        path = checkpoint.checkpoint_path(self.folder.training, self.folder.behavior, steps)
        progress = self._progress()
        entry = {
            "steps": steps,
            "file_path": str(path),
            "reward": progress.mean_reward,
            "success_rate": progress.success_rate,
            "elapsed_s": round(progress.elapsed_s, 3),
        }
        self._saved = [*self._saved, entry][-self.behavior.keep_checkpoints :]
        content = {
            "policy": policy_record(self.learner.policy),
            "card": asdict(self._card()),
            "must_fit": settings_that_must_fit(self.config, self.task_settings),
            "seed": self.seed,
            "learner": self.learner.state(),
            "curriculum": self.curriculum.state(),
            "period": self.period.state(),
            "recent": self.recent.state(),
            "events": self._events.position(),
            "elapsed_s": progress.elapsed_s,
            "saved": self._saved,
            "best": self._best.state(),
        }
        checkpoint.save(path, content, CHECKPOINT)
        self._export(path.with_suffix(".onnx"), self.learner.policy)
        self.folder.write_status(self._status())
        checkpoint.prune(self.folder.training, self.folder.behavior, self.behavior.keep_checkpoints)

    def _finish(self, end: str) -> Result:
        """Writes the trained policy."""
        policy, card, judged = self.learner.policy, self._card(), self._judged
        if self._best.judged is not None:
            policy, card = self._best.restored()
            judged = self._best.judged if self._target is not None else None  # what chose it is no judgement of it
        save_policy(self.folder.policy, policy, card)
        self._export(self.folder.network, policy)
        self.folder.write_status(self._status() | {"end": end})
        return Result(end, self._progress(), judged, self.folder.policy, self.folder.network)

    def _export(self, path: Path, policy: Policy) -> None:
        """The policy as an ONNX network. Hours of training are not given up where rounding drives the two apart."""
        try:
            export_policy(policy, path)
        except ParityError as error:
            self.watcher.note(f"{error}; it was not written")

    def _status(self) -> dict[str, Any]:
        progress = self._progress()
        return {
            self.folder.behavior: {"checkpoints": self._saved, "final_checkpoint": self._saved[-1]},
            "lessons": self.curriculum.lesson,
            "seed": self.seed,
            "elapsed_s": round(progress.elapsed_s, 3),
            "steps_per_s": round(progress.steps_per_s, 1),
        }

    def _card(self) -> PolicyCard:
        progress = self._progress()
        figures: dict[str, float] = {}
        if progress.mean_reward is not None:
            figures["training_reward"] = progress.mean_reward
        if progress.success_rate is not None:
            count = progress.scores.episode_count
            low, high = wilson_interval(progress.scores.count(Outcome.SUCCESS), count)
            figures |= {"training_success_rate": progress.success_rate, "training_episodes": count}
            figures |= {"training_success_low": low, "training_success_high": high}
        if self._judged is not None and self._judged.says_success:
            low, high = self._judged.interval
            figures |= {"success_rate": self._judged.success_rate, "success_low": low, "success_high": high}
            figures["episodes"] = self._judged.episodes
        settings = self.task_settings.model_dump()
        params = {name: asdict(sampler) for name, sampler in self.curriculum.final_params().items()}
        return PolicyCard(
            self.task_name,
            settings,
            self.seed,
            self.learner.steps,
            figures,
            params,
            self._parents,
            code_record(),
            self._teacher,
            self._data,
        )

    def _progress(self) -> Progress:
        now_s = wall_time_s()
        (then_s, then_steps), steps = self._moments[0], self.learner.steps
        rate = (steps - then_steps) / max(self._moments[-1][0] - then_s, 1e-9)
        elapsed_s = self._elapsed_before_s + now_s - self._begin_s
        return Progress(steps, self.behavior.max_steps, rate, elapsed_s, self.recent.scores, self.task.says_success)

    def _set_params(self) -> None:
        try:
            self.task.set_params(self.curriculum.params())
        except NumberError as error:
            raise NumberError(f"environment_parameters: {error}") from None

    def _restore(self, path: Path, content: dict[str, Any]) -> None:
        """Goes on where the checkpoint was taken."""
        self.task.layout.require(Layout.from_record(content["policy"]["layout"]), str(path))
        require_fit(settings_that_must_fit(self.config, self.task_settings), content["must_fit"], str(path))
        try:
            self.learner.load_state(content["learner"])
        except CheckpointError as error:
            raise CheckpointError(f"{path}: {error}") from None
        except (KeyError, RuntimeError, ValueError) as error:  # rows or buffers that this version has otherwise
            raise CheckpointError(
                f"{path}: the state of its task was saved by another version of honeyguide; "
                f"--initialize-from goes on with its networks"
            ) from error
        self.curriculum.load_state(content["curriculum"])
        self._set_params()  # the configuration may have other ones than those the task was saved with
        self.period.load_state(content["period"])
        self.recent.load_state(content["recent"])
        self._events_position = content["events"]
        self._elapsed_before_s = content["elapsed_s"]
        self._saved = content["saved"]
        self._parents = content["card"].get("parents", [])  # not in checkpoints of before there were
        if "best" in content:  # not in checkpoints of before there was one
            self._best.load_state(content["best"])

    def _initialize(self, path: Path) -> None:
        """Starts from the networks of another run."""
        content = checkpoint.load(path, CHECKPOINT, POLICY)
        there = content["policy"]
        self.task.layout.require(Layout.from_record(there["layout"]), str(path))
        require_fit(_network(policy_record(self.learner.policy)), _network(there), str(path))
        self.learner.policy.load_state_dict(there["weights"])
        self.learner.take_critics(content.get("learner", {}))
        self._parents = PolicyCard(**content["card"]).as_parent()


def _network(policy: Mapping[str, Any]) -> dict[str, Any]:
    """What must be the same for the weights of one policy to fit into another."""
    settings = NetworkSettings.model_validate(policy["network"]).model_dump(exclude={"deterministic"})
    return {"trainer_type": "sac" if policy["is_squashed"] else "ppo", **flat(settings, "network_settings.")}


def _has_passed(before: int, steps: int, period: int) -> bool:
    """Whether a multiple of the period lies in (before, steps]."""
    return steps // period > before // period


def _device(name: str) -> str:
    """Where networks and environments are, by its full name.

    Raises:
        RunError: there is no such device.
    """
    try:
        return str(torch.zeros(1, device=name).device)
    except (RuntimeError, AssertionError):
        raise RunError(f"torch_settings.device {name}: torch finds no such device here") from None


def _seed(config: RunConfig, content: dict[str, Any] | None) -> int:
    """The configured one; else that of the run that is resumed; else a new one."""
    if config.env_settings.seed >= 0:
        return config.env_settings.seed
    return int(content["seed"]) if content is not None else secrets.randbelow(2**31)
