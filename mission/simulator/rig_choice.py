"""The rig that flies with the engine that was asked for; an engine of others is imported only then."""

from collections.abc import Callable
from functools import partial

from common.airframe import Airframe
from common.airframes.plane import PlaneAirframe
from mission.flight_settings import EngineName
from sim.engines.engine import Engine
from sim.engines.native import NativeEngine
from sim.rig import Rig
from sim.stepped import SteppedRig


def engine_named(engine: EngineName, airframe: Airframe) -> Callable[[Rig], Engine]:
    """What makes the engine that moves an airframe.

    Raises:
        ModuleNotFoundError: it is not installed.
    """
    if engine == "native":
        return NativeEngine
    if engine == "jsbsim" and isinstance(airframe, PlaneAirframe):
        from sim.engines.jsbsim_plane_engine import JsbsimPlaneEngine

        return partial(JsbsimPlaneEngine, aircraft=airframe.jsbsim_aircraft)
    if engine == "jsbsim":
        from sim.engines.jsbsim_engine import JsbsimEngine

        return JsbsimEngine
    from sim.engines.bullet import BulletEngine

    return BulletEngine


def rig_with(engine: EngineName, airframe: Airframe) -> Callable[..., Rig]:
    """What makes the rig of an airframe: it takes the arguments of `Rig`.

    Raises:
        ValueError: the native engine does not move it.
        ModuleNotFoundError: the engine is not installed.
    """
    if engine == "native" and isinstance(airframe, PlaneAirframe) and airframe.jsbsim_aircraft:
        raise ValueError(f"{airframe.name} is JSBSim's {airframe.jsbsim_aircraft}: the engine jsbsim moves it")
    return Rig if engine == "native" else partial(SteppedRig, engine=engine_named(engine, airframe))
