"""What one iteration of PPO collects: T decisions of N environments in tensors made once, and minibatches of it.

Nothing here is flat before it is drawn: (T, N, ...) throughout. Recurrent policies draw whole sequences of consecutive
decisions, sequence first; episodes may end within them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from policies.learn.networks.action_distributions import Actions, bounded
from policies.learn.networks.observations import Observation
from policies.learn.rollout.task_tensors import TaskTensors
from policies.learn.signals.signal import Transitions
from policies.tasks.layout import ImageElement, Layout


@dataclass(frozen=True, slots=True)
class Batch:
    """Rows of a rollout, B of them; of recurrent policies, sequences after one another step by step."""

    rows: Tensor  # (B,), indices into the flat rollout
    observation: Observation  # (B, ...); of recurrent policies with the steps between their episodes
    counted: Tensor | None  # (B,), which rows of the observation the others are; None: all of them
    actions: Actions  # (B, ...)
    log_probs: Tensor  # (B, heads)
    values: Tensor  # (B, signals)
    advantages: Tensor  # (B,)
    returns: Tensor  # (B, signals)
    sequences: "Sequences | None"

    @property
    def observations(self) -> Tensor:
        """The floats, shape (B, observation)."""
        return self.observation.vector


@dataclass(frozen=True, slots=True)
class Sequences:
    """How the rows of a batch are to be read by a recurrent network."""

    is_start: Tensor  # (steps, sequences): an episode starts with this step
    memory: Tensor  # (sequences, memory) of the actor before the first step
    critic_memory: Tensor  # (sequences, memory) of the critic


class Rollout:
    """The store. `record` fills it decision by decision; the learner adds values, advantages and returns."""

    def __init__(
        self, layout: Layout, shape: tuple[int, int], signal_count: int, memory: tuple[int, int], device: torch.device
    ) -> None:
        """An empty store.

        Args:
            layout: of the task.
            shape: decisions, environments.
            signal_count: reward signals.
            memory: floats of memory, and decisions per sequence, which divide the decisions; (0, 1): feed-forward.
            device: where it lies.
        """
        steps, envs = shape
        memory_size, self.sequence_length = memory

        def zeros(*sizes: int, dtype: torch.dtype = torch.float32) -> Tensor:
            return torch.zeros(sizes, dtype=dtype, device=device)

        def observation(count: int, *, image: ImageElement | None) -> Observation:
            return Observation(
                zeros(count, envs, layout.observation_size),
                zeros(count, envs, *image.shape, dtype=torch.uint8) if image is not None else None,
                zeros(count, envs, len(layout.privileged)) if layout.privileged else None,
            )

        self.observation = observation(steps + 1, image=layout.image)
        self.final_observation = observation(steps, image=None)  # of value where an episode ended
        self.final_images: list[Tensor] = []  # by decision, of the episodes that ended with it: ends are few
        self.observations = self.observation.vector
        self.final_observations = self.final_observation.vector
        self.actions = Actions(
            zeros(steps, envs, len(layout.continuous)), zeros(steps, envs, len(layout.branches), dtype=torch.int64)
        )
        self.log_probs = zeros(steps, envs, len(layout.continuous) + len(layout.branches))
        self.rewards = zeros(steps, envs)  # of the task
        self.is_terminated = zeros(steps, envs, dtype=torch.bool)
        self.is_truncated = zeros(steps, envs, dtype=torch.bool)
        self.is_skipped: Tensor | None = None  # (T, N), steps that were no decisions; None: there are none
        self.values = zeros(steps, envs, signal_count)
        self.advantages = zeros(steps, envs)  # of all signals together
        self.returns = zeros(steps, envs, signal_count)
        sequence_count = steps // self.sequence_length
        self.memories = zeros(sequence_count, envs, memory_size)  # of the actor, where sequences start
        self.critic_memories = zeros(sequence_count, envs, memory_size)

    @property
    def is_over(self) -> Tensor:
        """Where an episode ended with the decision, shape (T, N)."""
        return self.is_terminated | self.is_truncated

    @property
    def is_start(self) -> Tensor:
        """Where an episode starts with the decision, shape (T, N); not told of the first decision."""
        is_cut = self.is_cut
        return torch.cat((torch.zeros_like(is_cut[:1]), is_cut[:-1]))

    @property
    def is_cut(self) -> Tensor:
        """Where what follows belongs to another episode, shape (T, N)."""
        return self.is_over if self.is_skipped is None else self.is_over | self.is_skipped

    @property
    def decision_count(self) -> int:
        """Decisions that lie here."""
        return self.rewards.numel() if self.is_skipped is None else int((~self.is_skipped).sum())

    def decided(self, part: Tensor) -> Tensor:
        """What was decided of a part (T, N, ...): itself, or shape (1, decisions, ...) where steps were skipped."""
        return part if self.is_skipped is None else part[~self.is_skipped][None]

    def next_observations(self) -> Tensor:
        """What came of each decision; where the episode ended, what it saw last. Shape (T, N, observation)."""
        return torch.where(self.is_over[..., None], self.final_observations, self.observations[1:])

    def begin(self, task: TaskTensors) -> None:
        """Notes what the first decision sees."""
        self.observation.write(0, task.observation)
        self.final_images.clear()
        self.is_skipped = None

    def skip(self, t: int, is_skipped: Tensor) -> None:
        """Leaves out the steps `t` of some environments, shape (N,)."""
        if self.is_skipped is None:
            self.is_skipped = torch.zeros_like(self.is_terminated)
        self.is_skipped[t] = is_skipped

    def record(self, t: int, actions: Actions, log_probs: Tensor, task: TaskTensors) -> None:
        """Notes the decision `t` and what came of it; what it saw lies here already."""
        self.actions.continuous[t] = actions.continuous
        self.actions.branches[t] = actions.branches
        self.log_probs[t] = log_probs
        self.rewards[t] = task.rewards
        self.is_terminated[t] = task.is_terminated
        self.is_truncated[t] = task.is_truncated
        self.final_observation.write(t, task.final_observation)
        self.observation.write(t + 1, task.observation)
        if task.final_observation.image is not None:
            self.final_images.append(task.final_observation.image[task.is_terminated | task.is_truncated])

    def next_observation(self, t: int) -> Observation:
        """What came of the decisions `t`; where the episode ended, what it saw last. Shape (N, ...)."""
        is_over = self.is_over[t]
        following, last = self.observation[t + 1], self.final_observation[t]
        vector, image, privileged = following.vector, following.image, following.privileged
        if image is not None:
            image = image.clone()
            image[is_over] = self.final_images[t]
        if privileged is not None and last.privileged is not None:
            privileged = torch.where(is_over[:, None], last.privileged, privileged)
        return Observation(torch.where(is_over[:, None], last.vector, vector), image, privileged)

    def last_seen(self) -> Observation:
        """What the episodes that ended saw last, a row each, in the order of `is_over`."""
        last = self.final_observation[self.is_over]
        image = torch.cat(self.final_images) if self.observation.image is not None else None
        return Observation(last.vector, image, last.privileged)

    def transitions(self) -> Transitions:
        """As reward signals see it, (T, N)."""
        return Transitions(
            self.observations[:-1],
            self.next_observations(),
            bounded(self.actions.continuous),
            self.actions.branches,
            self.rewards,
            self.is_over,
        )

    def minibatches(self, batch_size: int, generator: torch.Generator) -> Iterator[Batch]:
        """The rollout once in random order, cut to whole minibatches as ML-Agents cuts it; at least one.

        Args:
            batch_size: decisions in a minibatch; of recurrent policies rounded down to whole sequences.
            generator: draws the order.
        """
        length = self.sequence_length
        steps, envs = self.rewards.shape
        count = steps * envs // length
        used = None if self.is_skipped is None else _used(self.is_skipped, length)
        count = count if used is None else len(used)
        size = min(max(batch_size // length, 1), count)
        order = torch.randperm(count, generator=generator, device=self.rewards.device)
        order = order if used is None else used[order]
        for first in range(0, count - size + 1, size):
            yield self._batch(order[first : first + size])

    def _batch(self, drawn: Tensor) -> Batch:
        """Of flat rows, or of sequences: (sequence, env) flat."""
        length = self.sequence_length
        envs = self.rewards.shape[1]
        rows, sequences = drawn, None
        if self.memories.shape[-1]:
            i_sequence, i_env = drawn // envs, drawn % envs
            step = i_sequence * length + torch.arange(length, device=drawn.device)[:, None]
            rows = (step * envs + i_env).flatten()
            sequences = Sequences(
                self.is_start.flatten()[rows].view(length, -1),
                self.memories.flatten(0, 1)[drawn],
                self.critic_memories.flatten(0, 1)[drawn],
            )

        def pick(stored: Tensor) -> Tensor:
            return stored.flatten(0, 1).index_select(0, rows)

        observation, counted = self.observation[:-1].mapped(pick), None
        if self.is_skipped is not None:
            counted = (~pick(self.is_skipped)).nonzero()[:, 0]
            rows = rows[counted]
        return Batch(
            rows,
            observation,
            counted,
            Actions(pick(self.actions.continuous), pick(self.actions.branches)),
            pick(self.log_probs),
            pick(self.values),
            pick(self.advantages),
            pick(self.returns),
            sequences,
        )


def _used(is_skipped: Tensor, length: int) -> Tensor:
    """The sequences (sequence, env), flat, in which something was decided."""
    steps, envs = is_skipped.shape
    return (~is_skipped).view(steps // length, length, envs).any(1).flatten().nonzero()[:, 0]
