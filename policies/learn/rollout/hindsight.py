"""Hindsight replay: some of the transitions that are drawn get a goal that their episode came to later.

Andrychowicz et al. 2017 (arXiv 1707.01495), strategy `future`: of k + 1 transitions, k get as goal the position of a
later observation of their own episode, and are paid and ended as the task would have done with that goal. Episodes that
still run lend what they have seen so far.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from policies.learn.rollout.replay_buffer import Replay, ReplayBatch
from policies.tasks.goals import PositionGoal


class Hindsight:
    """What is known of the episodes of a replay buffer, slot by slot, and the relabelling."""

    def __init__(self, goal: PositionGoal, replay: Replay, goals_per_transition: int) -> None:
        """Knows of no episode yet.

        Args:
            goal: how the task's observations tell of goals.
            replay: whose transitions are relabelled.
            goals_per_transition: k of the paper.
        """
        shape = (replay.slots, replay.env_count)
        device = replay.rows.device
        self.goal = goal
        self._replay = replay
        self._fraction = goals_per_transition / (goals_per_transition + 1)
        self._episode = torch.zeros(replay.env_count, dtype=torch.int64, device=device)  # running, modulo slots
        self._episodes = torch.zeros(shape, dtype=torch.int64, device=device)  # that a transition belongs to
        self._last_rounds = torch.zeros(shape, dtype=torch.int64, device=device)  # by episode, not by slot
        self._radii = torch.zeros(shape, device=device)
        self._is_success = torch.zeros(shape, dtype=torch.bool, device=device)

    def add(self, radii: Tensor, is_over: Tensor, is_success: Tensor) -> None:
        """Notes the round that the replay buffer takes next.

        Args:
            radii: within which a goal counted as reached, shape (envs,).
            is_over: whose episodes ended with it, shape (envs,).
            is_success: whose ended because the goal was reached, shape (envs,).
        """
        slot = self._replay.rounds % self._replay.slots
        self._episodes[slot] = self._episode
        self._last_rounds.scatter_(0, self._episode[None], torch.full_like(self._episode[None], self._replay.rounds))
        self._radii[slot] = radii
        self._is_success[slot] = is_success
        self._episode.add_(is_over).remainder_(self._replay.slots)  # each has a slot of its own: still distinct

    def cut(self) -> None:
        """Takes what comes next for other episodes than those that are running."""
        newest = (self._replay.rounds - 1) % self._replay.slots
        self._episode.add_(self._episodes[newest] == self._episode).remainder_(self._replay.slots)

    def relabel(self, transitions: ReplayBatch, indices: Tensor, generator: torch.Generator) -> ReplayBatch:
        """Drawn transitions, k of k + 1 with another goal.

        Args:
            transitions: B of them, left as they are.
            indices: where in the ring they lie, shape (B,).
            generator: of all draws.
        """
        chance = torch.rand(2, len(indices), generator=generator, device=indices.device)
        goals = torch.where(
            (chance[0] < self._fraction)[:, None],
            self._achieved_later(indices, chance[1]),
            transitions.observations[:, self.goal.goal],
        )
        radii, is_success = self._radii.flatten()[indices], self._is_success.flatten()[indices]
        return with_goals(transitions, goals, self.goal, radii, is_success)

    def _achieved_later(self, indices: Tensor, chance: Tensor) -> Tensor:
        """What was achieved by these or later transitions of their episodes, shape (B, elements of a goal)."""
        replay = self._replay
        slots, envs = indices // replay.env_count, indices % replay.env_count
        newest = replay.rounds - 1
        rounds = newest - (newest - slots) % replay.slots  # the round that lies in the slot
        last = self._last_rounds[self._episodes[slots, envs], envs]
        later = rounds + (chance * (last - rounds + 1)).long()
        return replay.take(later % replay.slots * replay.env_count + envs).next_observations[:, self.goal.achieved]

    def state(self) -> dict[str, Any]:
        """What is known."""
        return {name: getattr(self, name).clone() for name in _STATE}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned."""
        for name in _STATE:
            getattr(self, name).copy_(state[name])


_STATE = ("_episode", "_episodes", "_last_rounds", "_radii", "_is_success")


def with_goals(
    transitions: ReplayBatch, goals: Tensor, goal: PositionGoal, radii: Tensor, is_success: Tensor
) -> ReplayBatch:
    """The transitions as they would have been with other goals; with their own goals, as they were.

    Args:
        transitions: B of them.
        goals: shape (B, elements of a goal).
        goal: where goals and positions lie in observations, and what reaching one pays.
        radii: within which a goal counts as reached, shape (B,).
        is_success: which transitions reached the goals they had, shape (B,).
    """
    before, after = transitions.observations.clone(), transitions.next_observations.clone()
    is_reached = (after[:, goal.achieved] - goals).norm(dim=1) < radii
    is_own = (goals == before[:, goal.goal]).all(dim=1)
    is_reached = torch.where(is_own, is_success, is_reached)  # the task's own rounding decides about its own goal
    before[:, goal.goal] = goals
    after[:, goal.goal] = goals
    return replace(
        transitions,
        observations=before,
        next_observations=after,
        rewards=transitions.rewards + goal.reward * (is_reached.float() - is_success.float()),
        is_terminated=torch.where(is_success, 0.0, transitions.is_terminated).maximum(is_reached.float()),
        is_ended=transitions.is_ended & ~is_success | is_reached,
    )
