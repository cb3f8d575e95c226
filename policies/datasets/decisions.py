"""The decisions that a flight has logged, as arrays, and how they become episodes whoever judges them.

A run is what was decided in a row by one pilot, without a gap. Its k-th action led to its next observation, so a run of
n decisions has n - 1 steps. It ends where the task's own function says so, or is cut where the run ends. A vehicle that
stays at a goal it has reached begins no episode there.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from policies.datasets.episodes import DatasetError, EpisodeRows
from policies.tasks.episode import Outcome
from policies.tasks.layout import Layout

GAP_US = 250_000  # between two decisions: two were missed
_LEAST = 2  # decisions of a run

Rows = NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class DecisionRows:
    """Decisions of one log, in order of time; columns as of `policies.companion.decision_log`."""

    source: str  # the log, for messages and metadata
    layout: Layout  # of what was seen, one frame in a stack
    pilot: str
    time_us: Rows  # (n,)
    frame: Rows  # (n, elements), by which a judge judges
    seen: Rows  # (n, elements), the observations: frames, or vectors of a pilot that decides on images
    action: Rows  # (n, actions), NaN where another flew
    flown: Rows  # (n, 4)
    pos_ned: Rows
    vel_ned: Rows
    goal: Rows  # (n, 3)
    yaw: Rows
    i_image: Rows
    is_flying: Rows
    is_first: Rows
    is_struck: Rows  # before the next decision, by what its accelerometers felt
    context: Mapping[str, str | float] = field(default_factory=dict)

    def part(self, chosen: slice) -> "DecisionRows":
        """Some of the rows."""
        columns = {name: getattr(self, name)[chosen] for name in COLUMNS}
        return DecisionRows(self.source, self.layout, self.pilot, **columns, context=self.context)

    def __len__(self) -> int:
        return len(self.time_us)


def struck_on_the_way(run: DecisionRows) -> Rows:
    """Whether something was struck on the way to each row, which after the last is the last's; 1 or 0, shape (n,)."""
    struck = np.zeros(len(run), np.int32)
    struck[1:] = run.is_struck[:-1]
    struck[-1] |= int(run.is_struck[-1])
    return struck


