"""PyBullet moves multirotors: its rigid bodies and contacts, our rotors, air and battery.

In: motor commands and wind. Out: truth. Each millisecond a kernel says what rotors and air do to the body, and Bullet
takes a step (semi-implicit Euler) with that force and torque; feet, rotor discs, terrain, trunks, crowns, walls and
boxes are shapes of Bullet's, rigid and with friction. Its world is north, west and up, its bodies forward, left and up.
Trees and boxes are put there as a vehicle comes near.
"""

from typing import Any
from weakref import finalize

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import inverse, rotated
from common.geodesy import GRAVITY_M_S2
from common.kernels import SUBSTEPS, TICK_S, vec8
from common.rng import draw_tick
from sim.bodies.multirotor import BodyState, air_wrench, density_ratio, drain_battery, step_inputs, truth_of
from sim.bodies.multirotor_model import MultirotorModel
from sim.engines.bullet_world import BulletWorld
from sim.engines.native import NativeEngine
from sim.engines.quiet_bullet import pybullet
from sim.recorded_launches import RecordedLaunches
from sim.rig import Rig
from sim.truth import Truth
from sim.world.world import World, WorldMap, ground_height, world_at

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_FOOT_M = 0.01  # radius of the balls that stand for feet
_DISC_M = 0.04  # thickness of the disc that holds the rotors; guess
_LOW_M = 3.0  # over ground: nearer it may be touched
_FRICTION = 0.7  # of feet, as the native engine's; the ground's is 1, Bullet takes the product
_VEHICLES = 1 << 6  # group of collisions: they pass through each other, as with the native engine
_FLU = np.array([1.0, -1.0, -1.0])  # frd from flu, and ned from nwu
_POSE = ["pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd"]
_UP_M_S2 = np.array([0.0, 0.0, -GRAVITY_M_S2])


@wp.struct
class BulletRow:
    """One vehicle on its way between Bullet and us, in Bullet's axes."""

    pos: wp.vec3  # [m] from Bullet
    q: wp.quat
    vel: wp.vec3  # [m/s]
    omega: wp.vec3  # [rad/s] in the world
    force: wp.vec3  # [N] to Bullet, in the world
    torque: wp.vec3  # [N m]


@wp.func
def flipped(v: wp.vec3) -> wp.vec3:
    """Ned from nwu, frd from flu, and back."""
    return wp.vec3(v[0], -v[1], -v[2])


@wp.kernel(enable_backward=False)
def push(
    models: wp.array(dtype=MultirotorModel),
    states: wp.array(dtype=BodyState),
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=int),
    commands: wp.array(dtype=vec8),
    wind_ned: wp.array(dtype=wp.vec3),
    ticks: wp.array(dtype=wp.int64),
    rows: wp.array(dtype=BulletRow),
) -> None:
    """Force and torque over the next millisecond, the rotors' gyroscopic one included; turns the rotors."""
    i = wp.tid()
    model = models[i]
    body = states[i]
    world = world_at(worlds[i_world[i]], draw_tick(ticks[i]))
    inputs = step_inputs(model, body, commands[i], wind_ned[i], world, _SUBSTEP_S)
    turn = wp.quat_to_matrix(body.q_ned_from_frd)
    wrench = air_wrench(model, body, inputs, wp.transpose(turn))
    torque_frd = wrench.torque_frd - wp.cross(body.omega_frd, wp.vec3(0.0, 0.0, wrench.momentum_z))
    rows[i].force = flipped(turn * wrench.force_frd)
    rows[i].torque = flipped(turn * torque_frd)
    states[i].rotor_speed = wrench.speed


@wp.kernel(enable_backward=False)
def take(states: wp.array(dtype=BodyState), rows: wp.array(dtype=BulletRow)) -> None:
    """What Bullet has made of it: motion, and what the IMU felt of the tick so far."""
    i = wp.tid()
    body = states[i]
    row = rows[i]
    part = 1.0 / float(SUBSTEPS)
    vel_ned = flipped(row.vel)
    felt_ned = (vel_ned - body.vel_ned) / _SUBSTEP_S - wp.vec3(0.0, 0.0, GRAVITY_M_S2)
    body.pos_ned = flipped(row.pos)
    body.vel_ned = vel_ned
    body.q_ned_from_frd = wp.quat(row.q[0], -row.q[1], -row.q[2], row.q[3])
    omega_frd = wp.quat_rotate_inv(body.q_ned_from_frd, flipped(row.omega))
    body.accel_frd += part * wp.quat_rotate_inv(body.q_ned_from_frd, felt_ned)
    body.gyro_frd += (0.5 * part) * (body.omega_frd + omega_frd)
    body.omega_frd = omega_frd
    states[i] = body


