"""A batch of environments of one task: its arrays, and the two recorded launches that begin and step them.

A task is a subclass that declares a layout and numbers, makes its own arrays with `_zeros`, and names two kernels:

    begin(buffers, is_chosen, state…)   starts an episode in the chosen rows
    step(buffers, state…)               one decision of every row; rows whose episode ends begin the next

A subclass of a task that exists need write no kernel: `added` with `observe`, `outcome` and `reward` change what it
shows, how it ends and what it pays. The learner sees arrays only: actions in; observations, rewards and ends out.
Nothing here knows torch or Gymnasium.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, get_args

import numpy as np
import warp as wp
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from common.records import assign_rows
from policies.tasks.episode import OUTCOME_COUNT, SCORE_COLUMNS, Outcome, StepBuffers, keep_last_image_rows
from policies.tasks.goals import PositionGoal
from policies.tasks.layout import Element, Layout
from policies.tasks.reshaping import Array, Decision, Reshaping
from policies.tasks.task_error import TaskError
from policies.tasks.task_params import NumberError, Sampler, TaskParam, TaskParamTable

Preset = Literal["as-documented", "as-coded", "improved"]
Split = Literal["train", "validation", "test"]
SPLITS: tuple[Split, ...] = get_args(Split)


class TaskSettings(BaseModel):
    """What a user may choose of any task; each task adds its own."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    conditions: ClassVar[frozenset[str]] = frozenset({"split", "stack"})
    """Settings under other values of which recorded decisions may be learnt from: those of where and in what a task is
    done, and those that the layout tells of."""

    preset: Preset = "as-coded"
    """`as-documented` (the text), `as-coded` (the published code) or `improved` (ours)."""
    split: Split = "train"
    """`train`, `test`, or `validation`, by which to choose among policies: disjoint sets of places of goals, and where
    there are worlds, paths, noise and starts also of these."""
    stack: int = Field(default=0, ge=0, le=50)
    """Observations in a stack; 0: as the preset has it."""

    @property
    def env_count_max(self) -> int | None:
        """How many environments are worth having side by side, where nobody has said how many; None: any."""
        return None


@dataclass(frozen=True, slots=True)
class Scores:
    """What the episodes that ended since the last look came to."""

    outcomes: tuple[int, ...]  # episodes by Outcome
    return_sum: float
    length_sum: float  # [decisions]

    @property
    def episode_count(self) -> int:
        return sum(self.outcomes)

    def count(self, outcome: Outcome) -> int:
        return self.outcomes[outcome]

    def __add__(self, other: "Scores") -> "Scores":
        return Scores(
            tuple(a + b for a, b in zip(self.outcomes, other.outcomes, strict=True)),
            self.return_sum + other.return_sum,
            self.length_sum + other.length_sum,
        )


