"""Which decisions each minibatch holds: drawn uniformly with replacement, many minibatches at a time."""

import torch
from torch import Tensor

from policies.offline.store import OfflineStore


class Draws:
    """Rows of a store, of all episodes or of the best."""

    def __init__(self, store: OfflineStore, batch_size: int, sequence_length: int, best_fraction: float) -> None:
        """Draws from a store.

        Args:
            store: what is drawn from.
            batch_size: decisions of a minibatch.
            sequence_length: consecutive decisions that belong together; 1: each is for itself.
            best_fraction: of the episodes, those of the greatest returns, at least one.
        """
        self._rows = store.decisions if best_fraction >= 1.0 else best_decisions(store, best_fraction)
        self._length = min(sequence_length, len(self._rows))
        self._is_sequence = sequence_length > 1
        self._count = max(1, batch_size // self._length)

    def __len__(self) -> int:
        """Decisions that are drawn from."""
        return len(self._rows)

    def block(self, steps: int, generator: torch.Generator) -> Tensor:
        """Rows of so many minibatches, shape (steps, B); of sequences (steps, length, sequences)."""
        firsts = torch.randint(len(self._rows) - self._length + 1, (steps, self._count), generator=generator)
        if not self._is_sequence:
            return self._rows[firsts]
        return self._rows[firsts[:, None] + torch.arange(self._length)[:, None]]


def best_decisions(store: OfflineStore, fraction: float) -> Tensor:
    """The rows of the decisions of the best episodes, in the order they were recorded."""
    count = max(1, round(fraction * store.episode_count))
    best = store.episode_returns().argsort(descending=True, stable=True)[:count].sort().values
    spans = zip(store.starts[best].tolist(), store.lengths[best].tolist(), strict=True)
    return torch.cat([torch.arange(first, first + length) for first, length in spans])
