"""Environments of Gymnasium as a task: what was not written for Warp, for the same learners and commands.

In: actions in the task's buffers. Out: what a vector environment of Gymnasium makes of them, written where the kernels
of other tasks write theirs. Episodes are begun here (`AutoresetMode.DISABLED` with `reset_mask`), so that what they saw
last is kept; or by a vector environment itself, which tells that apart (`SAME_STEP`) or takes a step in between that is
skipped (`NEXT_STEP`). An environment's own state cannot be saved: a run that is resumed begins its episodes anew.
"""

import ast
import os
import weakref
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from numpy.typing import NDArray
from pydantic import ConfigDict, model_validator

from policies.tasks.catalogue import GYM, UnknownTask
from policies.tasks.episode import Outcome
from policies.tasks.gym_autoreset import AutoresetRows
from policies.tasks.gym_making import Vectorization, close_envs, is_vector, make_envs, renders, spec_of
from policies.tasks.gym_spaces import ActionWriter, ObservationReader, UnfitSpace
from policies.tasks.layout import Layout
from policies.tasks.reshaping import Rows
from policies.tasks.task import Task, TaskSettings
from policies.tasks.task_error import TaskError

_SUCCESS_KEYS = ("is_success", "success")  # of an info: Stable-Baselines3 and Gymnasium-Robotics; Meta-World
_IMAGES_PER_S = 30  # of environments that do not say (guess)


class GymSettings(TaskSettings):
    """What a user may choose of an environment: all else that is given goes to `gymnasium.make`."""

    model_config = ConfigDict(extra="allow")

    conditions: ClassVar = TaskSettings.conditions | {"vectorization"}

    preset: Literal[""] = ""  # type: ignore[assignment]  # there are none
    """There are none."""
    vectorization: Vectorization = "sync"
    """Whether environments are stepped one after the other, each in a process of its own, or all by the vector
    environment that is registered for them (of an ID that has nothing else, always so)."""

    @property
    def env_count_max(self) -> int | None:
        """Processes: no more than there are cores."""
        return len(os.sched_getaffinity(0)) if self.vectorization == "async" else None

    @model_validator(mode="before")
    @classmethod
    def _values_of_text(cls, values: Any) -> Any:
        """Arguments of the environment that are given as text: numbers, flags and lists as Python writes them."""
        own = cls.model_fields
        return {key: value if key in own else _literal(value) for key, value in dict(values).items()}


