"""Flying on without GNSS: visual odometry for the vehicle's own estimator, for as long as it needs it.

In: the vehicle's fixes (GPS_RAW_INT), telemetry, pictures with who is where in them. Out: a velocity, as a tracking
camera sends it, a text when it begins and when it is over, and how well the velocity is known, which the guard goes by.
It measures only while GNSS is away: it costs milliseconds, and says nothing that a receiver does not say better. What
the vehicle makes of it is the vehicle's (EKF2_EV_CTRL); one that does not use it loses its position as ever.
"""

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.mavlink.channel import AUTOPILOT_COMPONENT
from common.attitude import Vector
from common.image_stream import ImageFrame
from policies.companion.odometry.visual_odometry import Motion, VisualOdometry
from policies.companion.senses.poses import Pose
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import NEVER_US, Own
from policies.companion.vehicle_link import VehicleLink

Floats = NDArray[np.float64]

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
_KEPT = 50  # velocities at 50 Hz: a second, by which no image is late that is worth looking at
_FRESH_US = 100_000  # a velocity from telemetry that is older says nothing of now
_MOST_M_S2, _MOST_STEP_M_S = 20.0, 0.3  # what changes faster is an estimate that is reset


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
        self._velocities: deque[tuple[int, Vector]] = deque(maxlen=_KEPT)  # telemetry, on the vehicle's clock
        self._velocity_us = NEVER_US  # arrival of the newest of them
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
            self._velocities.clear()
        self._boot_us = own.boot_us
        self._note_velocity(own)
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
        if motion is None or motion.std >= self._most_std or self._vehicle is None:
            return
        gained = self._gained_since(motion.time_us, own)
        if gained is None:
            return
        if self.motion is None:
            self._vehicle.say("Companion: no GNSS: by sight")
        self.motion = motion
        drift = DRIFT_M_S2 * (own.boot_us - motion.time_us) * 1e-6
        cov = _ALIKE * motion.cov + drift**2 * np.eye(3)
        self._vehicle.send_velocity(own.boot_us, motion.vel_ned + gained, cov)
        self.count += 1

    def _people(self, own: Own, pose: Pose) -> list[np.ndarray[Any, np.dtype[np.float64]]]:
        """Where everybody was then who may be in the picture."""
        seen = self._senses.seen
        others = [person.pos_ned for person in self._senses.others_now(own)]
        return [seen.now(pose.time_us)[0], *others] if seen.sights else others

    def _note_velocity(self, own: Own) -> None:
        """Takes the vehicle's velocity into the history, which begins anew where the estimate is reset."""
        if own.position_us == self._velocity_us or not np.isfinite(own.vel_ned).all():
            return
        self._velocity_us = own.position_us
        if self._velocities:
            last_us, last = self._velocities[-1]
            if own.boot_us <= last_us:
                return
            most = _MOST_STEP_M_S + _MOST_M_S2 * (own.boot_us - last_us) * 1e-6
            if np.linalg.norm(np.subtract(own.vel_ned, last)) > most:
                self._velocities.clear()
        self._velocities.append((own.boot_us, own.vel_ned))

    def _gained_since(self, time_us: int, own: Own) -> Floats | None:
        """[m/s] (3,) by how much the vehicle's velocity has changed since an image; None: that is not known.

        An estimator fuses what is older than its buffer as if it were current: 0.2 s late that is 0.7 m/s off behind a
        runner. The vehicle's own change holds what has been corrected since: an innovation counts again until images
        show it, three times at 0.3 s, which is stable while one corrects less than a third.
        """
        history = self._velocities
        if not history or history[0][0] > time_us or own.boot_us - history[-1][0] > _FRESH_US:
            return None
        times_us = [each_us for each_us, _ in history]
        axes = zip(*(velocity for _, velocity in history), strict=True)
        then = [float(np.interp(time_us, times_us, axis)) for axis in axes]
        return np.subtract(history[-1][1], then)
