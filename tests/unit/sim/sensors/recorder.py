"""Runs the sensors of motionless vehicles and keeps what the drivers deliver."""

from functools import cache
from typing import Any

import numpy as np
import warp as wp

from autopilot.ports import Samples
from common.kernels import TICK_US
from sim.faults import set_fault
from sim.sensors.sensors import Faults, SensorModel, SensorState, sense, sensor_model
from sim.truth import Truth
from sim.world.world import World, WorldConfig, build_world

wp.set_module_options({"enable_backward": False})

REST_ACCEL_FRD = (0.0, 0.0, -9.80665)


@wp.kernel
def _record(
    models: wp.array(dtype=SensorModel),
    states: wp.array(dtype=SensorState),
    faults: wp.array(dtype=Faults),
    bodies: wp.array(dtype=Truth),
    world: World,
    seed: int,
    first_tick: wp.int64,
    stride: int,
    out: wp.array2d(dtype=Samples),
):
    i = wp.tid()
    state = states[i]
    tick = wp.int64(first_tick)
    for k in range(out.shape[1]):
        for _ in range(stride):
            state = sense(models[i], state, faults[i], bodies[i], world, seed, i, tick)
            tick += wp.int64(1)
        out[i, k] = state.samples
    states[i] = state


@cache
def plain_world() -> Any:
    return build_world(WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0)).kernel


class Recorder:
    """Motionless vehicles, level at 10 m, whose `bodies`, `models` and `faults` rows a test may write between runs."""

    def __init__(self, vehicle_count: int = 1, noise_scale: float = 1.0, seed: int = 1, model: Any = None) -> None:
        self.seed = seed
        self.tick = 0
        model = model or sensor_model(noise_scale)
        body = Truth()
        body.pos_ned = wp.vec3(1.0, 2.0, -10.0)
        body.vel_ned = wp.vec3(0.5, -0.25, 0.125)
        body.q_ned_from_frd = wp.quat_identity()
        body.accel_frd = wp.vec3(*REST_ACCEL_FRD)
        body.battery_voltage_v = 15.0
        body.battery_current_a = 12.0
        self._models = wp.array([model] * vehicle_count, dtype=SensorModel, device="cpu")
        self._states = wp.zeros(vehicle_count, dtype=SensorState, device="cpu")
        self._faults = wp.zeros(vehicle_count, dtype=Faults, device="cpu")
        self._bodies = wp.array([body] * vehicle_count, dtype=Truth, device="cpu")
        self.models = self._models.numpy()
        self.states = self._states.numpy()
        self.faults = self._faults.numpy()
        self.bodies = self._bodies.numpy()

    def run(self, count: int, stride: int = 1) -> np.ndarray:
        """Samples after every `stride` ticks, `count` times, shape (vehicles, count)."""
        out = wp.zeros((len(self.states), count), dtype=Samples, device="cpu")
        wp.launch(
            _record,
            dim=len(self.states),
            inputs=[
                self._models, self._states, self._faults, self._bodies,
                plain_world(), self.seed, self.tick, stride, out,
            ],
            device="cpu",
        )  # fmt: skip
        self.tick += count * stride
        return out.numpy()

    def fault(self, sensor: str, mode: str, magnitude: float = 0.0) -> None:
        """Sets a fault of every vehicle."""
        for row in self.faults:
            set_fault(row, sensor, mode, magnitude)

    @property
    def time_us(self) -> int:
        """The end of the last tick."""
        return self.tick * TICK_US


def arrivals(samples: np.ndarray) -> np.ndarray:
    """Indices at which a sample of one vehicle is new, shape (n,); `samples` are one sensor's, one per tick."""
    return np.flatnonzero(np.diff(samples["time_us"], prepend=0))
