"""A task that is flown or driven: vehicles of a rig with their flight controllers.

An episode starts from a hover of the bank, or standing; everything happens on the device.
"""

import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from policies.tasks.flight.episode_start import Start
from policies.tasks.flight.flown_vehicle import NOISE_LEVELS_PER_UNIT, Makes
from policies.tasks.flight.hover_bank import AIRFRAME, LOW_M, Parameters, build_rig, hover_bank
from policies.tasks.layout import Layout
from policies.tasks.task import SPLITS, Split, Task
from policies.tasks.task_params import Sampler
from sim.restore import RowRestore
from sim.rig import Rig
from sim.sensors.sensors import SensorModel, sensor_model
from sim.world.batch import WorldBatch
from sim.world.world import WorldMap

_NOISE_MAX = 2


class RigTask(Task):
    """Vehicles in the air or on wheels; a subclass adds what they are for."""

    def __init__(
        self,
        layout: Layout,
        env_count: int,
        world: WorldMap | WorldBatch,
        *,
        has_estimator: bool,
        number_defaults: Mapping[str, float | Sampler],
        device: str,
        hover_heights_m: tuple[float, float] = LOW_M,
        split: Split = "train",
        airframes: tuple[str, ...] = (AIRFRAME,),
        sensors: Callable[[float], SensorModel] = sensor_model,
        bank: Rig | None = None,
        parameters: Parameters = (),
    ) -> None:
        super().__init__(layout, env_count, number_defaults=number_defaults, device=device)
        self.rig: Rig = build_rig(
            world,
            env_count,
            has_estimator=has_estimator,
            threads=worker_count(device),
            device=device,
            airframe_name=airframes[0],
            sensors=sensors,
            parameters=parameters,
        )
        self.noise_seeds = self._zeros("noise_seeds", env_count, int)
        self.hovers = self._zeros("hovers", env_count, int)  # of the bank, that the episode started from
        self.is_starting = self._zeros("is_starting", env_count, wp.bool)
        self._split = split
        bank = bank or hover_bank(has_estimator, device, hover_heights_m, split, airframes, parameters)
        self._bank_count = bank.vehicle_count
        self._restore = RowRestore(self.rig, bank, self.hovers, self.is_starting, self.noise_seeds)
        levels = [sensors(k / NOISE_LEVELS_PER_UNIT) for k in range(_NOISE_MAX * NOISE_LEVELS_PER_UNIT + 1)]
        self.makes: Any = Makes()
        self.makes.sensors = wp.array(levels, dtype=SensorModel, device=device)

    def start(self) -> Any:
        """What episodes start with, for kernels: a `Start`."""
        start = Start()
        start.is_starting = self.is_starting
        start.noise_seeds = self.noise_seeds
        start.hovers = self.hovers
        start.hover_count = self._bank_count
        start.split = SPLITS.index(self._split)
        start.makes = self.makes
        return start

    def record(self, kernel: Any, *inputs: Any) -> Any:
        """A launch of one thread per environment, recorded."""
        return wp.launch(kernel, self.env_count, list(inputs), device=self.device, record_cmd=True)

    def _launch_begin(self, is_chosen: NDArray[np.bool_]) -> None:
        """What `begin` does of the task's own."""
        self.is_starting.assign(is_chosen)
        self._begin_rows()

    def step_others(self, is_held: NDArray[np.bool_]) -> None:
        """As every task's, but the held rows begin another episode: a rig steps its vehicles together."""
        self.step()
        self.begin(is_held)

    def _begin_rows(self) -> None:
        """Starts the episodes of the rows that are starting."""
        raise NotImplementedError

    def take_off(self) -> None:
        """Puts the vehicles of the rows that start into their hovers."""
        self._restore.launch()

    def state(self) -> dict[str, NDArray[Any]]:
        """As every task's, and the rig."""
        return super().state() | {f"rig{k}": rows for k, rows in enumerate(self.rig.snapshot())}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores what `state` returned."""
        super().load_state(state)
        self.rig.restore([state[f"rig{k}"] for k in range(sum(name.startswith("rig") for name in state))])


def worker_count(device: str) -> int:
    """One thread per core that this process may use, of a GPU one; results do not depend on it."""
    return len(os.sched_getaffinity(0)) if device == "cpu" else 1
