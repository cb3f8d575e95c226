"""Rovers driven by their control law alone: the body of the simulator, a plain, and a setpoint per vehicle.

Each row is a test drive of its own, so that one compilation and one launch serve many.
"""

from dataclasses import dataclass
from math import nan, radians, tan

import numpy as np

from autopilot.navigator.setpoint import SetpointPort
from autopilot.vehicles.rover.defaults import rover_defaults
from autopilot.vehicles.rover.law import ROVER_LAW
from autopilot.vehicles.rover.params import ROVER_PARAMETERS
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import FRAME_TICKS
from common.params import ParameterTable
from sim.bodies.rover import ROVER_BODY
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.terrain import TerrainMap
from sim.world.world import WorldConfig, WorldMap, build_world

FRAME_S = 0.02
SIZE_M = 800.0
ALIGN_FRAMES = 500  # 10 s: until the estimator has used GNSS


def sloped_world(slope_deg: float) -> WorldMap:
    """A plain that rises to the north."""
    world = build_world(WorldConfig(size_m=SIZE_M, hill_height_m=0.0, trees_per_ha=0.0))
    if slope_deg == 0.0:
        return world
    rows = world.heights.shape[0]
    north = np.linspace(-0.5 * SIZE_M, 0.5 * SIZE_M, rows)
    heights = np.repeat((north * tan(radians(slope_deg)))[:, None], rows, axis=1).astype(np.float32)
    terrain = TerrainMap(heights, SIZE_M)
    world.kernel.terrain = terrain.kernel("cpu")
    return WorldMap(world.config, terrain, world.forest, world.walls, world.kernel)


@dataclass
class Track:
    """What was true of each rover, and what its law asked for, per frame and vehicle."""

    time_s: np.ndarray  # (frames,)
    pos: np.ndarray  # (frames, vehicles, 3)
    speed: np.ndarray  # along the nose
    yaw: np.ndarray
    yaw_rate: np.ndarray
    command: np.ndarray  # (frames, vehicles, 3)
    speed_sp: np.ndarray


def yaw_of(q: np.ndarray) -> np.ndarray:
    x, y, z, w = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


class RoverRig:
    """Rovers of one airframe, one setpoint each."""

    def __init__(self, count, airframe="rover", *, slope_deg=0.0, has_estimator=False, noise=1.0, seed=0, **params):
        self.airframe = load_airframe(airframe)
        self.rig = Rig(
            self.airframe,
            sloped_world(slope_deg),
            sensor_model(noise),
            wind_model(0.0),
            home=DEFAULT_HOME,
            vehicle_count=count,
            seed=seed,
            has_estimator=has_estimator,
            body=ROVER_BODY,
            law=ROVER_LAW,
        )
        self.count = count
        table = ParameterTable(ROVER_PARAMETERS)
        for name, value in {**rover_defaults(self.airframe), **params}.items():
            if name in table:
                table.set(name, value)
        self.table = table
        rows = self.rig.rows["autopilot.control_params"]
        for name, value in table.fields(ROVER_PARAMETERS).items():
            rows[name] = value
        setpoints = self.rig.rows["autopilot.setpoint"]
        self.ports = [SetpointPort(setpoints[i : i + 1]) for i in range(count)]
        self.frames = 0
        self._kept = []
        if has_estimator:
            self.run(ALIGN_FRAMES)
        for port in self.ports:
            port.set_flags(is_armed=True, is_landed=False)

    @property
    def truth(self):
        return self.rig.rows["truth"]

    def place(self, i, *, pos=None, yaw=None):
        """Puts a rover somewhere, as it stands."""
        body = self.rig.rows["body"]
        if pos is not None:
            body["pos_ned"][i][:2] = pos
        if yaw is not None:
            body["q_ned_from_frd"][i] = (0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw))

    def run(self, frames, each=None):
        """Drives for some frames; `each(rig, frame)` may change setpoints before each."""
        for frame in range(frames):
            if each is not None:
                each(self, frame)
            for port in self.ports:
                port.write()
            self.rig.advance(FRAME_TICKS)
            self.frames += 1
            truth, control = self.truth, self.rig.rows["autopilot.control"]
            yaw = yaw_of(truth["q_ned_from_frd"])
            q, vel = truth["q_ned_from_frd"], truth["vel_ned"]
            nose = np.stack(
                [
                    1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2),
                    2.0 * (q[:, 0] * q[:, 1] + q[:, 2] * q[:, 3]),
                    2.0 * (q[:, 0] * q[:, 2] - q[:, 1] * q[:, 3]),
                ],
                axis=1,
            )
            actuators = control["actuators"]
            self._kept.append(
                (
                    truth["pos_ned"].copy(),
                    np.sum(nose * vel, axis=1),
                    yaw,
                    truth["omega_frd"][:, 2].copy(),
                    actuators["command"][:, :3].copy(),
                    control["speed"]["speed_sp"].copy(),
                )
            )

    def track(self):
        """All since the last call."""
        columns = [np.array(column) for column in zip(*self._kept, strict=True)]
        self._kept = []
        return Track(np.arange(1, len(columns[0]) + 1) * FRAME_S, *columns)


def to(port, north, east, *, start=(nan, nan), **speeds):
    """Asks for a place."""
    port.fly_to((north, east, nan), nan, path_start_ned=(*start, nan), **speeds)
