"""A ring of range finders that looks round the vehicle, level, 72 rays: what an OBSTACLE_DISTANCE comes from.

It hangs in gimbals: its rays stay level when the vehicle leans. Measured on request, not by the tick, so that a
vehicle without one pays nothing. Its error is white noise.
"""

from typing import Any

import numpy as np
import warp as wp

from sim.rig import Rig
from sim.world.world import World, WorldMap, ray_hit

wp.set_module_options({"enable_backward": False})

RAYS = 72
MIN_M, MAX_M = 0.3, 30.0  # Slamtec RPLIDAR S2 data sheet, dark surfaces
NOISE_STD_M = 0.03  # the same


@wp.kernel(enable_backward=False)
def ring_rays(world: World, pos_ned: wp.vec3, yaw: float, max_m: float, distance_m: wp.array(dtype=float)) -> None:
    i = wp.tid()
    bearing = yaw + float(i) * 2.0 * wp.pi / float(distance_m.shape[0])
    distance_m[i] = ray_hit(world, pos_ned, wp.vec3(wp.cos(bearing), wp.sin(bearing), 0.0), max_m)


class RingSensor:
    """The ring on one vehicle.

    Args:
        rig: where the vehicle is.
        world: what it sees.
        noise: scale of its error.
        seed: of its error.
        i_vehicle: the vehicle.
    """

    def __init__(self, rig: Rig, world: WorldMap, noise: float, seed: int, i_vehicle: int = 0) -> None:
        self._world = world.kernel
        self._truth: Any = rig.rows["truth"]
        self._tick: Any = rig.rows["tick"]
        self._i_vehicle = i_vehicle
        self._distance = wp.zeros(RAYS, dtype=float, device="cpu")
        self._noise_std_m = noise * NOISE_STD_M
        self._rng = np.random.default_rng([seed, 0x21D4])

    def measure(self, yaw_rad: float) -> list[float]:
        """Distances [m] clockwise from the nose, inf where nothing is within reach.

        Args:
            yaw_rad: heading of the ring.
        """
        pos = self._truth[self._i_vehicle]["pos_ned"]
        self._world.boxes.tick = int(self._tick[self._i_vehicle]) & 0x7FFFFFFF
        inputs = [self._world, wp.vec3(*(float(axis) for axis in pos)), yaw_rad, MAX_M]
        wp.launch(ring_rays, dim=RAYS, inputs=inputs, outputs=[self._distance], device="cpu")
        exact = self._distance.numpy()
        noisy = np.maximum(exact + self._rng.normal(0.0, self._noise_std_m, RAYS), MIN_M)
        return [float(distance) for distance in np.where(exact >= MAX_M, np.inf, noisy)]
