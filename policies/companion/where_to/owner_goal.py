"""After somebody with a phone: where they are is the goal of a skill that goes to goals.

In: images of the onboard camera, the phone's reports, telemetry. Out: a goal that moves with the owner, and how fast
whoever goes there may be: it stays behind them, the farther the less is known of where they are. Who they are and where
the guard's senses say, as those who follow by images have them. Neither seen nor heard of it searches: it goes to where
they were going when they were last seen or heard of, and stands there until they are seen or it is the end.
"""

from math import hypot, nan

import numpy as np

from autopilot.interface.vehicle_state import Severity
from common.image_stream import ImageFrame
from policies.companion.guard.guard import GOES_ON_S, SHORT_OF_M
from policies.companion.guard.limits import faded, stopping_speed
from policies.companion.guard.settings import IMAGES_S, GuardSettings
from policies.companion.image_client import ImageSource
from policies.companion.senses.image_fit import NO_IMAGES, OLD_IMAGES, OTHER_CLOCK, misfit
from policies.companion.senses.seen_owner import PersonNow
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import NEVER_US
from policies.companion.vehicle_link import VehicleLink
from policies.companion.where_to.goals import Goal
from policies.tasks.follow_me.observe import IMAGE_SHAPE
from policies.tasks.navigate.walking_goal import CLOSING_HZ

KEPT_M = 1.5  # on the level, from an owner whose place is known
DEVIATIONS = 2.0  # that it keeps away farther, of the error of their place
IMAGE_OLD_US = 300_000  # guess: three images missed; then it goes by the phone alone
BLIND_US = round(IMAGES_S * 1e6)  # so long without an image to go by it says so, as who follows by images waits
LOST = "owner lost"
_BRAKE_M_S2 = 1.0  # before where they are looked for


class OwnerGoal:
    """What one vehicle's companion goes after.

    Args:
        vehicle: whose links it hears.
        camera: the onboard camera.
        senses: who finds the owner; fed here.
        settings: when it searches, how fast, and when it is the end.
    """

    def __init__(self, vehicle: VehicleLink, camera: ImageSource, senses: Senses, settings: GuardSettings) -> None:
        self._vehicle, self._camera, self._settings = vehicle, camera, settings
        self._senses, self._watch = senses, senses.watch
        self._owner: PersonNow | None = None  # by sights, or if those are old by the phone too
        self._last: PersonNow | None = None  # as of the last word of them, seen or heard
        self.done = LOST
        self.may_search = False
        """It drives, under a guard: else who is lost is lost at once."""
        self._is_searching = False  # as told
        self._wrong = NO_IMAGES  # with the newest image
        self._taken_us: int | None = None  # when one came that nothing was wrong with, or it began; on our clock
        self._is_blind = False  # as told: none came for long

    def frame(self, time_us: int) -> None:
        """Takes in what the camera sees, and what the phone has said."""
        own, owner = self._vehicle.own, self._vehicle.owner
        self._senses.sense(own, owner, self._taken(time_us))
        if abs(own.boot_us - self._known_us) > IMAGE_OLD_US:
            self._watch.update(own.boot_us, own, owner, None)
        self._owner = self._senses.owner_now(own)
        if self._silence_s <= self._settings.slow_s:
            self._last = self._owner
        self._tell()

    def _taken(self, time_us: int) -> ImageFrame | None:
        """A new image that the senses can make something of; where none comes for long it says so once."""
        image = self._camera.take(time_us)
        if image is not None:
            self._vehicle.clock.pictured(image.time_us)
            self._wrong = misfit(image, IMAGE_SHAPE) or self._off_clock(image)
        is_heard = self._vehicle.own.boot_us != NEVER_US  # else no clock to hold an image against
        if self._taken_us is None or not is_heard or (image is not None and not self._wrong):
            self._taken_us, self._is_blind = time_us, False
        if not self._is_blind and time_us - self._taken_us > BLIND_US:
            self._is_blind = True
            self._vehicle.say(f"Companion: {self._wrong or NO_IMAGES}: by the phone alone", Severity.WARNING)
        return None if self._wrong else image

    def _off_clock(self, image: ImageFrame) -> str:
        """What is wrong with when an image was taken; "" if nothing is."""
        ahead_us = image.time_us - self._vehicle.own.boot_us
        if abs(ahead_us) <= IMAGE_OLD_US:
            return ""
        return OTHER_CLOCK if ahead_us > 0 else OLD_IMAGES

    @property
    def _known_us(self) -> int:
        """As of when the owner is known, on the vehicle's clock."""
        track = self._watch.track
        return NEVER_US if track is None else track.time_us

    @property
    def _silence_s(self) -> float:
        """Since they were seen or heard of."""
        return self._watch.silence_s(self._vehicle.own.boot_us)

    def is_ordered(self) -> bool:
        """Nobody sends it anywhere."""
        return False

    @property
    def is_searching(self) -> bool:
        """They are neither seen nor heard of, and it may look for them, with a camera that shows something."""
        s, may_find = self._settings, self.may_search and not self._is_blind
        return may_find and self._last is not None and s.search_s < self._silence_s <= s.lost_s

    @property
    def goal(self) -> Goal | None:
        """Where the owner is, or is looked for; None: lost."""
        if self.is_searching and self._last is not None:
            north, east = self._last.pos_ned[:2] + GOES_ON_S * self._last.vel
            return Goal((float(north), float(east), nan), "where the owner was going")
        if self._owner is None or self._silence_s > self._settings.search_s:
            return None
        north, east = self._owner.pos_ned[:2]
        return Goal((float(north), float(east), nan), "owner")

    def reached(self) -> Goal | None:
        """It is never over."""
        return None

    @property
    def speed_max_m_s(self) -> float:
        """Level speed at which it stays behind them, slower once they are not heard of either, or searches."""
        owner, goal, s, pos_ned = self._owner, self.goal, self._settings, self._vehicle.own.pos_ned
        if owner is None or goal is None:
            return 0.0
        north, east = goal.pos_ned[0] - pos_ned[0], goal.pos_ned[1] - pos_ned[1]
        away_m = hypot(north, east)
        if self.is_searching:
            return min(stopping_speed(away_m - SHORT_OF_M, s.goal_reaction_s, _BRAKE_M_S2), s.search_ahead_speed)
        kept_m = KEPT_M + DEVIATIONS * float(np.sqrt(0.5 * np.trace(owner.pos_var)))
        if away_m < kept_m:
            return 0.0
        leaving = (north * owner.vel[0] + east * owner.vel[1]) / away_m
        behind = max(float(leaving), 0.0) + float(CLOSING_HZ) * (away_m - kept_m)
        return behind * (faded(self._silence_s, s.slow_s, s.stop_s) if self.may_search else 1.0)

    def _tell(self) -> None:
        """Says when it begins to search, and when they are found."""
        if self.is_searching is self._is_searching:
            return
        self._is_searching = self.is_searching
        if self._is_searching or self.goal is not None:
            self._vehicle.say(f"Companion: {'searching the owner' if self._is_searching else 'following'}")
