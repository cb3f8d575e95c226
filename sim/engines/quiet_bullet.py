"""PyBullet, imported without the line that it prints when it was built."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def _silence() -> Iterator[None]:
    """Standard error goes nowhere, that of libraries too."""
    err = os.dup(2)
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(err, 2)
        os.close(err)


with _silence():
    import pybullet

__all__ = ["pybullet"]
