"""To follow somebody: images of the onboard camera and the reports of a phone in, the actions of a pilot out.

A decision ten times a second: on each new image, and where none comes in time on the last once more, which is older
then. A guard that does not believe the pilot bounds what it asks for. Where the owner is lost, it does not fly.
"""

from math import isfinite
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector
from common.image_stream import ImageFrame
from policies.companion.decision_log import NO_GOAL
from policies.companion.guard.guard import Guard, Stance
from policies.companion.guard.interventions import BeginningReasons, Interventions
from policies.companion.guard.setpoint_delay import SetpointDelay
from policies.companion.guard.settings import GuardSettings
from policies.companion.image_client import ImageSource
from policies.companion.observation import Observer, image_layout
from policies.companion.odometry.by_sight import BySight
from policies.companion.owner_watch import OwnerWatch
from policies.companion.senses.image_fit import NO_IMAGES, OTHER_CLOCK, misfit
from policies.companion.senses.senses import Senses
from policies.companion.skills.pace import Pace
from policies.companion.skills.skill import Floats, Velocity
from policies.companion.telemetry import Own, Owner
from policies.companion.tracked_observer import TrackedObserver
from policies.companion.tracked_recorder import RECORD_LAYOUT, TrackedRecorder
from policies.companion.vehicle_link import VehicleLink
from policies.tasks.follow_me.observe import EGO_BLIND, TRACKED
from policies.tasks.layout import Layout

IMAGE_OLD_US = 500_000  # guess: five images missed, 3 m at full speed
IMAGE_EARLY_US = 500_000  # telemetry may be so much later than an image; of a later stamp nobody knows the age
GUARDED_OLD_US = 2_500_000  # the guard stands still before
LOOKED_UP_US = 10_000_000_000  # longer than anybody waits: what was overhead still is, where the vehicle stands
SEEN_S = 1.0  # the last sight of who is in sight is no older
OWNER_LOST_S = 5.0  # neither seen nor heard of; by a pilot without ears: not seen
STANDING = (Stance.STOP, Stance.SEARCH, Stance.BLIND)


class Pilot(Protocol):
    """Whoever follows: a trained policy, or a script that sees the same."""

    kind: int  # of its vector: EGO, EGO_BLIND or TRACKED
    image_shape: tuple[int, int, int]  # (height, width, channels) of the image it needs
    owner_hfrd: Vector | None  # [m] where the last image showed the owner's chest, from the vehicle; None: nowhere

    def reset(self) -> None:
        """Forgets what came before."""
        ...

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """The action for an observation: four numbers in [-1, 1]."""
        ...


