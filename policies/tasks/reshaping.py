"""What a subclass changes of a task without writing a kernel: added elements, rewards, endings.

In: the arrays of a task after its launch. Out: the same arrays, as the methods `observe`, `outcome` and `reward` of the
subclass would have them. On a CPU the arrays are changed in place; of a GPU they are copied here and back, which is
slow: there a kernel of one's own is worth its lines.
"""

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from policies.tasks.episode import OUTCOME_COUNT, Outcome
from policies.tasks.layout import Element, Layout
from policies.tasks.task_error import TaskError

Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Decision:
    """One decision of every row, and what came of it."""

    observations: Array  # (envs, observation), what it was made on
    actions: Array  # (envs, continuous actions) in [-1, 1], or (envs, branches)
    next_observations: Array  # (envs, observation); where the episode ended, what it saw last
    rewards: Array  # (envs,), as the task pays them
    outcomes: Array  # (envs,), `Outcome` numbers, as the task judges


class Reshaped(Protocol):
    """What is asked of a task here; `Task` says what each is."""

    @property
    def layout(self) -> Layout: ...

    @property
    def added(self) -> tuple[Element, ...]: ...

    @property
    def buffers(self) -> Any: ...

    @property
    def device(self) -> str: ...

    @property
    def is_skipped(self) -> NDArray[np.bool_] | None: ...

    def begin(self, is_chosen: NDArray[np.bool_]) -> None: ...

    def observe(self, frames: Array) -> Array: ...

    def outcome(self, decision: Decision) -> Array: ...

    def reward(self, decision: Decision) -> Array: ...


class Reshaping:
    """The methods that a subclass of a task has overridden, at work on its arrays."""

    def __init__(self, task: Reshaped) -> None:
        self._task = task
        self._before: Array = np.zeros(0)

    def note(self) -> None:
        """Keeps what the next decision is made on."""
        self._before = self._task.buffers.observations.numpy().copy()

    def begin(self) -> None:
        """Fills the added elements of the newest frames."""
        if self._task.added:
            rows = Rows(self._task)
            self._add(rows.of("observations"))
            rows.write()

    def step(self) -> None:
        """Adds elements, ends episodes and pays, after the task's own step; then begins the episodes that follow."""
        task, rows = self._task, Rows(self._task)
        was_over = rows.of("outcomes") != Outcome.RUNNING
        self._add(rows.of("observations"))
        if was_over.any():
            rows.of("final_observations")[was_over] = self._add(rows.of("final_observations")[was_over])
        decision = self._decision(rows, was_over)
        judged = _outcomes(task.outcome(decision), decision.outcomes)
        outcomes = np.where(was_over & (judged == Outcome.RUNNING), decision.outcomes, judged)  # ended is ended
        rewards = _rewards(task.reward(replace(decision, outcomes=outcomes)), decision.rewards)
        if task.is_skipped is not None:  # what was no decision neither ends nor pays
            outcomes = np.where(task.is_skipped, Outcome.RUNNING, outcomes)
            rewards = np.where(task.is_skipped, np.float32(0.0), rewards)
        is_ended = ~was_over & (outcomes != Outcome.RUNNING)
        rows.pay(rewards)
        rows.rename(np.where(was_over, outcomes, Outcome.RUNNING))
        rows.end(is_ended, outcomes)
        rows.write()
        if is_ended.any():
            task.begin(is_ended)

    def _decision(self, rows: "Rows", was_over: Array) -> Decision:
        actions = rows.of("branches" if self._task.layout.branches else "continuous").copy()
        following = np.where(was_over[:, None], rows.of("final_observations"), rows.of("observations"))
        return Decision(self._before, actions, following, rows.of("rewards").copy(), rows.of("outcomes").copy())

    def _add(self, observations: Array) -> Array:
        """Writes the added elements of the newest frames into rows of observations, which are returned."""
        task, size = self._task, self._task.layout.observation_size
        if task.added:
            frames = observations[:, size - task.layout.frame_size : size - len(task.added)]
            added = np.asarray(task.observe(frames))
            _check_numbers(added, (len(frames), len(task.added)), "observe")
            observations[:, size - len(task.added) :] = added
            if not np.isfinite(observations[:, size - len(task.added) :]).all():
                raise TaskError("observe: must return finite numbers")
        return observations