COLUMNS = (
    "time_us", "frame", "seen", "action", "flown", "pos_ned", "vel_ned", "goal", "yaw", "i_image", "is_flying",
    "is_first", "is_struck",
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class TruthRows:
    """What truly was at each decision, where a simulator has logged it; for rewards and ends, never for observations.

    `owner` are rows of `sim.world.people.Person`; None: there was nobody. `world` is the ground that they stood on.
    """

    pos_ned: Rows  # (n, 3)
    vel_ned: Rows
    q_ned_from_frd: Rows  # (n, 4)
    height_m: Rows  # (n,)
    is_on_ground: Rows
    owner: Rows | None = None
    world: Any = None

    def part(self, chosen: slice) -> "TruthRows":
        """Some of the rows."""
        owner = None if self.owner is None else self.owner[chosen]
        names = ("pos_ned", "vel_ned", "q_ned_from_frd", "height_m", "is_on_ground")
        arrays = {name: getattr(self, name)[chosen] for name in names}
        return TruthRows(**arrays, owner=owner, world=self.world)


class Judge(Protocol):
    """What a task's own functions make of logged decisions."""

    layout: Layout  # of the dataset

    def actions(self, run: DecisionRows) -> Rows:
        """What led to what was flown, in the task's actions, shape (n, actions)."""
        ...

    def judged(self, run: DecisionRows, actions: Rows, truth: TruthRows | None) -> tuple[Rows, Rows]:
        """Rewards and outcomes of the steps, shape (n - 1,) each; step k leads to row k + 1."""
        ...


@dataclass(frozen=True, slots=True)
class Runs:
    """The runs of a log, and what was left out."""

    slices: tuple[slice, ...]
    gaps: tuple[tuple[float, float], ...]  # when and for how long nothing was decided [s]


def runs_of(rows: DecisionRows, *, has_others: bool) -> Runs:
    """Where the runs of a log lie.

    Args:
        rows: the log's decisions.
        has_others: what another flew while the companion looked on counts, too.
    """
    steps = np.diff(rows.time_us.astype(np.int64))
    is_same = rows.is_flying[1:] == rows.is_flying[:-1]
    is_gap = (steps > GAP_US) | (steps <= 0)
    is_cut = is_gap | ~is_same | rows.is_first[1:].astype(bool)
    bounds = [0, *(np.flatnonzero(is_cut) + 1).tolist(), len(rows)]
    found = [slice(a, b) for a, b in pairwise(bounds) if b - a >= _LEAST]
    slices = tuple(each for each in found if has_others or rows.is_flying[each.start])
    within = is_gap & is_same & (has_others | rows.is_flying[1:].astype(bool))
    gaps = tuple((float(rows.time_us[k]) * 1e-6, float(steps[k]) * 1e-6) for k in np.flatnonzero(within))
    return Runs(slices, gaps)


def stacked(frames: Rows, stack: int) -> Rows:
    """Observations of several frames, oldest first, zeros before the first; shape (n, stack * elements)."""
    padded = np.concatenate([np.zeros((stack - 1, frames.shape[1]), np.float32), frames])
    return np.concatenate([padded[k : k + len(frames)] for k in range(stack)], axis=1).astype(np.float32)


def episodes_of(
    rows: DecisionRows,
    judge: Judge,
    truth: TruthRows | None,
    *,
    has_others: bool = False,
    images: Callable[[Rows], NDArray[np.uint8] | None] = lambda _: None,
) -> Iterator[EpisodeRows]:
    """The episodes of a log.

    Args:
        rows: its decisions.
        judge: of the task.
        truth: at each of them; None: the log has none, and the estimate judges.
        has_others: what another flew counts, too.
        images: the images of these numbers; None: there are none.

    Raises:
        DatasetError: it holds no run of two decisions, or a number that is none.
    """
    runs = runs_of(rows, has_others=has_others).slices
    if not runs:
        who = "" if has_others else " that the companion flew"
        raise DatasetError(f"{rows.source}: policy_decision holds no two decisions in a row{who}")
    reached: Rows | None = None  # the goal at which it stays
    for chosen in runs:
        if rows.is_first[chosen.start] and rows.is_flying[chosen.start]:
            reached = None  # sent anew, be it to where it stands
        at = chosen.start
        while chosen.stop - at >= _LEAST:
            rest = slice(at, chosen.stop)
            judged = _judged(rows.part(rest), judge, None if truth is None else truth.part(rest))
            if reached is not None:
                stayed, reached = _stay(judged, reached)
                if stayed:
                    at += stayed
                    continue
            episode = _episode(judged, judge.layout.stack, images)
            yield episode
            at += len(episode)
            reached = judged.run.goal[len(episode) - 1] if episode.is_success else None
            if episode.is_terminated and not episode.is_success:
                break  # whatever it does after it struck something


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """Decisions with what they are worth."""

    run: DecisionRows
    actions: Rows
    rewards: Rows  # of the steps, as the next
    outcomes: Rows


def _judged(run: DecisionRows, judge: Judge, truth: TruthRows | None) -> _Judged:
    if not (np.isfinite(run.frame).all() and np.isfinite(run.seen).all()):
        raise DatasetError(f"{run.source}: policy_decision holds an observation that is no number")
    actions = judge.actions(run)
    return _Judged(run, actions, *judge.judged(run, actions, truth))


def _stay(judged: _Judged, reached: Rows) -> tuple[int, Rows]:
    """For how many decisions it has no other goal, level, than those that it has reached, and the last of these.

    A goal that walks is another one each time; where the vehicle keeps up with it, it has reached that, too.
    """
    for k, outcome in enumerate(judged.outcomes.tolist()):
        goal = judged.run.goal[k]
        if outcome == Outcome.SUCCESS:
            reached = goal
        elif (goal[:2] != reached[:2]).any():  # one without a height of its own has the vehicle's
            return k, reached
    return len(judged.run), reached


def _episode(judged: _Judged, stack: int, images: Callable[[Rows], NDArray[np.uint8] | None]) -> EpisodeRows:
    run, outcomes = judged.run, judged.outcomes
    ended = np.flatnonzero(outcomes)
    steps = int(ended[0]) + 1 if len(ended) else len(outcomes)
    outcome = Outcome(int(outcomes[steps - 1]))
    return EpisodeRows(
        observations=stacked(run.seen[: steps + 1], stack),
        actions=judged.actions[:steps],
        rewards=judged.rewards[:steps].astype(np.float64),
        is_terminated=outcome is not Outcome.RUNNING and outcome is not Outcome.TIMEOUT,
        outcome="timeout" if outcome is Outcome.RUNNING else outcome.name.lower(),
        images=images(run.i_image[: steps + 1]),
        context={
            "source": run.source,
            "pilot": run.pilot if run.is_flying[0] else "other",
            "start_us": float(run.time_us[0]),
            **run.context,
        },
    )
