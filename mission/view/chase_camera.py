"""The camera that flies with the vehicle of a film: where it is, and where it looks.

In: a recording and its world. Out: a place and a target for each image. The whole flight is known, so the camera
moves by averages over the time before and after; it comes nearer where a tree would stand before it. It is behind and
above the vehicle, and beside it where somebody is followed: neither hides the other.
"""

from math import atan2, radians

import numpy as np
from numpy.typing import NDArray

from common.airframe import load_airframe
from common.attitude import Quat, product, quat_of
from common.kernels import FRAME_US
from mission.log.euler_angles import yaw_rad
from mission.view import shapes
from mission.view.replay_file import Recording
from sim.world.world import WorldMap

STRIDE = 2  # frames of the flight per image
IMAGE_S = STRIDE * FRAME_US * 1e-6
BEHIND_M, ABOVE_M = 3.6, 1.6  # of the vehicle
BEHIND_CAR_M, ABOVE_CAR_M = 2.2, 0.9
BESIDE_RAD = radians(40.0)  # round the vehicle, from behind it to the right, where somebody is followed
NEAREST_M = 1.2
ROOM_M = 0.4  # between the camera and a crown
LEAST_HEIGHT_M = 0.6
AHEAD_M = 1.5  # of the vehicle: what it looks at, or the middle between vehicle and owner if that is nearer
SMOOTH_S = 0.8  # standard deviation of the averages
_RDF_IN_FRD = (0.5, 0.5, 0.5, 0.5)  # a camera that looks ahead
Floats = NDArray[np.float64]


def camera_path(recording: Recording, world: WorldMap) -> tuple[Floats, Floats]:
    """Where the camera is and where it looks at each moment [m], both (moments, 3); a moment each IMAGE_S."""
    rows, sigma = recording.rows, SMOOTH_S / IMAGE_S
    drives = shapes.vehicle(load_airframe(recording.config.airframe)).drives
    behind_m, above_m = (BEHIND_CAR_M, ABOVE_CAR_M) if drives else (BEHIND_M, ABOVE_M)
    pos = rows["pos_ned"].astype(np.float64)
    has_owner = rows["owner"]["stature_m"] > 0.0
    towards = np.where(has_owner[:, None], rows["owner"]["pos_ned"] - rows["pos_ned"], 0.0)[:, :2].astype(np.float64)
    away_m = np.linalg.norm(towards, axis=1, keepdims=True)
    yaw = yaw_rad(rows["q_ned_from_frd"].astype(np.float64))
    heading = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    ahead = averaged(np.where(away_m > 0.3, towards / np.maximum(away_m, 0.3), heading), sigma)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-6)
    middle = averaged(pos, sigma)
    beside_rad = averaged(np.where(has_owner, BESIDE_RAD, 0.0)[:, None], sigma)
    right = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    level = behind_m * (np.sin(beside_rad) * right - np.cos(beside_rad) * ahead)
    back = np.column_stack([level, np.full(len(rows), -above_m)])
    length = float(np.hypot(behind_m, above_m))
    free = np.array([world.ray_hit(m, b / length, length + ROOM_M) for m, b in zip(middle, back, strict=True)])
    room = np.clip(free - ROOM_M, NEAREST_M, length)
    window = int(2 * sigma) | 1
    least = np.lib.stride_tricks.sliding_window_view(np.pad(room, window // 2, mode="edge"), window).min(axis=1)
    place = middle + back * (averaged(least[:, None], sigma) / length)
    highest = -world.height(place[:, 0], place[:, 1]) - LEAST_HEIGHT_M
    place[:, 2] = np.minimum(place[:, 2], highest)
    ahead_m = averaged(np.where(has_owner[:, None], np.minimum(0.5 * away_m, AHEAD_M), AHEAD_M), sigma)
    target = middle + np.column_stack([ahead_m * ahead, np.zeros(len(rows))])
    return place, target


def averaged(rows: Floats, sigma: float) -> Floats:
    """Each row's average with its neighbours, weighted by a Gaussian of `sigma` rows; ends are held."""
    reach = int(3 * sigma)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    padded = np.pad(rows, ((reach, reach), (0, 0)), mode="edge")
    columns = [np.convolve(column, weights / weights.sum(), mode="valid") for column in padded.T]
    return np.stack(columns, axis=1)


def looking(place: Floats, target: Floats) -> Quat:
    """Attitude q_ned_from_rdf of a level camera that looks at a target."""
    north, east, down = (float(value) for value in target - place)
    yaw = atan2(east, north)
    pitch = atan2(-down, float(np.hypot(north, east)))
    return product(quat_of(yaw, pitch), _RDF_IN_FRD)