class Rows:
    """Buffers of a task that are changed on the host."""

    def __init__(self, task: Reshaped) -> None:
        self._task = task
        self._taken: dict[str, Array] = {}

    def of(self, name: str) -> Array:
        """The array of a buffer: live on a CPU."""
        if name not in self._taken:
            self._taken[name] = getattr(self._task.buffers, name).numpy()
        return self._taken[name]

    def rename(self, outcomes: Array) -> None:
        """Books ends that the task has booked already under other outcomes."""
        own, scores = self.of("outcomes"), self.of("scores")
        for i in np.flatnonzero((own != Outcome.RUNNING) & (outcomes != own)):
            scores[i, own[i]] -= 1.0
            scores[i, outcomes[i]] += 1.0
            self._say_end(i, outcomes[i])
            own[i] = outcomes[i]

    def pay(self, rewards: Array) -> None:
        """Puts other rewards in the place of the task's."""
        more = rewards - self.of("rewards")
        was_over = self.of("outcomes") != Outcome.RUNNING
        self.of("returns")[~was_over] += more[~was_over]
        self.of("scores")[was_over, OUTCOME_COUNT] += more[was_over]
        self.of("rewards")[:] = rewards

    def end(self, is_ended: Array, outcomes: Array) -> None:
        """Books the ends of running episodes and keeps what they saw last; the next are still to be begun."""
        layout, scores = self._task.layout, self.of("scores")
        pairs = [("final_observations", "observations")]
        pairs += [("final_images", "images")] if layout.image is not None else []
        pairs += [("final_privileged", "privileged")] if layout.privileged else []
        for last, now in pairs:
            self.of(last)[is_ended] = self.of(now)[is_ended]
        self.of("outcomes")[is_ended] = outcomes[is_ended]
        self._say_end(is_ended, outcomes[is_ended])
        scores[np.flatnonzero(is_ended), outcomes[is_ended]] += 1.0
        scores[is_ended, OUTCOME_COUNT] += self.of("returns")[is_ended]
        scores[is_ended, OUTCOME_COUNT + 1] += self.of("steps")[is_ended]

    def write(self) -> None:
        """Brings what was changed to where the task's arrays are."""
        if self._task.device != "cpu":
            for name, array in self._taken.items():
                getattr(self._task.buffers, name).assign(array)

    def _say_end(self, rows: Any, outcomes: Any) -> None:
        self.of("is_truncated")[rows] = outcomes == Outcome.TIMEOUT
        self.of("is_terminated")[rows] = outcomes != Outcome.TIMEOUT


def cut_rows(task: Reshaped, is_cut: Array) -> None:
    """Ends running episodes for want of time, shape (envs,): truncations. The next ones begin."""
    rows = Rows(task)
    rows.end(is_cut, np.full(len(is_cut), int(Outcome.TIMEOUT)))
    rows.write()
    task.begin(is_cut)


def _outcomes(values: Any, like: Array) -> Array:
    """What `outcome` of a subclass returned: an `Outcome` number per row.

    Raises:
        TaskError: it is something else.
    """
    outcomes = np.asarray(values)
    _check_numbers(outcomes, like.shape, "outcome")
    wrong = outcomes[~np.isin(outcomes, range(OUTCOME_COUNT))]
    if wrong.size:
        raise TaskError(f"outcome: must return Outcome numbers, 0 to {OUTCOME_COUNT - 1}, not {wrong[0]}")
    return outcomes.astype(like.dtype)


def _rewards(values: Any, like: Array) -> Array:
    """What `reward` of a subclass returned: a number per row.

    Raises:
        TaskError: it is something else, or not finite: one such reward would make NaN of all weights.
    """
    rewards = np.asarray(values)
    _check_numbers(rewards, like.shape, "reward")
    rewards = rewards.astype(like.dtype)
    if not np.isfinite(rewards).all():
        raise TaskError("reward: must return finite numbers")
    return rewards


def _check_numbers(values: Array, shape: tuple[int, ...], method: str) -> None:
    if values.shape != shape:
        raise TaskError(f"{method}: must return an array of shape {shape}, not {values.shape}")
    if values.dtype.kind not in "biuf":
        raise TaskError(f"{method}: must return numbers, not {values.dtype}")
