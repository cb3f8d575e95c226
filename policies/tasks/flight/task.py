"""A task that is flown: vehicles of a rig with their flight controllers, each in a world of its own.

One decision is: actions to setpoints, `DECISION_TICKS` of the rig, then what the task's subclass makes of where they
are. An episode starts in a world grown afresh, from a hover of the bank. Everything happens on the device.
"""

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.geodesy import DEFAULT_HOME
from common.kernels import TICK_S
from policies.tasks.flight.episode_start import Start
from policies.tasks.flight.flown_vehicle import NOISE_LEVELS_PER_UNIT, Makes
from policies.tasks.flight.hover_bank import HOVER_COUNT, LOW_M, build_rig, hover_bank
from policies.tasks.layout import Layout
from policies.tasks.task import Task
from policies.tasks.task_params import Sampler
from sim.restore import RowRestore
from sim.rig import Rig
from sim.sensors.sensors import SensorModel, sensor_model
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig

DECISION_TICKS = 25  # 0.1 s
_NOISE_MAX = 2


class FlightTask(Task):
    """Vehicles in worlds; a subclass adds what they are for."""

    decision_s = DECISION_TICKS * TICK_S

    def __init__(
        self,
        layout: Layout,
        env_count: int,
        world: WorldConfig,
        *,
        trees_per_ha_max: float,
        has_estimator: bool,
        number_defaults: Mapping[str, float | Sampler],
        device: str,
        hover_heights_m: tuple[float, float] = LOW_M,
    ) -> None:
        super().__init__(layout, env_count, number_defaults=number_defaults, device=device)
        self.worlds = WorldBatch(world, env_count, device, trees_per_ha_max=trees_per_ha_max)
        self.rig: Rig = build_rig(
            self.worlds, env_count, has_estimator=has_estimator, threads=worker_count(device), device=device
        )
        self.world_seeds = self._zeros("world_seeds", env_count, int)
        self.noise_seeds = self._zeros("noise_seeds", env_count, int)
        self.hovers = self._zeros("hovers", env_count, int)  # of the bank, that the episode started from
        self.is_starting = self._zeros("is_starting", env_count, wp.bool)
        self.is_growing = self._zeros("is_growing", env_count, wp.bool)
        bank = hover_bank(has_estimator, device, hover_heights_m)
        self._restore = RowRestore(self.rig, bank, self.hovers, self.is_starting, self.noise_seeds)
        self.makes = _makes(self.rig)

    def begin(self, is_chosen: NDArray[np.bool_]) -> None:
        """Starts an episode in the chosen rows, shape (envs,); the others are not touched."""
        self.is_starting.assign(is_chosen)
        self._begin_rows()

    def _begin_rows(self) -> None:
        """Starts the episodes of the rows that are starting."""
        raise NotImplementedError

    def start(self, *, is_test: bool) -> Any:
        """What episodes start with, for kernels: a `Start`."""
        start = Start()
        start.is_starting = self.is_starting
        start.is_growing = self.is_growing
        start.world_seeds = self.world_seeds
        start.noise_seeds = self.noise_seeds
        start.hovers = self.hovers
        start.hover_count = HOVER_COUNT
        start.is_test = int(is_test)
        start.world_params = self.worlds.params
        start.makes = self.makes
        return start

    def record(self, kernel: Any, *inputs: Any) -> Any:
        """A launch of one thread per environment, recorded."""
        return wp.launch(kernel, self.env_count, list(inputs), device=self.device, record_cmd=True)

    def take_off(self) -> None:
        """Grows the worlds that are to grow, and puts the vehicles of the rows that start into their hovers there."""
        self.worlds.grow(self.is_growing, self.world_seeds)
        self._restore.launch()

    def state(self) -> dict[str, NDArray[Any]]:
        """As every task's, and the rig; the worlds are grown again from their seeds and numbers."""
        state = super().state()
        state |= {f"rig{k}": rows for k, rows in enumerate(self.rig.snapshot())}
        return state | {"world_numbers": self.worlds.params.numpy().copy()}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores what `state` returned."""
        super().load_state(state)
        snapshot = [state[f"rig{k}"] for k in range(sum(name.startswith("rig") for name in state))]
        self.rig.restore(snapshot)
        self.worlds.params.assign(state["world_numbers"])
        everyone = wp.full(self.env_count, value=True, dtype=wp.bool, device=self.device)
        self.worlds.grow(everyone, self.world_seeds)


def worker_count(device: str) -> int:
    """One thread per core that this process may use, of a GPU one; results do not depend on it."""
    return len(os.sched_getaffinity(0)) if device == "cpu" else 1


def _makes(rig: Rig) -> Makes:
    makes = Makes()
    makes.body = wp.clone(rig.models[:1])
    levels = [
        sensor_model(k / NOISE_LEVELS_PER_UNIT, DEFAULT_HOME) for k in range(_NOISE_MAX * NOISE_LEVELS_PER_UNIT + 1)
    ]
    makes.sensors = wp.array(levels, dtype=SensorModel, device=rig.device)
    return makes
