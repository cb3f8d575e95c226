"""Drive: a rover reaches a pose on a course through hills, or parks in a free spot of a car park.

In: an action, 10 Hz: a speed along the nose and a yaw rate for the flight controller. Out: what the vehicle knows of
itself, where the goal is by its estimate, and what its scanner tells of what stands round it. The simulator and the
flight controller are those of every rover. Its receiver has corrections (RTK): no other could park.
"""

from typing import Any, ClassVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.geodesy import DEFAULT_HOME
from common.range_sectors import GROUND_RING
from policies.tasks.drive.drive_kernels import MEASURES, DriveRules, DriveState, act, judge, place, prepare
from policies.tasks.drive.drive_params import PARAMS, PRESETS, DriveParams
from policies.tasks.drive.drive_top_view import draw
from policies.tasks.drive.observe import ACTIONS, FRAME, LAYOUT_VERSION, SECTORS, STACK
from policies.tasks.drive.settings import DriveSettings
from policies.tasks.flight.flight_params import FLIGHT_PARAMS, FlightParams
from policies.tasks.flight.moved_ranges import sectors_struct
from policies.tasks.flight.reported import KEPT_SCANS
from policies.tasks.flight.standing_bank import standing_bank
from policies.tasks.flight.task import DECISION_TICKS, FlightTask
from policies.tasks.layout import Layout
from policies.tasks.task_params import typed_rows
from sim.rtk import corrected
from sim.sensors.sensors import sensor_model
from sim.world.driving_worlds import CAR_PARK, COURSE

AIRFRAME = "rover"  # the car: a skid-steer rover could turn in its place, and need not learn this
WORLDS = {"reach": COURSE, "park": CAR_PARK}


class Drive(FlightTask):
    """The task."""

    params: ClassVar = PARAMS
    settings_class: ClassVar = DriveSettings

    def __init__(self, settings: DriveSettings, env_count: int, device: str = "cpu") -> None:
        world = WORLDS[settings.preset]
        super().__init__(
            Layout("Drive", LAYOUT_VERSION, FRAME, continuous=ACTIONS, stack=settings.stack or STACK),
            env_count,
            world,
            trees_per_ha_max=world.trees_per_ha,
            has_estimator=settings.has_estimator,
            number_defaults=PRESETS[settings.preset],
            device=device,
            airframes=(AIRFRAME,),
            sensors=rtk_sensors,
            split=settings.split,
            bank=standing_bank(AIRFRAME, rtk_sensors, settings.has_estimator, device, settings.split),
        )
        self.settings = settings
        self.driving = self._state()
        self.measures = self.driving.measures
        rules = DriveRules()
        rules.has_estimator = int(settings.has_estimator)
        rules.spot_count = world.spot_count
        rules.decision_s = self.decision_s
        rules.sectors = sectors_struct(GROUND_RING)
        buffers, rig, state = self.buffers, self.rig.arrays, self.driving
        start = self.start()
        self._act = self.record(act, buffers, rig)
        self._judge = self.record(judge, buffers, rules, rig, state, start)
        self._prepare = self.record(prepare, buffers, state, start)
        self._place = self.record(place, buffers, rules, rig, state, start)

    def _launch_step(self) -> None:
        """What `step` does of the task's own."""
        self._act.launch()
        self.rig.advance(DECISION_TICKS)
        self._judge.launch()
        self._begin_rows()

    def _begin_rows(self) -> None:
        """Starts the episodes of the rows that are starting."""
        self._prepare.launch()
        self.take_off()
        self._place.launch()

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Rover, goal, and what stands and moves, from above."""
        truth = self.rig.truth_row(i_env)
        x, y, z, w = (float(value) for value in truth["q_ned_from_frd"])
        yaw = float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
        pose = np.array([truth["pos_ned"][0], truth["pos_ned"][1], yaw], dtype=np.float64)
        goal = self.driving.goals.numpy()[i_env].astype(np.float64)
        away_m, speed = np.linalg.norm(goal[:2] - pose[:2]), np.linalg.norm(truth["vel_ned"])
        time_s = float(self.buffers.steps.numpy()[i_env]) * self.decision_s
        words = f"{time_s:4.1f} s  {away_m:4.1f} m  {speed:3.1f} m/s"
        tick = int(self.rig.arrays.tick.numpy()[i_env])
        ranges_m = self.driving.ranges_m.numpy()[i_env]
        return draw(self.worlds.map(i_env), tick, pose, goal, ranges_m, words, height_px)

    def _state(self) -> Any:
        n = self.env_count
        state = DriveState()
        state.flight = typed_rows(self.buffers.params, FlightParams)
        state.params = typed_rows(self.buffers.params, DriveParams, first=len(FLIGHT_PARAMS))
        state.actions = self._zeros("last_actions", n, wp.vec2)
        state.goals = self._zeros("goals", n, wp.vec3)
        state.outs = self._zeros("outs", n, float)
        state.left_m = self._zeros("left_m", n, float)
        state.start_left_m = self._zeros("start_left_m", n, float)
        state.attitude_errors = self._zeros("attitude_errors", n, wp.quat)
        state.ranges_m = self._zeros("ranges_m", (n, SECTORS), float)
        state.scans_m = self._zeros("scans_m", (n, KEPT_SCANS, SECTORS), float)
        state.scan_poses = self._zeros("scan_poses", (n, KEPT_SCANS), wp.vec3)
        state.measures = self._zeros("measures", (n, len(MEASURES)), float)
        return state


def rtk_sensors(noise_scale: float) -> Any:
    """The sensors of a rover whose receiver is told corrections."""
    model = sensor_model(noise_scale, DEFAULT_HOME)
    gnss = corrected(model.gnss)
    model.gnss = gnss
    return model
