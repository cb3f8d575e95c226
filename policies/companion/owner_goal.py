"""After somebody with a phone and a blue shirt: where they are is the goal of a skill that goes to goals.

In: images of the onboard camera, the phone's reports, telemetry. Out: a goal that moves with the owner, and how fast
whoever goes there may be: it stays behind them, the farther the less is known of where they are.
"""

from math import dist, nan

import numpy as np

from common.attitude import inverse, rotated
from policies.companion.goals import Goal
from policies.companion.image_client import ImageSource
from policies.companion.owner_watch import OwnerWatch
from policies.companion.vehicle_link import NEVER_US, VehicleLink
from policies.shirt_detector import chest_hfrd
from policies.tasks.navigate.walking_goal import CLOSING_HZ

KEPT_M = 1.5  # on the level, from an owner whose place is known
DEVIATIONS = 2.0  # that it keeps away farther, of the error of their place
IMAGE_OLD_US = 300_000  # guess: three images missed; then it goes by the phone alone
SILENT_S = 5.0  # neither seen nor heard of: lost
LOST = "owner lost"


class OwnerGoal:
    """What one vehicle's companion goes after.

    Args:
        vehicle: whose links it hears.
        camera: the onboard camera.
    """

    def __init__(self, vehicle: VehicleLink, camera: ImageSource) -> None:
        self._vehicle, self._camera = vehicle, camera
        self._watch = OwnerWatch()
        self.done = LOST

    def frame(self, time_us: int) -> None:
        """Takes in what the camera sees, and what the phone has said."""
        own, owner, known_us = self._vehicle.own, self._vehicle.owner, self._known_us
        image = self._camera.take(time_us)
        is_new = image is not None and own.boot_us - image.time_us < IMAGE_OLD_US
        if image is not None and is_new and not 0 <= known_us - image.time_us < IMAGE_OLD_US:
            self._vehicle.clock.pictured(image.time_us)
            down = rotated(inverse(own.q_ned_from_frd), (0.0, 0.0, 1.0))
            self._watch.update(image.time_us, own, owner, chest_hfrd(image.pixels, down[:2]))
        elif abs(own.boot_us - known_us) > IMAGE_OLD_US:
            self._watch.update(own.boot_us, own, owner, None)

    @property
    def _known_us(self) -> int:
        """As of when the owner is known, on the vehicle's clock."""
        track = self._watch.track
        return NEVER_US if track is None else track.time_us

    def is_ordered(self) -> bool:
        """Nobody sends it anywhere."""
        return False

    @property
    def goal(self) -> Goal | None:
        """Where the owner is; None: lost."""
        track = self._watch.track
        if track is None or self._watch.silence_s(self._vehicle.own.boot_us) > SILENT_S:
            return None
        return Goal((float(track.pos_ned[0]), float(track.pos_ned[1]), nan), "owner")

    def reached(self) -> Goal | None:
        """It is never over."""
        return None

    @property
    def speed_max_m_s(self) -> float:
        """Level speed at which it stays behind them."""
        track = self._watch.track
        if track is None:
            return 0.0
        (north, east), pos_ned = track.pos_ned[:2], self._vehicle.own.pos_ned
        away_m = dist((north, east), pos_ned[:2])
        kept_m = KEPT_M + DEVIATIONS * float(np.sqrt(0.5 * np.trace(track.pos_cov[:2, :2])))
        if away_m < kept_m:
            return 0.0
        leaving = ((north - pos_ned[0]) * track.vel_ned[0] + (east - pos_ned[1]) * track.vel_ned[1]) / away_m
        return max(float(leaving), 0.0) + float(CLOSING_HZ) * (away_m - kept_m)
