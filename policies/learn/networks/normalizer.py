"""Running mean and variance of what networks see, as ML-Agents keeps them, and of the returns they are to estimate.

Counts start as if one zero with variance 1 had been seen, as ML-Agents' do: nothing is divided by zero before the
first update. Sums are merged batch by batch (Chan, Golub and LeVeque 1979, eq. 2.1), in float64.
"""

import torch
from torch import Tensor, nn

LIMIT = 5.0  # deviations an input may be off; ML-Agents' number


class Normalizer(nn.Module):
    """Brings vectors to mean 0 and deviation 1; its statistics are buffers, so they are saved with the network."""

    count: Tensor
    mean: Tensor
    squares: Tensor

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("count", torch.ones((), dtype=torch.float64))
        self.register_buffer("mean", torch.zeros(size, dtype=torch.float64))
        self.register_buffer("squares", torch.ones(size, dtype=torch.float64))  # summed squared distances to the mean

    @torch.no_grad()
    def update(self, vectors: Tensor) -> None:
        """Takes vectors into account, shape (..., size)."""
        rows = vectors.reshape(-1, vectors.shape[-1])
        added = rows.shape[0]
        row_mean = rows.mean(0)
        row_var = (rows - row_mean).square_().mean(0)  # torch.var_mean takes ten times as long
        total = self.count + added
        apart = row_mean - self.mean
        self.squares += row_var.double() * added + apart.square() * (self.count * added / total)
        self.mean += apart * (added / total)
        self.count.copy_(total)

    @torch.no_grad()
    def take(self, mean: Tensor, variance: Tensor, count: int) -> None:
        """Takes the statistics of so many vectors, shapes (size,), in place of all that was seen before."""
        self.count.copy_(torch.tensor(count + 1))
        self.mean.copy_(mean)
        self.squares.copy_(variance * count + 1.0)

    @property
    def deviation(self) -> Tensor:
        """Shape (size,), float32."""
        return (self.squares / self.count).sqrt().float().clamp(min=1e-6)

    def forward(self, vectors: Tensor) -> Tensor:
        """Normalised and held within ±5, shape as given."""
        return self.unbounded(vectors).clamp(-LIMIT, LIMIT)

    def unbounded(self, vectors: Tensor) -> Tensor:
        """Normalised."""
        return (vectors - self.mean.float()) / self.deviation

    def inverse(self, vectors: Tensor) -> Tensor:
        """Back in their own unit."""
        return vectors * self.deviation + self.mean.float()