@wp.kernel(enable_backward=False)
def begin(states: wp.array(dtype=BodyState)) -> None:
    """Nothing is felt yet of the tick."""
    i = wp.tid()
    states[i].accel_frd = wp.vec3()
    states[i].gyro_frd = wp.vec3()
    states[i].is_on_ground = 0


@wp.kernel(enable_backward=False)
def conclude(
    models: wp.array(dtype=MultirotorModel),
    states: wp.array(dtype=BodyState),
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=int),
    truths: wp.array(dtype=Truth),
) -> None:
    """The tick is over: battery, height, truth. What is under ground, or out of the map, has crashed and lies there."""
    i = wp.tid()
    model = models[i]
    body = states[i]
    body.height_agl_m = -body.pos_ned[2] - ground_height(worlds[i_world[i]], body.pos_ned[0], body.pos_ned[1])
    if body.height_agl_m < 0.0:  # too fast for the ground, which has no thickness
        body.impact_speed = wp.max(body.impact_speed, wp.length(body.vel_ned))
        body.is_crashed = 1
        body.pos_ned = body.pos_ned + wp.vec3(0.0, 0.0, body.height_agl_m)
        body.height_agl_m = 0.0
        body.vel_ned = wp.vec3()
        body.omega_frd = wp.vec3()
    body = drain_battery(model, body, density_ratio(model, body.pos_ned[2]), TICK_S)
    states[i] = body
    truths[i] = truth_of(body)


