"""A task that is flown or driven in worlds of its own: each vehicle in one that is grown afresh at an episode's start.

One decision is: actions to setpoints, `DECISION_TICKS` of the rig, then what the task's subclass makes of where they
are. Everything happens on the device.
"""

from collections.abc import Mapping
from typing import Any

import warp as wp
from numpy.typing import NDArray

from common.kernels import TICK_S
from common.records import assign_rows
from policies.tasks.flight.rig_task import RigTask
from policies.tasks.layout import Layout
from policies.tasks.task_params import Sampler
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig

DECISION_TICKS = 25  # 0.1 s


class FlightTask(RigTask):
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
        **vehicle: Any,
    ) -> None:
        self.worlds = WorldBatch(world, env_count, device, trees_per_ha_max=trees_per_ha_max)
        super().__init__(
            layout,
            env_count,
            self.worlds,
            has_estimator=has_estimator,
            number_defaults=number_defaults,
            device=device,
            **vehicle,
        )
        self.world_seeds = self._zeros("world_seeds", env_count, int)
        self.is_growing = self._zeros("is_growing", env_count, wp.bool)

    def start(self) -> Any:
        """As of every flown task, with the worlds that are to grow."""
        start = super().start()
        start.is_growing = self.is_growing
        start.world_seeds = self.world_seeds
        start.world_params = self.worlds.params
        return start

    def take_off(self) -> None:
        """Grows the worlds that are to grow, and puts the vehicles of the rows that start into their hovers there."""
        self.worlds.grow(self.is_growing, self.world_seeds)
        super().take_off()

    def state(self) -> dict[str, NDArray[Any]]:
        """As every task's, and the rig; the worlds are grown again from their seeds and numbers."""
        return super().state() | {"world_numbers": self.worlds.params.numpy().copy()}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores what `state` returned."""
        super().load_state(state)
        assign_rows(self.worlds.params, state["world_numbers"])
        everyone = wp.full(self.env_count, value=True, dtype=wp.bool, device=self.device)
        self.worlds.grow(everyone, self.world_seeds)
