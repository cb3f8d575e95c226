"""What does an engine take for a millisecond of one vehicle in the air, its own part of the loop alone?"""

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
        took_us = min(step_us(make) for _ in range(ROUNDS))
        rows.append(Row(f"engine {name}: a millisecond of one multirotor", took_us, "us", "lower", TARGET_US, COMMAND))
    took_us = min(step_us(partial(JsbsimPlaneEngine, aircraft="c172p"), "c172") for _ in range(ROUNDS))
    rows.append(Row("engine jsbsim: a millisecond of its Cessna", took_us, "us", "lower", TARGET_US, COMMAND))
    return rows


def step_us(make: Callable[[Rig], Engine], airframe: str = "x500") -> float:
    """CPU time of a step [µs], of a vehicle that flies high over trees."""
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
    rig.arrays.body.numpy()["pos_ned"][0] = (0.0, 0.0, -HIGH_M)
    rig.advance(10)
    made[0].cpu_s = 0.0
    rig.advance(TICKS)
    height_m = -float(rig.truth_row()["pos_ned"][2])
    require(bool(np.isfinite(height_m)) and height_m < HIGH_M, "it did not fall")
    return made[0].cpu_s / (TICKS * SUBSTEPS) * 1e6
