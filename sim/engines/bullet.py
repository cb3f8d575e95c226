"""PyBullet moves bodies by its rigid-body dynamics and contacts; our motors, legs, wheels, air and battery push them.

In: motor commands and wind. Out: truth. Each millisecond a kernel says what legs or wheels and air do to the body, and
Bullet takes a step with that force and torque; hulls, terrain, trunks, crowns, walls and boxes are shapes of Bullet's,
rigid and with friction. Trees and boxes are put there as a vehicle comes near. What a class of bodies adds is a
`BulletBody`.
"""

from typing import Any
from weakref import finalize

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.geodesy import GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S
from sim.bodies.body import MULTIROTOR_BODY
from sim.bodies.rover import ROVER_BODY
from sim.engines.bullet_kernels import BulletRow, bullet_kernels
from sim.engines.bullet_multirotor import BULLET_MULTIROTOR
from sim.engines.bullet_rover import BULLET_ROVER
from sim.engines.bullet_vehicle import BulletVehicle
from sim.engines.bullet_world import BulletWorld
from sim.engines.left_poses import LeftPoses
from sim.engines.quiet_bullet import pybullet
from sim.launches import RecordedLaunches
from sim.rig import Rig
from sim.world.world import World, WorldMap

_PARTS = {MULTIROTOR_BODY: BULLET_MULTIROTOR, ROVER_BODY: BULLET_ROVER}
_LOW_M = 3.0  # over ground: nearer it may be touched


def _bare(world: WorldMap) -> World:
    """What our legs and wheels stand on, and the other vehicles in it: all else that is solid is Bullet's."""
    bare = World()
    bare.terrain, bare.neighbours, bare.solids = world.kernel.terrain, world.kernel.neighbours, world.kernel.solids
    return bare


class BulletEngine:
    """See sim/engines/engine.py.

    Args:
        rig: whose vehicles it moves, on the CPU, in one world.
        damping: of linear and angular velocity [1/s]; Bullet's own default is 0.04, which no air explains.
        has_contacts: the vehicles touch each other, and are put apart before the first step; otherwise they pass
            through each other, as with the native engine. (Those of other rigs in its world they touch as there.)

    Raises:
        ValueError: the rig has vehicles of another class, or a world for each.
    """

    def __init__(self, rig: Rig, *, damping: float = 0.0, has_contacts: bool = False) -> None:
        if rig.body not in _PARTS:
            raise ValueError("the engine pybullet does not move vehicles of this class; the native one does")
        if not isinstance(rig.world, WorldMap):
            raise ValueError("the engine pybullet has one world for all vehicles")
        self._rig, self._part = rig, _PARTS[rig.body]
        self._damping, self._has_contacts = damping, has_contacts
        self._client = pybullet.connect(pybullet.DIRECT)
        finalize(self, pybullet.disconnect, self._client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY_M_S2, physicsClientId=self._client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=TICK_S / SUBSTEPS,
            numSubSteps=0,
            solverResidualThreshold=0.0,  # or what stands creeps
            deterministicOverlappingPairs=1,
            physicsClientId=self._client,
        )
        self._world = BulletWorld(rig.world, self._client)
        self._bare_worlds: Any = wp.array([_bare(rig.world)], dtype=World)
        self._states: NDArray[Any] = rig.arrays.body.numpy()  # live
        self._hulls = [self._part.hull(model, self._client) for model in rig.arrays.model.numpy()]
        self._vehicles = [self._make_vehicle(i) for i in range(rig.vehicle_count)]
        rows: Any = wp.zeros(rig.vehicle_count, dtype=BulletRow)
        self._bullet_rows, self._rows = rows, rows.numpy()  # live
        self._inputs = wp.zeros(rig.vehicle_count, dtype=self._part.Inputs)
        self._launches = RecordedLaunches(self._record)
        self._left = LeftPoses(self._states)

    def boot(self, is_chosen: Any) -> None:
        self._rig.place(is_chosen)
        for i in np.flatnonzero(is_chosen.numpy()):
            self._vehicles[i].remove()
            self._vehicles[i] = self._make_vehicle(int(i))
        self._left.forget(is_chosen.numpy())

    def step(self, commands: Any, wind_ned: Any) -> None:
        put, begin, push, take, end = self._launches.of(commands, wind_ned)
        is_held = self._states["is_held"] != 0
        moved_rows = self._left.moved()
        if moved_rows:
            put.launch()
            for moved in moved_rows:
                self._vehicles[moved].put(self._rows[moved])
        self._world.furnish(self._states["pos_ned"], int(self._rig.arrays.tick.numpy()[0]))
        begin.launch()
        for _ in range(SUBSTEPS):
            push.launch()
            for vehicle, row in zip(self._vehicles, self._rows, strict=True):
                vehicle.push(row)
            pybullet.stepSimulation(physicsClientId=self._client)
            for vehicle, row in zip(self._vehicles, self._rows, strict=True):
                vehicle.read(row)
            before = self._left.now()
            take.launch()
            self._touch(before, is_held)
        self._left.leave()
        end.launch()

    def _touch(self, before: Any, is_held: NDArray[Any]) -> None:
        may_touch = self._world.is_near or self._has_contacts
        motions = {vehicle.body: row for vehicle, row in zip(self._vehicles, before, strict=True)}
        for i, vehicle in enumerate(self._vehicles):
            if not is_held[i] and (may_touch or self._states[i]["height_agl_m"] < _LOW_M):
                vehicle.touch(self._states[i], motions, self._world.ground)

    def _make_vehicle(self, i: int) -> BulletVehicle:
        model, hull = self._rig.arrays.model.numpy()[i], self._hulls[i]
        return BulletVehicle(self._client, hull, model, damping=self._damping, has_contacts=self._has_contacts)

    def _record(self, commands: Any, wind_ned: Any) -> list[Any]:
        a, rows, inputs = self._rig.arrays, self._bullet_rows, self._inputs
        where = [a.model, a.body, self._bare_worlds, a.i_world]
        kernels = bullet_kernels(self._rig.body, self._part)
        given = [
            [a.body, rows],
            [*where, commands, wind_ned, a.tick, inputs],
            [a.model, a.body, inputs, rows],
            [a.body, rows],
            [*where, inputs, a.truth],
        ]
        count = self._rig.vehicle_count
        return [wp.launch(kernel, count, of, record_cmd=True) for kernel, of in zip(kernels, given, strict=True)]
