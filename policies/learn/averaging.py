"""What processes that train together share: each a part of every minibatch, and the mean of their gradients.

The group is that of torch.distributed (`policies/learn/processes.py` makes it). A process that trains alone has the
whole minibatch, and its mean is its own.
"""

import torch
from torch import Tensor, distributed


def rank() -> int:
    """Which of the processes this is; the first, 0, judges and writes files."""
    return distributed.get_rank() if distributed.is_initialized() else 0


def process_count() -> int:
    """How many train together."""
    return distributed.get_world_size() if distributed.is_initialized() else 1


def averaged(values: Tensor) -> Tensor:
    """The mean over all processes, the same bits in each; of one process the values themselves.

    Raises:
        RuntimeError: another process has ended.
    """
    if process_count() == 1:
        return values.detach()
    summed = values.detach().clone()
    distributed.all_reduce(summed)
    return summed.div_(process_count())


def own_part(batch: Tensor, dim: int = 0) -> Tensor:
    """This process's part of a batch that each has drawn whole: every n-th element along a dimension."""
    count = process_count()
    if count == 1:
        return batch
    return batch.index_select(dim, torch.arange(rank(), batch.shape[dim], count, device=batch.device))


def own_noise(like: Tensor, generator: torch.Generator) -> Tensor:
    """Standard normal noise for this process's part of a batch; all processes' generators stay in step.

    Args:
        like: of the part, shape (B, elements).
        generator: the same in each process.
    """
    shape = (like.shape[0] * process_count(), *like.shape[1:])
    return own_part(torch.randn(shape, generator=generator, device=like.device))


def call_round(*, goes_on: bool) -> None:
    """The first process tells the others that it begins a round, or that there is none left; else nothing happens.

    Raises:
        RuntimeError: another process has ended.
    """
    if process_count() > 1 and rank() == 0:
        distributed.broadcast(torch.tensor([int(goes_on)]), src=0)


def await_round() -> bool:
    """Waits for what the first process calls; whether it is another round.

    Raises:
        RuntimeError: another process has ended.
    """
    word = torch.zeros(1, dtype=torch.int64)
    distributed.broadcast(word, src=0)
    return bool(word.item())
