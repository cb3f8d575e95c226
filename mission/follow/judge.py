"""A flight that followed somebody, judged: its recording as a track of the scorecard.

In: a recording, and how long the flight was to follow. Out: a `Track` of the time from Offboard on, ten samples a
second, the simulator's truth. Whether the owner is in view is asked of the onboard camera's pictures, taken again.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.vehicle import Mode
from common.airframe import load_airframe
from common.kernels import FRAME_US
from mission.angles import yaw_rad
from mission.follow.owner import SPEEDS_M_S
from mission.view.moment import distances_m
from mission.view.pictures import onboard_eye
from mission.view.recording import Recording
from policies.tasks.follow_me.track import Track
from sim.sensors.ray import PERSON
from sim.world.world import WorldMap

TOUCH_M = 0.05  # guess: so near counts as touching, since it may have been nearer between two samples
STRIDE = 100_000 // FRAME_US  # recorded moments per sample


def track_of(recording: Recording, world: WorldMap, planned_s: float) -> Track | None:
    """The time from the first moment in Offboard on; None if it never came to that.

    It ends when the vehicle leaves Offboard: what is missing of the planned time was not followed.

    Args:
        recording: of a flight with an owner.
        world: that it flew in.
        planned_s: how long it was to follow.
    """
    rows = followed_rows(recording, planned_s)
    owner = recording.config.owner
    if len(rows) == 0 or owner is None:
        return None
    towards = rows["owner"]["pos_ned"] - rows["pos_ned"]
    bearing = np.arctan2(towards[:, 1], towards[:, 0]) - yaw_rad(rows["q_ned_from_frd"].astype(float))
    hull_m = load_airframe(recording.config.airframe).contact.hull_radius_m
    touches = world.obstacle_distance(rows["pos_ned"]) < hull_m + TOUCH_M
    return Track(
        time_s=rows["time_s"] - rows["time_s"][0],
        distance_m=distances_m(rows).astype(np.float64),
        bearing_rad=(bearing + np.pi) % (2.0 * np.pi) - np.pi,
        is_in_view=in_view(rows, world),
        is_collided=touches | rows["is_on_ground"],
        planned_s=planned_s,
        trees_per_ha=recording.config.world.trees_per_ha,
        owner_speed_max=SPEEDS_M_S[owner.pace],
    )


def followed_rows(recording: Recording, planned_s: float) -> NDArray[Any]:
    """Samples of the time in which it followed, or was to."""
    is_offboard = recording.rows["mode"] == Mode.OFFBOARD
    if not is_offboard.any():
        return recording.rows[:0]
    first = int(np.argmax(is_offboard))
    left = ~is_offboard[first:]
    count = int(np.argmax(left)) if left.any() else len(left)
    rows: NDArray[Any] = recording.rows[first : first + count : STRIDE]
    return rows[: int(np.searchsorted(rows["time_s"], rows["time_s"][0] + planned_s))]


def in_view(rows: NDArray[Any], world: WorldMap) -> NDArray[np.bool_]:
    """Whether some of the owner is in the onboard picture of each moment."""
    eye = onboard_eye(world)
    kind = eye.camera.kind.numpy()
    seen = np.zeros(len(rows), bool)
    for i, row in enumerate(rows):
        eye.look_from(row)
        seen[i] = bool((kind == PERSON).any())
    return seen
