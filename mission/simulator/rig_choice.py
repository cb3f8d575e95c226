"""The rig that flies with the engine that was asked for; an engine of others is imported only then."""

from collections.abc import Callable
from functools import partial

from mission.flight_settings import EngineName
from sim.engines.engine import Engine
from sim.engines.native import NativeEngine
from sim.rig import Rig
from sim.stepped import SteppedRig


def engine_named(engine: EngineName) -> Callable[[Rig], Engine]:
    """What makes the engine.

    Raises:
        ModuleNotFoundError: it is not installed.
    """
    if engine == "native":
        return NativeEngine
    from sim.engines.bullet import BulletEngine

    return BulletEngine


def rig_with(engine: EngineName) -> Callable[..., Rig]:
    """What makes the rig: it takes the arguments of `Rig`.

    Raises:
        ModuleNotFoundError: the engine is not installed.
    """
    return Rig if engine == "native" else partial(SteppedRig, engine=engine_named(engine))