def _literal(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if value in {"true", "false"}:
        return value == "true"
    try:
        return ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return value


class GymTask(Task):
    """Environments of one ID; a subclass that names its `env_id` may change what they show, pay, and how they end."""

    env_id: ClassVar[str]
    """As `gymnasium.make` takes it."""
    params: ClassVar = ()
    settings_class: ClassVar = GymSettings
    says_success = False  # until an info does

    def __init__(self, settings: GymSettings, env_count: int, device: str = "cpu") -> None:
        """Makes the environments.

        Raises:
            UnknownTask: they cannot be made, or no policy here can see them or act in them.
        """
        if not hasattr(self, "env_id"):
            raise UnknownTask(f"{type(self).__name__}: names no env_id, the ID of its environments")
        name = f"{GYM}{self.env_id}"
        spec, vectorization = spec_of(self.env_id), settings.vectorization
        self.envs: VectorEnv[Any, Any, Any] = make_envs(spec, env_count, vectorization, settings.model_extra or {})
        self._can_hold = not is_vector(spec, vectorization)
        self._close_envs = weakref.finalize(self, close_envs, self.envs)  # at the latest when the program ends
        try:
            self._reader = ObservationReader(self.envs.single_observation_space)
            self._writer = ActionWriter(self.envs.single_action_space)
        except UnfitSpace as error:
            raise UnknownTask(f"{name}: {error}") from None
        self.decision_s = 1.0 / (self.envs.metadata.get("render_fps") or _IMAGES_PER_S)
        reader, writer = self._reader, self._writer
        layout = Layout(
            name, 1, reader.elements, writer.continuous, writer.branches, settings.stack or 1, image=reader.image
        )
        super().__init__(layout, env_count, number_defaults={}, device=device)
        self._seeds: list[int | None] = [None] * env_count
        self._is_held: NDArray[np.bool_] | None = None
        waits = self.envs.metadata["autoreset_mode"] is AutoresetMode.DISABLED
        self._autoreset = None if waits else AutoresetRows(name, self.envs)

    @property
    def is_skipped(self) -> NDArray[np.bool_] | None:
        """Where the last step was no decision: of environments that begin episodes by themselves, or are held."""
        return self._is_held if self._autoreset is None else self._autoreset.is_skipped

    def reset(self, seed: int | Sequence[int], is_chosen: NDArray[np.bool_] | None = None) -> None:
        """Starts environments anew; of a single seed each has the next one."""
        seeds = [seed + i for i in range(self.env_count)] if isinstance(seed, int) else seed
        chosen = np.ones(self.env_count, dtype=np.bool_) if is_chosen is None else is_chosen
        pairs = zip(seeds, self._seeds, chosen, strict=True)
        self._seeds = [new % 2**31 if is_new else old for new, old, is_new in pairs]
        super().reset(seed, is_chosen)

    def step_others(self, is_held: NDArray[np.bool_]) -> None:
        """As every task's, but what only a vector environment steps begins another episode: it steps all."""
        if not self._can_hold:
            self.step()
            self.begin(is_held)
            return
        singles: Any = self.envs
        singles.set_attr("is_held", is_held.tolist())
        self._is_held = is_held
        super().step_others(is_held)
        self._is_held = None

    def close(self) -> None:
        """Closes the environments, and ends their processes."""
        self._close_envs()

    def _launch_begin(self, is_chosen: NDArray[np.bool_]) -> None:
        """Resets the chosen environments and shows their first frames."""
        rows = Rows(self)
        self._begin_rows(rows, np.asarray(is_chosen, dtype=np.bool_))
        rows.write()

    def _launch_step(self) -> None:
        """Steps them all; those that end begin their next episode."""
        rows = Rows(self)
        actions = self._writer.actions(rows.of("continuous"), rows.of("branches"))
        observations, rewards, *ends, info = self.envs.step(actions)
        is_terminated, is_truncated = (np.asarray(end, dtype=np.bool_) for end in ends)
        is_decided = np.ones(self.env_count, dtype=np.bool_)
        is_begun, autoreset = ~is_decided, self._autoreset  # begun in this step, by themselves
        if autoreset is not None:
            autoreset.step(is_terminated | is_truncated)
            is_begun, is_decided = autoreset.is_begun, ~autoreset.is_skipped
        rows.of("rewards")[:] = np.where(is_decided, rewards, 0.0)
        self._check_finite(rows.of("rewards"), "a reward is")
        if autoreset is not None and autoreset.is_same_step and is_begun.any():
            self._show(rows, ~is_begun, observations)
            is_final = is_begun & is_decided
            if is_final.any():
                self._show(rows, is_final, autoreset.final_observations(info, is_final), slice(None))
            info = info["final_info"] if isinstance(info.get("final_info"), Mapping) else {}  # not of the next episode
        else:
            self._clear(rows, is_begun)
            self._show(rows, np.ones_like(is_decided), observations)
        rows.of("returns")[:] += rows.of("rewards")
        rows.of("steps")[:] += is_decided
        outcomes = self._outcomes(is_terminated, is_truncated, info)
        for name in ("outcomes", "is_terminated", "is_truncated"):
            rows.of(name)[:] = 0
        is_over = (outcomes != Outcome.RUNNING) & is_decided
        if is_over.any():
            rows.end(is_over, outcomes)
            rows.of("is_terminated")[:] = is_terminated & is_over
            rows.of("is_truncated")[:] = is_truncated & ~is_terminated & is_over
            if self._autoreset is None:
                self._begin_rows(rows, is_over)
            else:
                self._close(rows, is_over)
        if autoreset is not None and autoreset.is_same_step:
            self._clear(rows, is_begun)
            self._show(rows, is_begun, observations)
        rows.write()

    def _outcomes(self, is_terminated: Any, is_truncated: Any, info: Mapping[str, Any]) -> NDArray[np.int32]:
        """How each episode stands, shape (envs,)."""
        outcomes = np.where(is_terminated, Outcome.ENDED, np.where(is_truncated, Outcome.TIMEOUT, Outcome.RUNNING))
        for key in _SUCCESS_KEYS:
            if key in info:
                self.says_success = True
                is_success = np.asarray(info[key], dtype=np.bool_) & info.get(f"_{key}", True)
                outcomes[is_success & (outcomes != Outcome.RUNNING)] = Outcome.SUCCESS
        return outcomes.astype(np.int32)

    def _begin_rows(self, rows: Rows, is_chosen: NDArray[np.bool_]) -> None:
        if not is_chosen.any():
            return
        if self._autoreset is None:
            seeds = [seed if chosen else None for seed, chosen in zip(self._seeds, is_chosen, strict=True)]
            self._seeds = [None if chosen else seed for seed, chosen in zip(self._seeds, is_chosen, strict=True)]
            observations = self._reset_some(seeds, is_chosen)
        elif not is_chosen.all() and self._autoreset.leave(is_chosen):  # it has no way to reset some
            self._close(rows, is_chosen)
            return
        else:
            is_chosen = np.ones_like(is_chosen)
            self._autoreset.restart()
            observations, _ = self.envs.reset(seed=self._seeds[0])
            self._seeds = [None] * self.env_count
        self._clear(rows, is_chosen)
        self._show(rows, is_chosen, observations)

    def _reset_some(self, seeds: list[int | None], is_chosen: NDArray[np.bool_]) -> Any:
        """Observations of all rows after a reset of some."""
        given = [seed for seed in seeds if seed is not None]
        try:  # VectorEnv's annotation knows no lists of seeds; most of its environments do
            return self.envs.reset(seed=seeds if given else None, options={"reset_mask": is_chosen})[0]  # type: ignore[arg-type]
        except (TypeError, gymnasium.error.Error):
            if not given:
                raise
        return self.envs.reset(seed=given[0], options={"reset_mask": is_chosen})[0]

    @staticmethod
    def _close(rows: Rows, is_over: NDArray[np.bool_]) -> None:
        """Forgets what has been done in episodes that are over; what is seen last stays until the next one begins."""
        for name in ("steps", "returns"):
            rows.of(name)[is_over] = 0

    @staticmethod
    def _clear(rows: Rows, is_begun: NDArray[np.bool_]) -> None:
        """Makes rows ready for an episode's first frame."""
        for name in ("steps", "returns", "observations"):
            rows.of(name)[is_begun] = 0
        rows.of("episodes")[is_begun] += 1

    def _show(self, rows: Rows, is_chosen: NDArray[np.bool_], observations: Any, of: slice | None = None) -> None:
        """Writes the newest frames of the chosen rows; the older ones move on.

        Args:
            rows: the buffers.
            is_chosen: rows.
            observations: of all rows.
            of: which of the observations are those of the chosen rows; None: those in their places.
        """
        which = is_chosen if of is None else of
        if self._reader.elements:
            own, size = len(self._reader.elements), self.layout.frame_size
            shown = rows.of("observations")
            older = shown[is_chosen, size:]
            shown[is_chosen, : older.shape[1]] = older
            first = shown.shape[1] - size
            frames = self._reader.floats(observations)[which]
            self._check_finite(frames, "an observation holds a number that is")
            shown[is_chosen, first : first + own] = frames
        if self._reader.image is not None:
            rows.of("images")[is_chosen] = self._reader.images(observations)[which]

    def _check_finite(self, values: NDArray[Any], what: str) -> None:
        if not np.isfinite(values).all():  # one of them would make NaN of all weights
            raise TaskError(f"{self.layout.task}: {what} not finite")

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores the arrays; the environments begin new episodes, seeded by how many there have been."""
        super().load_state(state)
        pairs = zip(self.buffers.seed.numpy(), self.buffers.episodes.numpy(), strict=True)
        self._seeds = [
            int(np.random.SeedSequence([int(seed) % 2**32, int(episode), i]).generate_state(1)[0] >> 1)
            for i, (seed, episode) in enumerate(pairs)
        ]
        self.begin(np.ones(self.env_count, dtype=np.bool_))

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:  # noqa: ARG002
        """What the environment renders, RGB; of any height."""
        try:
            if isinstance(self.envs, SyncVectorEnv):
                image = self.envs.envs[i_env].render()
            else:
                images: Any = self.envs.render() if renders(self.envs) else None
                image = None if images is None else images[i_env]
        except NotImplementedError:
            image = None
        if image is None:
            raise NotImplementedError(f"{self.layout.task}: renders no rgb_array")
        return np.asarray(image, dtype=np.uint8)


def gym_class(env_id: str) -> type[GymTask]:
    """The task of an ID of Gymnasium's.

    Raises:
        UnknownTask: nothing of that ID is registered.
    """
    spec_of(env_id)
    return type("GymTask", (GymTask,), {"env_id": env_id})
