"""What does an engine take for a millisecond of a multirotor in the air or a rover, its own part of the loop alone?

Beside each of others, as a ratio: what their own library takes in the same minute to be told forces or controls, to
step and to be asked for the motion, written as its users write it. That has no rotors, air, battery, ground or trees.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from bench.row import Row, require
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import SUBSTEPS, TICK_S
from sim.bodies.vehicles import class_of
from sim.engines.bullet import BulletEngine
from sim.engines.engine import Engine
from sim.engines.jsbsim_engine import JsbsimEngine
from sim.engines.jsbsim_plane_engine import JsbsimPlaneEngine
from sim.engines.jsbsim_planet import MOTION
from sim.engines.native import NativeEngine
from sim.engines.quiet_bullet import pybullet
from sim.engines.quiet_jsbsim import jsbsim
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import build_world

COMMAND = "python -m bench engines"
TICKS, ROUNDS = 700, 5  # it falls 35 m
HIGH_M = 60.0
TARGET_US = 25.0
BARE_STEPS = 5000
CESSNA_CONTROLS = [f"fcs/{name}-cmd-norm" for name in ("aileron", "elevator", "rudder", "throttle")]
ENGINES = (("native, by single launches", NativeEngine), ("pybullet", BulletEngine), ("jsbsim", JsbsimEngine))


class Timed:
    """An engine, and what its steps have taken."""

    def __init__(self, engine: Engine) -> None:
        self._engine, self.boot = engine, engine.boot
        self.cpu_s = 0.0

    def step(self, commands: object, wind_ned: object) -> None:
        start = time.process_time()
        self._engine.step(commands, wind_ned)
        self.cpu_s += time.process_time() - start


def measure() -> list[Row]:
    rows = []
    for name, make in ENGINES:
        for vehicle, step_us in (("multirotor", flying_us), ("rover", driving_us)):
            if vehicle == "rover" and make is JsbsimEngine:  # which moves what flies
                continue
            took_us = min(step_us(make) for _ in range(ROUNDS))
            row_name = f"engine {name}: a millisecond of one {vehicle}"
            rows.append(Row(row_name, took_us, "us", "lower", TARGET_US, COMMAND))
            if make is BulletEngine:
                rows.append(beside_bare(row_name, took_us, "PyBullet", bare_bullet_us))
    row_name = "engine jsbsim: a millisecond of its Cessna"
    took_us = min(flying_us(partial(JsbsimPlaneEngine, aircraft="c172p"), "c172") for _ in range(ROUNDS))
    rows.append(Row(row_name, took_us, "us", "lower", TARGET_US, COMMAND))
    rows.append(beside_bare(row_name, took_us, "JSBSim", bare_jsbsim_us))
    return rows


def beside_bare(name: str, took_us: float, library: str, bare_us: Callable[[], float]) -> Row:
    """The same as a multiple of what the library takes by itself."""
    ratio = took_us / min(bare_us() for _ in range(ROUNDS))
    return Row(f"{name}, over {library} by itself", ratio, "x", "lower", None, COMMAND)


def bare_bullet_us() -> float:
    """CPU time of a step of one box [µs]: a force, a torque, the step, pose and velocity."""
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(TICK_S / SUBSTEPS, physicsClientId=client)
    pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.2, 0.2, 0.1], physicsClientId=client)
    body = pybullet.createMultiBody(2.0, shape, basePosition=[0.0, 0.0, HIGH_M], physicsClientId=client)
    frame = pybullet.LINK_FRAME
    start = time.process_time()
    for _ in range(BARE_STEPS):
        pybullet.applyExternalForce(body, -1, [0.0, 0.0, 10.0], [0.0, 0.0, 0.0], frame, physicsClientId=client)
        pybullet.applyExternalTorque(body, -1, [0.0, 0.0, 0.0], frame, physicsClientId=client)
        pybullet.stepSimulation(physicsClientId=client)
        pos, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
        pybullet.getBaseVelocity(body, physicsClientId=client)
    took_s = time.process_time() - start
    pybullet.disconnect(client)
    require(pos[2] < HIGH_M, "the box did not fall")
    return took_s / BARE_STEPS * 1e6


def bare_jsbsim_us() -> float:
    """CPU time of a step of its Cessna [µs]: four controls, the step, twelve properties of its motion."""
    sim = jsbsim.FGFDMExec(None)
    sim.load_model("c172p")
    sim.set_dt(TICK_S / SUBSTEPS)
    sim["ic/h-sl-ft"], sim["ic/vc-kts"] = 3000.0, 90.0
    sim.run_ic()
    start = time.process_time()
    for _ in range(BARE_STEPS):
        for name in CESSNA_CONTROLS:
            sim[name] = 0.0
        sim.run()
        _ = [sim[name] for name in MOTION]
    took_s = time.process_time() - start
    require(sim["velocities/vc-kts"] < 90.0, "it did not slow down")
    return took_s / BARE_STEPS * 1e6


def flying_us(make: Callable[[Rig], Engine], airframe: str = "x500") -> float:
    """CPU time of a step [µs], of a vehicle that flies high over trees."""
    rig, timed = timed_rig(make, airframe)
    rig.arrays.body.numpy()["pos_ned"][0] = (0.0, 0.0, -HIGH_M)
    took_us = step_us(rig, timed)
    height_m = -float(rig.truth_row()["pos_ned"][2])
    require(bool(np.isfinite(height_m)) and height_m < HIGH_M, "it did not fall")
    return took_us


def driving_us(make: Callable[[Rig], Engine]) -> float:
    """CPU time of a step [µs], of a rover that rolls on the ground."""
    rig, timed = timed_rig(make, "rover")
    rig.advance(100)
    rig.arrays.body.numpy()["vel_ned"][0] = (4.0, 0.0, 0.0)
    took_us = step_us(rig, timed)
    require(float(rig.truth_row()["pos_ned"][0]) > 1.0, "it did not roll")
    return took_us


def timed_rig(make: Callable[[Rig], Engine], airframe: str) -> tuple[SteppedRig, Timed]:
    """A vehicle at home, and its engine."""
    made: list[Timed] = []

    def timed(rig: Rig) -> Timed:
        made.append(Timed(make(rig)))
        return made[0]

    vehicle, body = class_of(load_airframe(airframe))
    rig = SteppedRig(
        load_airframe(airframe),
        build_world(),
        sensor_model(home=DEFAULT_HOME),
        wind_model(5.0),
        home=DEFAULT_HOME,
        engine=timed,
        body=body,
        law=vehicle.law,
    )
    return rig, made[0]


def step_us(rig: SteppedRig, timed: Timed) -> float:
    """CPU time of a step [µs] from now on."""
    rig.advance(10)
    timed.cpu_s = 0.0
    rig.advance(TICKS)
    return timed.cpu_s / (TICKS * SUBSTEPS) * 1e6
