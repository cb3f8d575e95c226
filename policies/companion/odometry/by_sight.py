"""Flying on without GNSS: visual odometry for the vehicle's own estimator, for as long as it needs it.

In: the vehicle's fixes (GPS_RAW_INT), telemetry, pictures with who is where in them. Out: VISION_SPEED_ESTIMATE, as a
tracking camera sends it, a text when it begins and when it is over, and how well the velocity is known, which the guard
goes by. It measures only while GNSS is away: it costs milliseconds, and says nothing that a receiver does not say
better. What the vehicle makes of it is the vehicle's (EKF2_EV_CTRL); one that does not use it loses its position as
ever.
"""

from collections import deque
from typing import Any

import numpy as np

from autopilot.mavlink.channel import AUTOPILOT_COMPONENT
from common.attitude import Vector
from common.image_stream import ImageFrame
from policies.companion.odometry.visual_odometry import Motion, VisualOdometry
from policies.companion.senses.poses import Pose
from policies.companion.senses.senses import Senses
from policies.companion.vehicle_link import NEVER_US, Own, VehicleLink

FIX_HZ = 5.0
AWAY_US = 600_000  # so long told of no fix GNSS is away: three messages;
SILENT_US = 3_000_000  # told nothing, after so long: some receivers tell once a second
BACK_US = 6_000_000  # so long with one it is back: after 5 s of fixes that do not fit the estimate is set to them
SETTLED_US = 15_000_000  # and after so long the estimate has come to it: after 5 s of rejected fixes it is set
DRIFT_M_S2 = 0.1  # a velocity that nobody measures goes off by so much: half a degree of tilt; guess
INERTIAL_STD_M_S = 0.1  # when it was measured last
_FIX_3D = 3  # GPS_FIX_TYPE
_ALIKE = 9.0  # measurements in a row err alike, and count as one: the estimator takes each for one of its own
_WAIT_US = 200_000  # for the attitude of a picture; it comes with the next telemetry
_KEPT = 50  # velocities at 50 Hz: a second, by which no picture is late that is worth looking at


