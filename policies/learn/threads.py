"""How many threads torch computes with while training and judging: ML-Agents' rule, the same sums each time."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def few_threads() -> Iterator[None]:
    """Half the cores, at most 4: more only get in each other's way in small networks."""
    before = torch.get_num_threads()
    torch.set_num_threads(max(1, min((os.cpu_count() or 1) // 2, 4)))
    try:
        yield
    finally:
        torch.set_num_threads(before)