class BulletEngine:
    """See sim/engines/engine.py.

    Args:
        rig: whose multirotors it moves, on the CPU, in one world.
        damping: of linear and angular velocity [1/s]; Bullet's own default is 0.04, which no air explains.

    Raises:
        ValueError: the rig has other vehicles, or a world for each.
    """

    def __init__(self, rig: Rig, *, damping: float = 0.0) -> None:
        if rig.body.State is not BodyState:
            raise ValueError("the engine pybullet moves multirotors; other vehicles have the native one")
        if not isinstance(rig.world, WorldMap):
            raise ValueError("the engine pybullet has one world for all vehicles")
        self._rig = rig
        self._native = NativeEngine(rig)  # for what is held in hands
        self._client = pybullet.connect(pybullet.DIRECT)
        finalize(self, pybullet.disconnect, self._client)
        pybullet.setGravity(*_UP_M_S2, physicsClientId=self._client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=TICK_S / SUBSTEPS,
            numSubSteps=0,
            solverResidualThreshold=0.0,  # or what stands creeps
            deterministicOverlappingPairs=1,
            physicsClientId=self._client,
        )
        self._world = BulletWorld(rig.world, self._client)
        self._states: NDArray[Any] = rig.arrays.body.numpy()  # live
        models = rig.arrays.model.numpy()
        self._damping = damping
        self._bodies = [self._make_body(model, damping) for model in models]
        self._crash_m_s = [float(model["contact"]["crash_speed_m_s"]) for model in models]
        self._feet_m = [float(model["contact"]["leg_frd"][2]) - 3.0 * _FOOT_M for model in models]
        rows: Any = wp.zeros(rig.vehicle_count, dtype=BulletRow)
        self._bullet_rows, self._rows = rows, rows.numpy()  # live
        self._launches = RecordedLaunches(self._record)
        self._left = self._states[_POSE].copy()  # as the last step has left the rows

    def boot(self, is_chosen: Any) -> None:
        self._rig.place(is_chosen)
        for i in np.flatnonzero(is_chosen.numpy()):  # anew: contacts of before count for nothing
            pybullet.removeBody(self._bodies[i], physicsClientId=self._client)
            self._bodies[i] = self._make_body(self._rig.arrays.model.numpy()[i], self._damping)
            self._take_over(int(i))
        self._left = self._states[_POSE].copy()

    def step(self, commands: Any, wind_ned: Any) -> None:
        if self._states["is_held"].any():
            self._native.step(commands, wind_ned)
            return
        for moved in np.flatnonzero(self._states[_POSE] != self._left):  # somebody has put it elsewhere
            self._take_over(int(moved))
        begun, pushed, taken, concluded = self._launches.of(commands, wind_ned)
        self._world.furnish(self._states["pos_ned"], int(self._rig.arrays.tick.numpy()[0]))
        begun.launch()
        for _ in range(SUBSTEPS):
            pushed.launch()
            for body, row in zip(self._bodies, self._rows, strict=True):
                self._push(body, row)
            pybullet.stepSimulation(physicsClientId=self._client)
            for body, row in zip(self._bodies, self._rows, strict=True):
                self._read(body, row)
            before = self._states[_POSE].copy()
            taken.launch()
            for i, body in enumerate(self._bodies):
                if self._states[i]["height_agl_m"] < _LOW_M or self._world.is_near:
                    self._touch(i, body, before[i])
        self._left = self._states[_POSE].copy()
        concluded.launch()

    def substep(self, commands: Any, wind_ned: Any) -> None:  # noqa: ARG002
        raise ValueError("the engine pybullet moves by ticks: its vehicles are flown at 250 Hz")

    def _record(self, commands: Any, wind_ned: Any) -> list[Any]:
        a, rows = self._rig.arrays, self._bullet_rows
        where = [a.model, a.body, a.worlds, a.i_world]
        inputs = {
            begin: [a.body],
            push: [*where, commands, wind_ned, a.tick, rows],
            take: [a.body, rows],
            conclude: [*where, a.truth],
        }
        count = self._rig.vehicle_count
        return [wp.launch(kernel, count, of, record_cmd=True) for kernel, of in inputs.items()]

    def _make_body(self, model: Any, damping: float) -> int:
        """A vehicle: balls for its feet, a disc for its rotors."""
        contact, leg = model["contact"], model["contact"]["leg_frd"].astype(float)
        feet = [[x, y, _FOOT_M - leg[2]] for x in (leg[0], -leg[0]) for y in (leg[1], -leg[1])]
        rotor_up = -float(model["rotor_z"][: int(model["rotor_count"])].mean())
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_SPHERE] * 4 + [pybullet.GEOM_CYLINDER],
            radii=[_FOOT_M] * 4 + [float(contact["hull_radius_m"])],
            lengths=[0.0] * 4 + [_DISC_M],
            collisionFramePositions=[*feet, [0.0, 0.0, rotor_up]],
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(float(model["mass_kg"]), shape, physicsClientId=self._client)
        pybullet.setCollisionFilterGroupMask(body, -1, _VEHICLES, ~_VEHICLES, physicsClientId=self._client)
        pybullet.changeDynamics(
            body,
            -1,
            localInertiaDiagonal=model["inertia_frd"].astype(float).tolist(),
            linearDamping=damping,
            angularDamping=damping,
            lateralFriction=_FRICTION,
            restitution=0.0,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=self._client,
        )
        return body

    def _take_over(self, i: int) -> None:
        """Puts Bullet's body where the row has it."""
        row = self._states[i]
        x, y, z, w = (float(value) for value in row["q_ned_from_frd"])
        omega_ned = rotated(row["q_ned_from_frd"].tolist(), row["omega_frd"].tolist())
        body, client = self._bodies[i], self._client
        place = (_FLU * row["pos_ned"]).tolist()
        pybullet.resetBasePositionAndOrientation(body, place, [x, -y, -z, w], physicsClientId=client)
        vel, omega = _FLU * row["vel_ned"], _FLU * omega_ned
        pybullet.resetBaseVelocity(body, vel.tolist(), omega.tolist(), physicsClientId=client)

    def _push(self, body: int, row: Any) -> None:
        client, world = self._client, pybullet.WORLD_FRAME
        place = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0]
        pybullet.applyExternalForce(body, -1, row["force"].tolist(), place, world, physicsClientId=client)
        pybullet.applyExternalTorque(body, -1, row["torque"].tolist(), world, physicsClientId=client)

    def _read(self, body: int, row: Any) -> None:
        row["pos"], row["q"] = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        row["vel"], row["omega"] = pybullet.getBaseVelocity(body, physicsClientId=self._client)

    def _touch(self, i: int, body: int, before: Any) -> None:
        """Looks at what a body touches, and how it moved before: feet on the ground, impacts, a rotor that strikes."""
        contacts = pybullet.getContactPoints(body, physicsClientId=self._client)
        if not contacts:
            return
        row = self._states[i]
        q = row["q_ned_from_frd"].tolist()
        for contact in contacts:
            other, place, normal, force = contact[2], contact[5], contact[7], contact[9]
            if force <= 0.0:
                continue
            arm_frd = rotated(inverse(q), (_FLU * place - row["pos_ned"]).tolist())
            is_foot = arm_frd[2] > self._feet_m[i]
            spun = rotated(q, np.cross(before["omega_frd"], arm_frd).tolist())
            closing = -float((_FLU * normal) @ (before["vel_ned"] + spun))
            row["impact_speed"] = max(float(row["impact_speed"]), closing)
            if is_foot:
                row["is_on_ground"] = 1
            is_strike = other == self._world.ground and not is_foot
            if is_strike or closing > self._crash_m_s[i]:
                row["is_crashed"] = 1
