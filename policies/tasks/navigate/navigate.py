"""Navigate: a drone reaches a goal 60 to 85 m away through forest, below its crowns and at speed; a rover a nearer one.

In: an action, 10 Hz: velocity and yaw rate for the flight controller. Out: what the vehicle knows of itself, where the
goal is by its estimate, and what its rangefinder or its depth camera sees. The simulator and the flight controller are
those of every flight.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.kernels import TICK_S
from common.range_sectors import RANGES, SCANNER
from policies.tasks.flight.flight_params import FLIGHT_PARAMS, FlightParams
from policies.tasks.flight.moved_ranges import sectors_struct
from policies.tasks.flight.own_state import ACTIONS, Command
from policies.tasks.flight.reported import KEPT_SCANS
from policies.tasks.flight.standing_bank import standing_bank
from policies.tasks.flight.task import DECISION_TICKS, FlightTask
from policies.tasks.layout import ImageElement, Layout
from policies.tasks.navigate.depth_cameras import DepthEyes
from policies.tasks.navigate.navigate_kernels import (
    MEASURES,
    NavigateState,
    Rules,
    act,
    command,
    judge,
    place,
    prepare,
    show,
)
from policies.tasks.navigate.navigate_params import IMPROVED, PARAMS, ROVER, ROVER_PARAMS, NavigateParams
from policies.tasks.navigate.navigate_top_view import draw
from policies.tasks.navigate.observe import DEPTH_CHANNELS, LAYOUT_VERSION, RAY_STACK, frame_elements
from policies.tasks.navigate.scan import scan
from policies.tasks.navigate.settings import NavigateSettings
from policies.tasks.task_params import Sampler, TaskParam, typed_rows
from sim.sensors.sensors import sensor_model
from sim.world.forest_world import FOREST, TREES_PER_HA_MAX, WALLED_FOREST
from sim.world.world import WorldConfig

ROVER_AIRFRAME = "rover"


class Navigate(FlightTask):
    """The task. Layout version 2; in version 1 ranges were levelled by the truth."""

    params: ClassVar[tuple[TaskParam, ...]] = PARAMS
    settings_class: ClassVar = NavigateSettings
    name: ClassVar = "Navigate"
    world: ClassVar[WorldConfig] = FOREST
    number_defaults: ClassVar[Mapping[str, float | Sampler]] = IMPROVED

    def __init__(self, settings: NavigateSettings, env_count: int, device: str = "cpu") -> None:
        super().__init__(
            _layout(self.name, settings),
            env_count,
            self.world,
            trees_per_ha_max=TREES_PER_HA_MAX,
            has_estimator=settings.has_estimator,
            number_defaults=self.number_defaults,
            device=device,
            split=settings.split,
            **self._vehicle(settings, device),
        )
        self.settings = settings
        self._delay_ticks = round(settings.delay_ms / (1000.0 * TICK_S))
        self.navigation = self._state()
        self.measures = self.navigation.measures
        self._eyes: DepthEyes | None = None
        if self.layout.image is not None:
            self._eyes = DepthEyes(self.buffers, self.rig.arrays, self.navigation.params, self.worlds)
        self._record_all()

    def _vehicle(self, settings: NavigateSettings, device: str) -> dict[str, Any]:  # noqa: ARG002
        """What the rig is made from, where it is not the drone."""
        return {}

    def _launch_step(self) -> None:
        """What `step` does of the task's own."""
        self._act.launch()
        if self._delay_ticks > 0:
            self.rig.advance(self._delay_ticks)
        self._command.launch()
        self.rig.advance(DECISION_TICKS - self._delay_ticks)
        self._see(self.navigation.is_all, is_first=False)
        self._judge.launch()
        self.keep_last_images()
        self._begin_rows()

    def _begin_rows(self) -> None:
        """Starts the episodes of the rows that are starting."""
        self._prepare.launch()
        self.take_off()
        self._place.launch()
        if self._eyes is not None:
            self._eyes.refresh(self.is_growing)
        self._see(self.is_starting, is_first=True)
        self._show.launch()

    def _see(self, rows: Any, *, is_first: bool) -> None:
        """What the chosen rows see of the forest."""
        if self._eyes is not None:
            self._eyes.take(rows)
        else:
            self._scan.set_param_at_index(2, rows)
            self._scan.set_param_at_index(5, int(is_first))
            self._scan.launch()

    def load_state(self, state: Any) -> None:
        """Restores what `state` returned."""
        super().load_state(state)
        if self._eyes is not None:
            self._eyes.refresh()

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Drone, trees, goal and ranges from above."""
        truth = self.rig.truth_row(i_env)
        x, y, z, w = (float(value) for value in truth["q_ned_from_frd"])
        yaw = float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
        goal_ned = self.navigation.goals_ned.numpy()[i_env].astype(np.float64)
        pos_ned = truth["pos_ned"].astype(np.float64)
        away_m, speed = np.linalg.norm(goal_ned - pos_ned), np.linalg.norm(truth["vel_ned"])
        words = (
            f"{float(self.buffers.steps.numpy()[i_env]) * self.decision_s:4.1f} s  {away_m:4.1f} m  {speed:3.1f} m/s"
        )
        ranges_m = self.navigation.ranges_m.numpy()[i_env]
        return draw(self.worlds.map(i_env), pos_ned, yaw, goal_ned, ranges_m, words, height_px)

    def _state(self) -> Any:
        n = self.env_count
        state = NavigateState()
        state.flight = typed_rows(self.buffers.params, FlightParams)
        state.params = typed_rows(self.buffers.params, NavigateParams, first=len(FLIGHT_PARAMS))
        state.actions = self._zeros("last_actions", n, wp.vec4)
        state.goals_ned = self._zeros("goals_ned", n, wp.vec3)
        state.pos_ned = self._zeros("last_pos_ned", n, wp.vec3)
        state.path_m = self._zeros("path_m", n, float)
        state.start_distance_m = self._zeros("start_distance_m", n, float)
        state.attitude_errors = self._zeros("attitude_errors", n, wp.quat)
        state.ranges_m = self._zeros("ranges_m", (n, RANGES), float)
        state.scans_m = self._zeros("scans_m", (n, KEPT_SCANS, RANGES), float)
        state.scan_poses = self._zeros("scan_poses", (n, KEPT_SCANS), wp.vec3)
        state.measures = self._zeros("measures", (n, len(MEASURES)), float)
        state.is_all = wp.full(n, value=True, dtype=wp.bool, device=self.device)
        return state

    def _record_all(self) -> None:
        buffers, rig, state = self.buffers, self.rig.arrays, self.navigation
        rules = Rules()
        rules.has_rays = int(self.settings.observation == "rays")
        rules.has_estimator = int(self.settings.has_estimator)
        rules.decision_s = self.decision_s
        start = self.start()

        record = self.record
        commands = wp.zeros(self.env_count, dtype=Command, device=self.device)  # of the running decision
        self._act = record(act, buffers, rules, rig, state, commands)
        self._command = record(command, rig, commands)
        reported = (rules.has_estimator, state.attitude_errors)
        scans = (sectors_struct(SCANNER), state.scans_m, state.scan_poses, state.ranges_m)
        self._scan = record(scan, rig, state.params, state.is_all, *reported, 0, *scans)
        self._judge = record(judge, buffers, rules, rig, state, start)
        self._prepare = record(prepare, buffers, state, start)
        self._place = record(place, buffers, rig, state, start)
        self._show = record(show, buffers, rules, rig, state, start)


class NavigateRover(Navigate):
    """The same task, of a rover between trees and walls: with the velocity of an action it drives, forwards."""

    params: ClassVar = ROVER_PARAMS
    name: ClassVar = "NavigateRover"
    world: ClassVar = WALLED_FOREST
    number_defaults: ClassVar = ROVER

    def _vehicle(self, settings: NavigateSettings, device: str) -> dict[str, Any]:
        bank = standing_bank(ROVER_AIRFRAME, sensor_model, settings.has_estimator, device, settings.split)
        return {"airframes": (ROVER_AIRFRAME,), "bank": bank}


def _layout(name: str, settings: NavigateSettings) -> Layout:
    has_rays = settings.observation == "rays"
    size = settings.image_size
    return Layout(
        name,
        LAYOUT_VERSION,
        frame_elements(has_rays=has_rays),
        continuous=ACTIONS,
        stack=settings.stack or (RAY_STACK if has_rays else 1),
        image=None if has_rays else ImageElement(size, size, DEPTH_CHANNELS),
    )