class Following:
    """One vehicle's skill to follow.

    Args:
        camera: the onboard camera.
        pilot: who decides.
        guard: who bounds it; without, the pilot's word for the owner counts.
        hears: the phone counts; None: it does unless the pilot is told nothing of it.
    """

    ready, flying, drives = "ready to follow", "following", False
    is_along_nose = False
    action_size = 4
    stances = tuple(stance.value for stance in Stance)

    def __init__(
        self, camera: ImageSource, pilot: Pilot, guard: GuardSettings | None = None, *, hears: bool | None = None
    ) -> None:
        self.seen: Floats = np.zeros(0, dtype=np.float32)
        self.wanted: Velocity = ((0.0, 0.0, 0.0), 0.0)
        self._recorder: TrackedRecorder | None = None  # of a pilot that is told otherwise; made when it is needed
        self.camera = camera
        self._pilot = pilot
        is_tracked, is_guarded = pilot.kind == TRACKED, guard is not None and guard.is_on
        hears = pilot.kind != EGO_BLIND if hears is None else hears
        self._senses = Senses(hears=hears) if is_tracked or is_guarded else None
        self.guard = (
            Guard(guard, self._senses) if guard is not None and is_guarded and self._senses is not None else None
        )
        self._sight = (
            BySight(self._senses, self.guard.settings.sight_stop_std)
            if self.guard is not None and self._senses is not None
            else None
        )
        self._delay = SetpointDelay()
        after = (guard.return_s, guard.resume_s) if guard is not None and is_guarded else (0.0, 0.0)
        self.return_s, self.resume_s = after
        self._watch = OwnerWatch(hears=hears) if self._senses is None else self._senses.watch
        self._tracked = TrackedObserver(self._senses) if is_tracked and self._senses is not None else None
        self._observer = None if is_tracked else Observer(pilot.kind)
        self._vehicle: VehicleLink | None = None
        self._stance = Stance.FREE  # as told
        self._beginning = BeginningReasons()
        self._owner = Owner()
        self._image: ImageFrame | None = None  # the newest
        self._image_us = -1  # when it came in, on our clock; -1: never
        self._pace = Pace()
        self._is_early = False  # the newest image was stamped later than now, and left out
        self._is_new = False  # there is an image that was not decided on
        self._has_looked = False  # at the newest image
        self._is_tracked = False  # the tracker has been told of it

    @property
    def interventions(self) -> Interventions | None:
        return None if self.guard is None else self.guard.interventions

    @property
    def stance(self) -> str:
        return "" if self.guard is None else self.guard.stance.value

    def attach(self, vehicle: VehicleLink) -> None:
        """Hears the vehicle's fixes; tells the pilot what the guard does."""
        self._vehicle = vehicle
        if self._sight is not None:
            self._sight.attach(vehicle)
            self._delay.attach(vehicle)

    def receive(self, vehicle: VehicleLink, time_us: int, *, is_flying: bool) -> bool:  # noqa: ARG002
        self._owner = vehicle.owner
        self._delay.step(time_us)  # before anything that takes time
        image = self._taken(vehicle, time_us)
        if image is not None:
            self._image, self._image_us, self._is_new = image, time_us, True
            self._has_looked = self._is_tracked = False
        if image is not None and misfit(image, self._pilot.image_shape):
            image = None
        if self._senses is not None:
            self._senses.sense(vehicle.own, self._owner, image)
        if self._sight is not None and self.guard is not None:
            self._sight.step(vehicle.own, image, time_us)
            self.guard.vel_std = self._sight.std(vehicle.own)
            self.guard.reckon_with(self._delay.late_s)
        if self._recorder is not None:
            self._recorder.sense(vehicle.own, self._owner, image)
        return self._image is not None and self._pace.is_due(time_us, is_new=self._is_new)

    def is_ordered(self) -> bool:
        return False

    def blindness(self, own: Own, time_us: int, *, is_flying: bool) -> str:
        image = self._image
        old_us = GUARDED_OLD_US if self.guard is not None and is_flying else IMAGE_OLD_US
        if image is None or max(time_us - self._image_us, own.boot_us - image.time_us) > old_us:
            return OTHER_CLOCK if self._is_early else NO_IMAGES  # none came in, or what came in was old
        return misfit(image, self._pilot.image_shape)

    def _taken(self, vehicle: VehicleLink, time_us: int) -> ImageFrame | None:
        """A new image; one from the future is none."""
        image = self.camera.take(time_us)
        if image is not None:
            vehicle.clock.pictured(image.time_us)
            self._is_early = image.time_us - vehicle.own.boot_us > IMAGE_EARLY_US
        return None if self._is_early else image

    def loss(self, own: Own, *, is_flying: bool) -> str:
        if self.guard is not None and is_flying:
            return "owner lost" if self.guard.is_lost(own) else ""
        return "owner lost" if self._watch.silence_s(own.boot_us) > OWNER_LOST_S else ""

    def is_alone(self, own: Own) -> bool:
        return self._senses is not None and self._senses.silence_s(own) > SEEN_S

    def is_covered(self, own: Own) -> bool:
        if self._senses is None or not isfinite(own.pos_ned[0]):
            return False
        return isfinite(self._senses.map.room_up_m(own.pos_ned, own.boot_us, LOOKED_UP_US))

    @property
    def is_by_sight(self) -> bool:
        return self._sight is not None and self._sight.is_away

    def begin(self, own: Own) -> None:
        self._pilot.reset()
        if self._tracked is not None:
            self._tracked.begin(own)
        if self.guard is not None:
            self.guard.begin(own)

    def decide(self, own: Own, last_action: Floats, time_us: int, *, is_flying: bool) -> Floats | None:  # noqa: ARG002
        """Lets the pilot see the newest image.

        Who does not fly looks too: the owner must have been seen before anybody flies by sight.
        """
        image = self._image
        if image is None:
            return None
        self._pace.decided(time_us)
        self._is_new = False
        age_s = max(own.boot_us - image.time_us, time_us - self._image_us, 0) * 1e-6
        if self._tracked is not None:
            vector = self._tracked.vector(own, age_s)
        elif self._observer is not None:
            vector = self._observer.vector(own, self._owner, last_action, time_us, age_s)
        self.seen = vector.copy()
        action = self._pilot.act(vector, image.pixels)
        self._has_looked = bool(np.isfinite(action).all())
        if not self._has_looked:
            self._pilot.reset()  # what it remembers is no number either
        return action

    def setpoint(self, action: Floats, own: Own) -> Velocity:
        if self._tracked is not None:
            wanted = self.wanted = self._tracked.setpoint(action, own)
            (north, east, down), yaw_rate = allowed = self._guarded(wanted, own)
            if self.guard is not None:
                north, east = (float(each) for each in self.guard.goes_on_from)
            self._tracked.flown((north, east, down), yaw_rate)
            return allowed
        if self._observer is None:
            raise RuntimeError("somebody has to make a setpoint of an action")
        self.wanted = self._observer.setpoint(action, own)
        return self._guarded(self.wanted, own)

    def action_of(self, flown: Velocity, own: Own, action: Floats) -> Floats:
        return action if self._observer is None else self._observer.action_of(*flown, own, action)

    def _guarded(self, wanted: Velocity, own: Own) -> Velocity:
        """What the guard lets be flown."""
        if self.guard is None:
            return wanted
        allowed = self.guard.filtered(wanted, own)
        if self.guard.stance is not self._stance:
            if self._vehicle is not None:
                self._vehicle.say(f"Companion: {self.guard.stance.value}")
            if self._tracked is None and self._stance in STANDING and self.guard.stance is Stance.FREE:
                self._pilot.reset()  # what it remembers is from before; the frames of who looks at no image are true
            self._stance = self.guard.stance
        text = self._beginning.text(self.guard.interventions.latest, own.boot_us)
        if text and self._vehicle is not None:
            self._vehicle.say(f"Companion: {text}")
        return allowed

    record_layout = RECORD_LAYOUT

    @property
    def image_layout(self) -> Layout | None:
        return None if self._tracked is not None else image_layout(self._pilot.kind)

    def keep_records(self) -> None:
        """Its decisions will be noted; before anything is received."""
        if self._recorder is None:
            self._recorder = TrackedRecorder(self._senses)

    def recorded_frame(self, own: Own, flown: Velocity, time_us: int, *, is_flying: bool) -> Floats:
        """What the senses tell, whoever decides by what."""
        if self._recorder is None:
            raise RuntimeError("keep_records comes first")
        age_s = max(own.boot_us - self._image.time_us, time_us - self._image_us, 0) * 1e-6 if self._image else 0.0
        seen = self.seen if self._tracked is not None and is_flying else None
        return self._recorder.frame(own, flown, age_s, seen)

    def recorded_goal(self, own: Own) -> Vector:  # noqa: ARG002
        return NO_GOAL

    def recorded_image(self) -> NDArray[np.uint8] | None:
        return None if self._image is None else self._image.pixels

    def conclude(self, own: Own) -> None:
        """Tracks the owner: by the newest image, and by the phone; with senses that has been done."""
        if self._senses is None and self._image is not None and not self._is_tracked:
            self._is_tracked = True
            seen_hfrd = self._pilot.owner_hfrd if self._has_looked else None
            self._watch.update(self._image.time_us, own, self._owner, seen_hfrd)

    def owner_distance_m(self, own: Own) -> float:
        """From the vehicle to the owner as tracked; NaN while nothing is known."""
        return self._watch.distance_m(own)

    def image_age_s(self, time_us: int) -> float:
        """Since the newest image came in; infinite without one."""
        return (time_us - self._image_us) * 1e-6 if self._image_us >= 0 else float("inf")

    def hint(self, trouble: str) -> str:
        return self.camera.trouble if trouble == NO_IMAGES else ""

    def figures(self, own: Own, time_us: int) -> str:
        return f"owner {self.owner_distance_m(own):.1f} m | picture {self.image_age_s(time_us) * 1e3:.0f} ms"

    def close(self) -> None:
        self.camera.close()
