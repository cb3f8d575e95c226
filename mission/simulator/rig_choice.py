"""The rig that flies with the engine that was asked for; an engine of others is imported only then."""

from collections.abc import Callable
from functools import partial

from common.airframe import Airframe
from common.airframes.plane import PlaneAirframe
from mission.flight_settings import EngineName
from sim.rig import Rig
from sim.stepped import SteppedRig


def rig_with(engine: EngineName, airframe: Airframe) -> Callable[..., Rig]:
    """What makes the rig of an airframe: it takes the arguments of `Rig`.

    Raises:
        ValueError: the native engine does not move it.
        ModuleNotFoundError: the engine is not installed.
    """
    aircraft = airframe.jsbsim_aircraft if isinstance(airframe, PlaneAirframe) else ""
    if engine == "native":
        if aircraft:
            raise ValueError(f"{airframe.name} is JSBSim's {aircraft}: the engine jsbsim moves it")
        return Rig
    if engine == "jsbsim" and isinstance(airframe, PlaneAirframe):
        from sim.engines.jsbsim_plane_engine import JsbsimPlaneEngine

        return partial(SteppedRig, engine=partial(JsbsimPlaneEngine, aircraft=aircraft))
    if engine == "jsbsim":
        from sim.engines.jsbsim_engine import JsbsimEngine

        return partial(SteppedRig, engine=JsbsimEngine)
    from sim.engines.bullet import BulletEngine

    return partial(SteppedRig, engine=BulletEngine)
