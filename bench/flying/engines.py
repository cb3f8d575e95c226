"""What does an engine take for a millisecond of a multirotor in the air or a rover, its own part of the loop alone?"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from bench.row import Row, require
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import SUBSTEPS
from sim.bodies.vehicles import class_of
from sim.engines.bullet import BulletEngine
from sim.engines.engine import Engine
from sim.engines.jsbsim_engine import JsbsimEngine
from sim.engines.jsbsim_plane_engine import JsbsimPlaneEngine
from sim.engines.native import NativeEngine
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import build_world

COMMAND = "python -m bench engines"
TICKS, ROUNDS = 700, 5  # it falls 35 m
HIGH_M = 60.0
TARGET_US = 25.0
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
    took_us = min(flying_us(partial(JsbsimPlaneEngine, aircraft="c172p"), "c172") for _ in range(ROUNDS))
    rows.append(Row("engine jsbsim: a millisecond of its Cessna", took_us, "us", "lower", TARGET_US, COMMAND))
    return rows


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
