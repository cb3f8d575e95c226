"""The rig that flies with the engine that was asked for; an engine of others is imported only then."""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from mission.flight_settings import EngineName
from sim.rig import Rig
from sim.stepped import SteppedRig


def rig_with(engine: EngineName) -> Callable[..., Rig]:
    """What makes the rig: it takes the arguments of `Rig`.

    Raises:
        ModuleNotFoundError: the engine is not installed.
    """
    if engine == "native":
        return Rig
    with _silence():  # Bullet tells when it was built
        from sim.engines.bullet import BulletEngine
    return partial(SteppedRig, engine=BulletEngine)


@contextmanager
def _silence() -> Iterator[None]:
    """Standard output goes nowhere, that of libraries too."""
    out = os.dup(1)
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        ctypes.CDLL(None).fflush(None)
        os.dup2(out, 1)
        os.close(out)
