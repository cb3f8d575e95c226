"""From a dataset to the simulator: soft actor-critic that begins with recorded decisions, near the recorded actions.

Its replay buffer is filled with decisions of the dataset up to a fraction, which newer ones replace in time; its policy
is held at the recorded actions by a weight that falls to 0.
"""

import torch

from policies.learn.config.behavior import SacHyperparameters
from policies.learn.rollout.replay_buffer import Replay, ReplayBatch
from policies.offline.store import OfflineStore


class ConservativeStart:
    """What soft actor-critic takes from a dataset."""

    def __init__(self, store: OfflineStore, hyperparameters: SacHyperparameters, device: torch.device | str) -> None:
        """A start from a store.

        Args:
            store: recorded decisions.
            hyperparameters: `prefill`, `hold`, `hold_steps` and `batch_size` count.
            device: of the batches.
        """
        self._store, self._settings, self._device = store, hyperparameters, device

    def fill(self, replay: Replay, generator: torch.Generator) -> None:
        """Fills the fraction of an empty replay buffer with decisions drawn from all, with replacement."""
        for _ in range(int(self._settings.prefill * replay.slots)):
            replay.add(self._drawn(replay.env_count, generator))

    def weight(self, steps: int) -> float:
        """By which the policy is held after so many decisions."""
        left = 1.0 - steps / self._settings.hold_steps if self._settings.hold_steps else 1.0
        return self._settings.hold * max(0.0, left)

    def batch(self, generator: torch.Generator) -> ReplayBatch:
        """Decisions to be held at."""
        return self._drawn(self._settings.batch_size, generator)

    def _drawn(self, count: int, generator: torch.Generator) -> ReplayBatch:
        indices = torch.randint(len(self._store), (count,), generator=generator, device=generator.device)
        batch = self._store.take(self._store.decisions[indices.cpu()])
        parts = {name: getattr(batch, name).to(self._device) for name in ReplayBatch.__dataclass_fields__}
        return ReplayBatch(**parts)
