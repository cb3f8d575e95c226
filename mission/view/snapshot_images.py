"""Images of recorded moments: the fast camera, pointed from the host.

In: a place and an attitude, or a recorded moment. Out: colours and depth. The onboard camera's images of a recording
are what was seen then, without what a lens and a sensor add.
"""

from math import radians, tan
from typing import Any

import numpy as np
import warp as wp

from common.attitude import Quat, product, rotated
from policies.tasks.follow_me.observe import HFOV_DEG, IMAGE_SIZE, camera_mount
from sim.camera_rig import MOUNT_FRD
from sim.sensors.fast_camera.fast_camera import RANGE_M, QuickCamera
from sim.world.people import Person
from sim.world.world import WorldMap


class Eye:
    """One camera.

    Args:
        world: what it sees.
        width: of its images [pixels].
        height: of its images [pixels].
        hfov_deg: horizontal field of view.
        range_m: fog hides what is farther.
    """

    def __init__(self, world: WorldMap, width: int, height: int, hfov_deg: float, *, range_m: float = RANGE_M) -> None:
        self._world = world  # kernels see its arrays by their addresses: they must not go before the camera
        people = wp.zeros(1, dtype=Person)
        self.camera = QuickCamera(
            world, 1, width=width, height=height, hfov_deg=hfov_deg, people=people, range_m=range_m
        )
        self.focal = 0.5 * width / tan(0.5 * radians(hfov_deg))  # [pixels]
        self._lens: Any = self.camera.lenses.numpy()[0]
        self._person: Any = people.numpy()
        self.rgb: Any = self.camera.rgb.numpy()[0]  # live, as the next
        self.depth_m: Any = self.camera.depth_m.numpy()[0]

    def look(self, pos_ned: Any, q_ned_from_rdf: Quat, owner: np.void) -> None:
        """Takes the image from there; the owner may have a stature of 0, which is nobody."""
        self._lens["pos_ned"] = pos_ned
        self._lens["q_ned_from_rdf"] = q_ned_from_rdf
        self._person[0] = owner
        self.camera.render()

    def look_from(self, row: Any) -> tuple[Any, Quat]:
        """Takes the image that the onboard camera takes at a recorded moment; from where, and how it looks."""
        x, y, z, w = (float(value) for value in row["q_ned_from_frd"])
        q = (x, y, z, w)
        place, q_ned_from_rdf = row["pos_ned"] + np.array(rotated(q, MOUNT_FRD)), product(q, camera_mount())
        self.look(place, q_ned_from_rdf, row["owner"])
        return place, q_ned_from_rdf


def onboard_eye(world: WorldMap, size: int = IMAGE_SIZE) -> Eye:
    """The camera that the policy sees through, with as many pixels per side as asked for."""
    return Eye(world, size, size, HFOV_DEG)