class Task:
    """Environments of one task, side by side. The arrays are made once and live as long as the task."""

    params: ClassVar[tuple[TaskParam, ...]]
    """The declared numbers, one per field of the task's struct."""
    decision_s: float
    """Simulated time between two decisions [s]."""
    goal: PositionGoal | None = None
    """How observations tell of the goal, for hindsight replay; none: they tell too little."""
    settings_class: ClassVar[type[TaskSettings]] = TaskSettings
    """What users may choose of it."""
    added: ClassVar[tuple[Element, ...]] = ()
    """Elements that a subclass adds to each frame, at its end; `observe` gives their values."""
    says_success: bool = True
    """Whether an episode that went well ends as `SUCCESS`; of some outside environments nobody knows."""

    def __init__(
        self, layout: Layout, env_count: int, *, number_defaults: Mapping[str, float | Sampler], device: str = "cpu"
    ) -> None:
        self.layout = replace(layout, frame=(*layout.frame, *self.added))
        layout = self.layout
        self.env_count = env_count
        self.device = device
        self._arrays: dict[str, Any] = {}
        self.param_table = TaskParamTable(self.params, device)
        self.param_table.update(number_defaults)
        self.param_table.keep_as_own()
        size = layout.observation_size
        buffers = StepBuffers()
        buffers.continuous = self._zeros("continuous", (env_count, len(layout.continuous)), float)
        buffers.branches = self._zeros("branches", (env_count, len(layout.branches)), int)
        buffers.observations = self._zeros("observations", (env_count, size), float)
        buffers.final_observations = self._zeros("final_observations", (env_count, size), float)
        buffers.images = self._zeros("images", (env_count, *layout.image_shape), wp.uint8)
        buffers.final_images = self._zeros("final_images", (env_count, *layout.image_shape), wp.uint8)
        buffers.privileged = self._zeros("privileged", (env_count, len(layout.privileged)), float)
        buffers.final_privileged = self._zeros("final_privileged", (env_count, len(layout.privileged)), float)
        buffers.rewards = self._zeros("rewards", env_count, float)
        buffers.outcomes = self._zeros("outcomes", env_count, int)
        buffers.is_terminated = self._zeros("is_terminated", env_count, wp.bool)
        buffers.is_truncated = self._zeros("is_truncated", env_count, wp.bool)
        buffers.steps = self._zeros("steps", env_count, int)
        buffers.returns = self._zeros("returns", env_count, float)
        buffers.episodes = self._zeros("episodes", env_count, int)
        buffers.scores = self._zeros("scores", (env_count, SCORE_COLUMNS), float)
        buffers.seed = self._zeros("seed", env_count, int)
        buffers.params = self._zeros("numbers", (env_count, len(self.param_table.names)), float)
        buffers.samplers = self.param_table.array
        buffers.frame_size = layout.frame_size
        self.buffers = buffers
        self._is_chosen = wp.zeros(env_count, dtype=wp.bool, device=device)
        self._begin: Any = None
        self._step: Any = None
        methods = ("observe", "outcome", "reward")
        is_reshaped = self.added or any(getattr(type(self), name) is not getattr(Task, name) for name in methods)
        self._reshaping = Reshaping(self) if is_reshaped else None

    def _zeros(self, name: str, shape: Any, dtype: Any) -> Any:
        """An array of the task's state: saved and restored by name."""
        array = wp.zeros(shape, dtype=dtype, device=self.device)
        self._arrays[name] = array
        return array

    def _record(self, begin: Any, step: Any, state: list[Any]) -> None:
        """Records the task's two launches; to be called once, at the end of the subclass's `__init__`."""
        chosen = [self.buffers, self._is_chosen, *state]
        self._begin = wp.launch(begin, self.env_count, chosen, device=self.device, record_cmd=True)
        self._step = wp.launch(step, self.env_count, [self.buffers, *state], device=self.device, record_cmd=True)

    def reset(self, seed: int | Sequence[int], is_chosen: NDArray[np.bool_] | None = None) -> None:
        """Starts environments anew. The same seed gives the same episodes, whatever ran before.

        Args:
            seed: of all rows, which differ; or one of each row, which then goes through the episodes of a batch of one
                with that seed (of what flies, the noise of the sensors is still the row's own).
            is_chosen: which rows, shape (envs,); all of them by default.
        """
        chosen = np.ones(self.env_count, dtype=np.bool_) if is_chosen is None else is_chosen
        seeds = [seed] * self.env_count if isinstance(seed, int) else _row_seeds(seed)
        values: dict[str, Any] = {"seed": np.array([each % 2**32 for each in seeds], np.uint32).view(np.int32)[chosen]}
        for name in ("episodes", "scores", "rewards", "outcomes", "is_terminated", "is_truncated"):
            values[name] = 0
        for name, value in values.items():
            rows = self._arrays[name].numpy().copy()
            rows[chosen] = value
            self._arrays[name].assign(rows)
        self.begin(chosen)

    def begin(self, is_chosen: NDArray[np.bool_]) -> None:
        """Starts an episode in the chosen rows, shape (envs,); the others are not touched."""
        self._launch_begin(is_chosen)
        if self._reshaping is not None:
            self._reshaping.begin()

    def step(self) -> None:
        """One decision of all environments, with the actions that lie in the buffers."""
        if self._reshaping is None:
            self._launch_step()
            return
        self._reshaping.note()
        self._launch_step()
        self._reshaping.step()

    def step_others(self, is_held: NDArray[np.bool_]) -> None:
        """One decision of all rows but the held ones, shape (envs,), which stay as they are: at an episode's start."""
        kept = {
            name: array.numpy()[is_held].copy()
            for name, array in self._arrays.items()
            if array.size and array.shape[0] == self.env_count
        }
        self.step()
        for name, rows in kept.items():
            all_rows = self._arrays[name].numpy()  # live on a CPU
            all_rows[is_held] = rows
            if self.device != "cpu":
                self._arrays[name].assign(all_rows)

    @property
    def is_skipped(self) -> NDArray[np.bool_] | None:
        """In which rows the last step was no decision, shape (envs,), and is not learnt from; None: never in any.

        So it is where an outside environment begins an episode with a step, whose action it does not use.
        """
        return None

    def _launch_begin(self, is_chosen: NDArray[np.bool_]) -> None:
        """What `begin` does of the task's own."""
        self._is_chosen.assign(is_chosen)
        self._begin.launch()

    def _launch_step(self) -> None:
        """What `step` does of the task's own."""
        self._step.launch()

    def observe(self, frames: Array) -> Array:  # noqa: ARG002  (what subclasses take)
        """The values of the `added` elements, shape (rows, added).

        Args:
            frames: what the task shows without them, shape (rows, elements).

        Raises:
            TaskError: there are `added` elements, and the subclass has no such method.
        """
        raise TaskError(f"{type(self).__name__}: elements are added, but there is no method observe")

    def outcome(self, decision: Decision) -> Array:
        """How each episode stands, shape (envs,): `Outcome` numbers. An end of the task's own stays an end."""
        return decision.outcomes

    def reward(self, decision: Decision) -> Array:
        """What each decision is paid, shape (envs,); it is asked after `outcome`."""
        return decision.rewards

    def keep_last_images(self) -> None:
        """Keeps the images of the episodes that just ended; to be called before those of the next ones are drawn."""
        image_rows = (self.env_count, self.layout.image_shape[0])
        wp.launch(keep_last_image_rows, image_rows, [self.buffers], device=self.device)

    def close(self) -> None:
        """Gives back what it holds besides memory: nothing, but where environments run elsewhere."""

    def set_params(self, values: Mapping[str, float | Sampler]) -> None:
        """Sets or randomises numbers from the next episodes on (domain randomisation, curricula).

        Raises:
            NumberError: no such number, or a value out of its bounds.
        """
        self.param_table.update(values)

    def take_scores(self) -> Scores:
        """The sums over the episodes that ended since the last call."""
        sums = self.buffers.scores.numpy().sum(axis=0, dtype=np.float64)
        self.buffers.scores.zero_()
        outcomes = tuple(int(count) for count in sums[:OUTCOME_COUNT])
        return Scores(outcomes, float(sums[OUTCOME_COUNT]), float(sums[OUTCOME_COUNT + 1]))

    def state(self) -> dict[str, NDArray[Any]]:
        """A copy of everything that changes: restoring it continues bit for bit."""
        state = {name: array.numpy().copy() for name, array in self._arrays.items() if array.size}
        state["samplers"] = self.param_table.rows.copy()
        return state

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores what `state` returned, of a task with the same settings and size.

        Raises:
            NumberError: it was saved by a version of the task that had other numbers.
        """
        if state["samplers"].shape != self.param_table.rows.shape:
            counts = f"{len(state['samplers'])} numbers then, {len(self.param_table.names)} now"
            raise NumberError(f"{self.layout.task}: saved by another version of the task, {counts}: begin anew")
        for name, array in self._arrays.items():
            if array.size:
                assign_rows(array, state[name])
        self.param_table.rows[:] = state["samplers"]
        self.param_table.array.assign(self.param_table.rows)

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """One environment seen from above, RGB, shape (height, width, 3)."""
        raise NotImplementedError(f"{self.layout.task}: draws no view of itself: it has no method top_view")


def _row_seeds(seeds: Sequence[int]) -> list[int]:
    """Seeds for the rows, with which each draws what row 0 draws with its own.

    `draw_key` begins with Warp's rand_init(seed, row) = pcg(seed + pcg(row)).
    """
    return [seed + _pcg(0) - _pcg(i) for i, seed in enumerate(seeds)]


def _pcg(state: int) -> int:
    """Warp's `rand_pcg` (native/rand.h), after O'Neill 2014's PCG RXS-M-XS; 32 bits."""
    b = (state * 747796405 + 2891336453) % 2**32
    c = ((b >> ((b >> 28) + 4)) ^ b) * 277803737 % 2**32
    return (c >> 22) ^ c
