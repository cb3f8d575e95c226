"""The rig that flies with the engine that was asked for; an engine of others is imported only then."""

from collections.abc import Callable
from functools import partial

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
    if engine == "jsbsim":
        from sim.engines.jsbsim_engine import JsbsimEngine

        return partial(SteppedRig, engine=JsbsimEngine)
    from sim.engines.bullet import BulletEngine

    return partial(SteppedRig, engine=BulletEngine)
