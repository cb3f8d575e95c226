"""The companion computer: telemetry and images in, Offboard setpoints out. Start here.

In: bytes of a MAVLink link and images of the onboard camera, taken in at every step. Out: a decision of the policy
for each new image (10 Hz), sent at once and repeated at 20 Hz; a change of mode when the state machine asks for one;
texts for the pilot. `frame(time_us)` is the whole loop: a process calls it on the wall clock, a lockstep flight on
simulated time, and then the same flight gives the same bytes.
"""

from collections import deque
from collections.abc import Callable
from math import isclose, isfinite
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.client_end import ByteLink
from common.attitude import Vector
from common.image_stream import ImageFrame
from policies.companion.engagement import Engagement, Phase, Sending, Situation, Wish
from policies.companion.image_client import ImageSource
from policies.companion.observation import Observer
from policies.companion.owner_watch import OwnerWatch
from policies.companion.vehicle_link import VehicleLink
from policies.tasks.follow_me.observe import DEPTH_HALF_M, EGO_BLIND, HFOV_DEG, TILT_DEG

SETPOINT_US = 50_000
DECISION_US = 100_000
DECISION_EARLY_US = 10_000  # an image may come this much earlier than the decision period asks
IMAGE_OLD_US = 500_000  # guess: five images missed, 3 m at full speed
TELEMETRY_OLD_US = 500_000
HEARTBEAT_OLD_US = 3_000_000  # sent at 1 Hz
OWNER_LOST_S = 5.0  # neither seen nor heard of; by a pilot without ears: not seen
NO_IMAGES = "no new pictures"
NO_DECISION = "the policy does not decide"
LATENCIES_KEPT = 600  # a minute of decisions
LENS = (HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))  # of the images that policies are trained on
LENS_TOLERANCE = 0.02  # guess: a fifth of a degree of tilt, two of the field of view

Floats = NDArray[np.float32]
STILL: tuple[Vector, float] = ((0.0, 0.0, 0.0), 0.0)


class Pilot(Protocol):
    """Whoever flies: a trained policy, or a script that sees the same."""

    kind: int  # of its vector: EGO or EGO_BLIND
    image_shape: tuple[int, int, int]  # (height, width, channels) of the image it needs
    owner_hfrd: Vector | None  # [m] where the last image showed the owner's chest, from the vehicle; None: nowhere

    def reset(self) -> None:
        """Forgets what came before."""
        ...

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """The action for an observation: four numbers in [-1, 1]."""
        ...


