"""JSBSim moves planes: an aircraft that ships with it, its wings, engine, gear and atmosphere; our wind and heights.

In: commands and wind. Out: truth. Each tick of 4 ms is a step of JSBSim's. Its tank is no battery: ours stays full.
"""

from typing import Any

import numpy as np
import warp as wp

from sim.bodies.plane import PlaneState, held_tick, plane_truth
from sim.engines.jsbsim_aircraft import JsbsimAircraft
from sim.engines.left_poses import LeftPoses
from sim.rig import Rig
from sim.truth import Truth
from sim.world.world import World, WorldMap, ground_height

wp.set_module_options({"enable_backward": False})

_HARD_M_S = 3.05  # 14 CFR 23.473: gear is designed for a descent of at most 10 ft/s


@wp.kernel(enable_backward=False)
def hold(states: wp.array(dtype=PlaneState)) -> None:
    """The tick of those that are held in hands."""
    i = wp.tid()
    if states[i].is_held == 1:
        states[i] = held_tick(states[i])


@wp.kernel(enable_backward=False)
def conclude(
    states: wp.array(dtype=PlaneState),
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=int),
    truths: wp.array(dtype=Truth),
) -> None:
    """The tick is over: height and truth."""
    i = wp.tid()
    pos_ned = states[i].pos_ned
    states[i].height_agl_m = -pos_ned[2] - ground_height(worlds[i_world[i]], pos_ned[0], pos_ned[1])
    truths[i] = plane_truth(states[i])


class JsbsimPlaneEngine:
    """See sim/engines/engine.py.

    Args:
        rig: whose planes it moves, on the CPU, in one world.
        aircraft: the name of theirs in JSBSim.

    Raises:
        ValueError: the rig has other vehicles, or a world for each, or JSBSim has no such aircraft.
    """

    def __init__(self, rig: Rig, *, aircraft: str) -> None:
        if rig.body.State is not PlaneState:
            raise ValueError("an aircraft of JSBSim's is a plane, and these vehicles are none")
        if not isinstance(rig.world, WorldMap):
            raise ValueError("the engine jsbsim has one world for all planes")
        self._rig, self._world = rig, rig.world
        self._states: Any = rig.arrays.body.numpy()  # live
        self._name = aircraft
        self._aircraft = [self._make(i) for i in range(rig.vehicle_count)]
        self._left = LeftPoses(self._states)

    def boot(self, is_chosen: Any) -> None:
        self._rig.place(is_chosen)
        for i in np.flatnonzero(is_chosen.numpy()):
            self._aircraft[i] = self._make(int(i))  # engine, gear and tank of before count for nothing
        self._left.forget(is_chosen.numpy())

    def step(self, commands: Any, wind_ned: Any) -> None:
        for moved in self._left.moved():
            row = self._states[moved]
            row["height_agl_m"] = -row["pos_ned"][2] - self._world.height(*row["pos_ned"][:2].tolist())
            self._aircraft[moved].put(row)
        asked, wind = commands.numpy(), wind_ned.numpy()
        for i, aircraft in enumerate(self._aircraft):
            row = self._states[i]
            if row["is_held"]:
                continue
            if row["is_crashed"]:
                aircraft.stop()
            was_on_ground, sank_m_s = row["is_on_ground"], float(row["vel_ned"][2])
            aircraft.step(row, asked[i].tolist(), wind[i].tolist())
            if row["is_on_ground"] and not was_on_ground:
                row["impact_speed"] = max(float(row["impact_speed"]), sank_m_s)
                row["is_crashed"] |= sank_m_s > _HARD_M_S
        a, count = self._rig.arrays, self._rig.vehicle_count
        wp.launch(hold, count, [a.body])
        self._left.leave()
        wp.launch(conclude, count, [a.body, a.worlds, a.i_world, a.truth])

    def _make(self, i: int) -> JsbsimAircraft:
        ratio = self._rig.arrays.model.numpy()["home_density_ratio"][i]
        return JsbsimAircraft(self._name, _altitude_m(float(ratio)))


def _altitude_m(density_ratio: float) -> float:
    """Of home over sea level, by the density of its air: the inverse of `density_ratio_at`."""
    return (1.0 - density_ratio ** (1.0 / 4.25588)) / 2.25577e-5