class BySight:
    """One vehicle's visual odometry.

    Args:
        senses: who is where, and how the vehicle was held.
        most_std: [m/s] a velocity known no better is not told.
    """

    def __init__(self, senses: Senses, most_std: float) -> None:
        self._senses, self._most_std = senses, most_std
        self._odometry = VisualOdometry()
        self._vehicle: VehicleLink | None = None
        self._boot_us = 0  # the vehicle's clock
        self._heard_us = NEVER_US  # the last word of fixes, on the companion's clock
        self._fixed_us = NEVER_US  # the last fix, likewise
        self._missed_us = NEVER_US  # when there was none last
        self._waiting: ImageFrame | None = None  # for its attitude
        self._flown: deque[tuple[int, Vector]] = deque(maxlen=_KEPT)  # how fast the vehicle took itself to go
        self.is_away = False
        """GNSS is, and was there before."""
        self._away_us = NEVER_US  # since when, on the vehicle's clock
        self.motion: Motion | None = None
        """The newest since GNSS is away."""
        self.count = 0
        """Measurements sent so far."""

    def attach(self, vehicle: VehicleLink) -> None:
        """Hears the vehicle's fixes."""
        self._vehicle = vehicle
        vehicle.listen("GPS_RAW_INT", self._fix_heard, FIX_HZ)

    def _fix_heard(self, system: int, component: int, fields: Any, time_us: int) -> None:
        if self._vehicle is None or (system, component) != (self._vehicle.system_id, AUTOPILOT_COMPONENT):
            return
        self._heard_us = time_us
        if fields.fix_type >= _FIX_3D:
            self._fixed_us = time_us
        else:
            self._missed_us = time_us

    def step(self, own: Own, image: ImageFrame | None, time_us: int) -> None:
        """One step of the companion's loop.

        Args:
            own: telemetry.
            image: a new one; None: there is none. It is looked at in a later step: decisions come first.
            time_us: the companion's clock.
        """
        if own.boot_us < self._boot_us:  # it has restarted: what was measured was at no time that it knows
            self._fixed_us, self.is_away, self.motion, self._waiting = NEVER_US, False, None, None
            self._odometry.forget()
            self._flown.clear()
        if own.boot_us != self._boot_us and np.isfinite(own.vel_ned).all():
            self._flown.append((own.boot_us, own.vel_ned))
        self._boot_us = own.boot_us
        self._judge(own, time_us)
        if image is not None:
            self._waiting = image if self.is_away else None
        elif self._waiting is not None:
            self._look(own, self._waiting)

    def std(self, own: Own) -> float | None:
        """[m/s] how well the vehicle can know its velocity; None: by GNSS, and nobody need ask."""
        if not self.is_away:
            return None
        since_us, std = self._away_us, INERTIAL_STD_M_S
        if self.motion is not None:
            since_us, std = self.motion.time_us, self.motion.std
        return std + DRIFT_M_S2 * max(own.boot_us - since_us, 0) * 1e-6

    def _judge(self, own: Own, time_us: int) -> None:
        """Whether GNSS is away; one that never was there is no loss."""
        vehicle = self._vehicle
        if vehicle is None or self._fixed_us == NEVER_US:
            return
        is_reported = self._missed_us > self._fixed_us and time_us - self._fixed_us >= AWAY_US
        if is_reported or time_us - self._heard_us >= SILENT_US:
            self._missed_us = time_us
            if not self.is_away:
                self.is_away, self._away_us, self.motion = True, own.boot_us, None
                self._odometry.forget()
        elif self.is_away and time_us - self._missed_us >= BACK_US:
            self.is_away, self._waiting = False, None
            if self.motion is not None:
                vehicle.say("Companion: GNSS is back")
        vehicle.frame.is_watched = self.is_away or time_us - self._missed_us < SETTLED_US

    def _look(self, own: Own, image: ImageFrame) -> None:
        """Looks at the picture that waits, once the attitudes before and after it are known."""
        pose = self._senses.poses.between(image.time_us)
        if pose is None:
            if own.boot_us - image.time_us > _WAIT_US:
                self._waiting = None
            return
        self._waiting = None
        motion = self._odometry.see(image.pixels, pose, self._people(own, pose), own.vel_ned)
        if motion is not None and motion.std < self._most_std and self._vehicle is not None:
            if self.motion is None:
                self._vehicle.say("Companion: no GNSS: by sight")
            self.motion = motion
            self._send(self._vehicle, motion, own)

    def _people(self, own: Own, pose: Pose) -> list[np.ndarray[Any, np.dtype[np.float64]]]:
        """Where everybody was then who may be in the picture."""
        seen = self._senses.seen
        others = [person.pos_ned for person in self._senses.others_now(own)]
        return [seen.now(pose.time_us)[0], *others] if seen.sights else others

    def _send(self, vehicle: VehicleLink, motion: Motion, own: Own) -> None:
        """Tells a velocity as of now, by how much faster the vehicle says that it has become since the pictures.

        What is older than an estimator can remember it takes for how fast it goes now.
        """
        time_us, vel_ned = motion.time_us, motion.vel_ned
        if self._flown and self._flown[0][0] <= time_us:
            times_us = [moment_us for moment_us, _ in self._flown]
            then = [np.interp(time_us, times_us, axis) for axis in zip(*(vel for _, vel in self._flown), strict=True)]
            time_us, vel_ned = own.boot_us, vel_ned + np.array(self._flown[-1][1]) - np.array(then)
        north, east, down = (float(x) for x in vel_ned)
        vehicle.send(
            "VISION_SPEED_ESTIMATE",
            usec=time_us,
            x=north,
            y=east,
            z=down,
            covariance=tuple(_ALIKE * float(x) for x in motion.cov.ravel()),
            reset_counter=0,
        )
        self.count += 1
