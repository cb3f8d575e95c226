"""How many threads torch computes with while training and judging; the same sums each time on the same cores."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def few_threads(*, has_images: bool = False, processes: int = 1) -> Iterator[None]:
    """Half the cores that this process may use, ML-Agents' rule, or all for networks of images; at most 4 either way.

    Processes that train together share the cores.

    More only get in each other's way in small networks; convolutions share their work well.
    """
    cores = len(os.sched_getaffinity(0))
    before = torch.get_num_threads()
    torch.set_num_threads(max(1, min((cores if has_images else cores // 2) // processes, 4)))
    try:
        yield
    finally:
        torch.set_num_threads(before)


def use_one_thread() -> None:
    """From now on: the same sums in every process, on however many cores."""
    torch.set_num_threads(1)
