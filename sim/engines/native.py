"""The native engine alone: the bodies that the fused rig has within its one launch."""

from functools import cache
from typing import Any

import warp as wp

from common.kernels import vec8
from common.rng import draw_tick
from sim.bodies.body import Body
from sim.launches import RecordedLaunches
from sim.rig import Rig
from sim.truth import Truth
from sim.world.world import World, world_at

wp.set_module_options({"enable_backward": False})


@cache
def _step_kernel(body: Body, advance: Any) -> Any:
    """The kernel that moves bodies by one `advance`, their tick or their substep."""
    model_type, state_type, truth_of = body.Model, body.State, body.truth

    @wp.kernel(enable_backward=False, module="unique")
    def step(
        models: wp.array(dtype=model_type),
        states: wp.array(dtype=state_type),
        worlds: wp.array(dtype=World),
        i_world: wp.array(dtype=int),
        commands: wp.array(dtype=vec8),
        wind_ned: wp.array(dtype=wp.vec3),
        ticks: wp.array(dtype=wp.int64),
        truths: wp.array(dtype=Truth),
    ) -> None:
        i = wp.tid()
        world = world_at(worlds[i_world[i]], draw_tick(ticks[i]))
        state = advance(models[i], states[i], commands[i], wind_ned[i], world)
        states[i] = state
        truths[i] = truth_of(state)

    return step


class NativeEngine:
    """See sim/engines/engine.py.

    Args:
        rig: whose bodies it moves.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._launches = RecordedLaunches(lambda *arrays: self._record(rig.body.tick, *arrays))
        self._sublaunches = RecordedLaunches(lambda *arrays: self._record(rig.body.substep, *arrays))

    def boot(self, is_chosen: Any) -> None:
        self._rig.place(is_chosen)

    def step(self, commands: Any, wind_ned: Any) -> None:
        self._launches.of(commands, wind_ned)[0].launch()

    def substep(self, commands: Any, wind_ned: Any) -> None:
        self._sublaunches.of(commands, wind_ned)[0].launch()

    def _record(self, advance: Any, commands: Any, wind_ned: Any) -> list[Any]:
        a, rig = self._rig.arrays, self._rig
        rows = [a.model, a.body, a.worlds, a.i_world, commands, wind_ned, a.tick, a.truth]
        return [wp.launch(_step_kernel(rig.body, advance), rig.vehicle_count, rows, device=rig.device, record_cmd=True)]