class Companion:
    """One vehicle's companion.

    Args:
        link: bytes to and from the vehicle.
        camera: the onboard camera.
        pilot: who flies.
        is_told: engage as soon as everything is there; otherwise the pilot chooses Offboard.
        wall_s: a clock in seconds that the latency is measured with; none: it is not measured.
    """

    def __init__(
        self,
        link: ByteLink,
        camera: ImageSource,
        pilot: Pilot,
        *,
        is_reported: bool = False,
        wall_s: Callable[[], float] | None = None,
    ) -> None:
        self.vehicle = VehicleLink(link)
        self.engagement = Engagement(is_reported=is_reported)
        self.latencies_s: deque[float] = deque(maxlen=LATENCIES_KEPT)  # image in to setpoint out
        self.decision_count = 0
        self.seen: Floats = np.zeros(0, dtype=np.float32)  # the vector that was decided on last
        self.trouble = ""  # why it does not fly
        self._camera = camera
        self._pilot = pilot
        self._observer = Observer(pilot.kind)
        self._watch = OwnerWatch(hears=pilot.kind != EGO_BLIND)
        self._wall_s = wall_s
        self._image: ImageFrame | None = None  # the newest
        self._image_us = -1  # when it came in, on our clock; -1: never
        self._decided_us = 0  # when the image that was decided on was taken, on the vehicle's clock
        self._action: Floats = np.zeros(4, dtype=np.float32)
        self._setpoint = STILL
        self._is_undecided = False  # the pilot's last action was no number
        self._setpoint_due_us = 0
        self._sending = Sending.NOTHING

    def frame(self, time_us: int) -> None:
        """One step of the loop.

        Args:
            time_us: the companion's own clock; never goes back.
        """
        self.vehicle.receive(time_us)
        self.vehicle.keep_alive(time_us)
        image = self._camera.take(time_us)
        begun_s = self._wall_s() if self._wall_s is not None and image is not None else None
        if image is not None:
            self._image, self._image_us = image, time_us
            self.vehicle.clock.pictured(image.time_us)
        blindness = self._blindness(time_us)
        self.trouble = blindness or self._loss() or (NO_DECISION if self._is_undecided else "")
        orders = self.engagement.step(self._situation(time_us))
        if orders.text:
            self.vehicle.say(orders.text)
        if orders.wish is not Wish.NONE:
            self.vehicle.ask_for(orders.wish)
        self._switch(orders.sending)
        has_looked = image is not None and not blindness and self._look(image, time_us)
        has_decided = has_looked and orders.sending is Sending.POLICY
        if orders.sending is not Sending.NOTHING and (has_decided or time_us >= self._setpoint_due_us):
            self._setpoint_due_us = time_us + SETPOINT_US
            self.vehicle.send_setpoint(*self._setpoint)
        if has_decided and begun_s is not None and self._wall_s is not None:
            self.latencies_s.append(self._wall_s() - begun_s)
        if image is not None:  # only now: the setpoint does not wait for it
            seen_hfrd = self._pilot.owner_hfrd if has_looked else None
            self._watch.update(image.time_us, self.vehicle.own, self.vehicle.owner, seen_hfrd)

    def image_age_s(self, time_us: int) -> float:
        """Since the newest image came in; infinite without one."""
        return (time_us - self._image_us) * 1e-6 if self._image_us >= 0 else float("inf")

    def owner_distance_m(self) -> float:
        """From the vehicle to the owner as tracked; NaN while nothing is known."""
        return self._watch.distance_m(self.vehicle.own)

    @property
    def action(self) -> Floats:
        """What the pilot chose last, shape (4,); zeros while it does not fly."""
        return self._action.copy()

    def close(self) -> None:
        """Stops sending; the vehicle notices."""
        self._camera.close()
        self.vehicle.close()

    def _switch(self, sending: Sending) -> None:
        """Takes over, or lets go."""
        if sending is Sending.POLICY and self._sending is not Sending.POLICY:
            self._pilot.reset()  # an episode begins, as in training: no memory, no last action
            self._decided_us = -DECISION_US
        self._sending = sending
        if sending is not Sending.POLICY:
            self._setpoint = STILL
            self._action[:] = 0.0

    def _look(self, image: ImageFrame, time_us: int) -> bool:
        """Lets the pilot see an image, if one is due, and decide if it flies; whether it was due.

        Who does not fly looks too: the owner must have been seen before anybody flies by sight.
        """
        if 0 <= image.time_us - self._decided_us < DECISION_US - DECISION_EARLY_US:
            return False  # a clock that has gone back is that of a vehicle that has restarted
        self._decided_us = image.time_us
        own = self.vehicle.own
        vector = self._observer.vector(own, self.vehicle.owner, self._action, time_us)
        self.seen = vector.copy()
        action = self._pilot.act(vector, image.pixels)
        self._is_undecided = not np.isfinite(action).all()
        if self._is_undecided:
            self._pilot.reset()  # what it remembers is no number either
            self._setpoint = STILL
            return False
        if self._sending is Sending.POLICY:
            self._action = action
            self._setpoint = self._observer.setpoint(action, own)
            self.decision_count += 1
        return True

    def _situation(self, time_us: int) -> Situation:
        own = self.vehicle.own
        return Situation(
            time_us=time_us,
            is_offboard=own.mode in (Mode.OFFBOARD, Mode.GUIDED),
            is_airborne=own.is_armed and not own.is_on_ground,
            is_holding=own.mode is Mode.HOLD,
            mode_name=own.mode_name,
            trouble=self.trouble,
            is_refused=self.vehicle.take_refusal(),
        )

    def _blindness(self, time_us: int) -> str:
        """Why there is nothing to decide on; "" if there is."""
        own = self.vehicle.own
        if time_us - own.heartbeat_us > HEARTBEAT_OLD_US:
            return "no heartbeat of the vehicle"
        is_placed = isfinite(own.pos_ned[0])
        if not is_placed or time_us - min(own.attitude_us, own.position_us) > TELEMETRY_OLD_US:
            return "no attitude or position from the vehicle"
        image = self._image
        if image is None or max(time_us - self._image_us, own.boot_us - image.time_us) > IMAGE_OLD_US:
            return NO_IMAGES  # none came in, or what came in was old
        if image.pixels.shape != self._pilot.image_shape:
            return "pictures of another size"
        lens = (image.hfov_deg, image.pitch_deg, image.depth_half_m)
        if not all(isclose(here, there, rel_tol=LENS_TOLERANCE) for here, there in zip(lens, LENS, strict=True)):
            return "pictures of another lens"
        return ""

    def _loss(self) -> str:
        """Whether the owner is lost."""
        return "owner lost" if self._watch.silence_s(self.vehicle.own.boot_us) > OWNER_LOST_S else ""

    @property
    def phase(self) -> Phase:
        return self.engagement.phase
