"""Where somebody else is: a target's position and velocity from reports that come a few times a second, with noise.

In: positions, with or without velocities, in ned, at the time they arrive. Out: the target now. A constant-velocity
Kalman filter (Bar-Shalom, Li and Kirubarajan 2001, section 6.3.2: discrete white-noise acceleration); north and east
have the same noise and share one covariance.
"""

from math import hypot, isfinite

from autopilot.navigator.setpoint import Vector

_START_VEL_VAR = 9.0  # [m²/s²] of a target first seen: people, cars; guess
_RESET_SIGMA = 8.0  # a report that far off is another place, not noise; guess
_SPEED_MAX_M_S = 60.0  # faster is an error of the sender; guess


class AxisFilter:
    """Variances and gains of position and velocity along axes of equal noise."""

    __slots__ = ("pos_var", "pos_vel_cov", "vel_var")

    def __init__(self, pos_var: float) -> None:
        self.pos_var = pos_var
        self.pos_vel_cov = 0.0
        self.vel_var = _START_VEL_VAR

    def predict(self, dt_s: float, accel_var: float) -> None:
        self.pos_var += dt_s * (2.0 * self.pos_vel_cov + dt_s * self.vel_var) + 0.25 * dt_s**4 * accel_var
        self.pos_vel_cov += dt_s * self.vel_var + 0.5 * dt_s**3 * accel_var
        self.vel_var += dt_s * dt_s * accel_var

    def gains_of_position(self, obs_var: float) -> tuple[float, float]:
        """Gains of position and velocity for a measured position; the variances shrink."""
        innov_var = self.pos_var + obs_var
        pos_gain, vel_gain = self.pos_var / innov_var, self.pos_vel_cov / innov_var
        self.vel_var -= vel_gain * self.pos_vel_cov
        self.pos_vel_cov *= 1.0 - pos_gain
        self.pos_var *= 1.0 - pos_gain
        return pos_gain, vel_gain

    def gains_of_velocity(self, obs_var: float) -> tuple[float, float]:
        """The same for a measured velocity."""
        innov_var = self.vel_var + obs_var
        pos_gain, vel_gain = self.pos_vel_cov / innov_var, self.vel_var / innov_var
        self.pos_var -= pos_gain * self.pos_vel_cov
        self.pos_vel_cov *= 1.0 - vel_gain
        self.vel_var *= 1.0 - vel_gain
        return pos_gain, vel_gain


class TargetFilter:
    """One target. Unknown (`time_us` None) until the first position.

    Args:
        accel_std: [m/s²] how much the target changes its velocity within a second.
    """

    __slots__ = ("_level", "_vertical", "accel_std", "heard_us", "pos_ned", "time_us", "vel_ned")

    def __init__(self, accel_std: float) -> None:
        self.accel_std = accel_std
        self.forget()

    def forget(self) -> None:
        """Knows nothing from now on."""
        self.time_us: int | None = None  # of position and velocity
        self.heard_us = 0  # of the last position
        self.pos_ned: Vector = (0.0, 0.0, 0.0)
        self.vel_ned: Vector = (0.0, 0.0, 0.0)

    @property
    def speed_xy(self) -> float:
        return hypot(self.vel_ned[0], self.vel_ned[1])

    @property
    def course_std(self) -> float:
        """Standard deviation [rad] of the direction in which the target moves; above 1 there is none worth using."""
        speed = self.speed_xy
        return self._level.vel_var**0.5 / speed if self.time_us is not None and speed > 0.0 else 9.0

    def at(self, time_us: int) -> Vector:
        """The position [m] at a time shortly after the last report."""
        dt_s = (time_us - (self.time_us or time_us)) * 1e-6
        return _sum(self.pos_ned, self.vel_ned, dt_s)

    def report(
        self, time_us: int, pos_ned: Vector, vel_ned: Vector | None, pos_std: float, vel_std: float = 0.3
    ) -> None:
        """Takes a report; one that is not finite, or of a speed that nobody has, says nothing.

        Args:
            time_us: when it came.
            pos_ned: [m].
            vel_ned: [m/s], None if it is not reported.
            pos_std: [m] per axis.
            vel_std: [m/s] per axis.
        """
        if not all(map(isfinite, (*pos_ned, *(vel_ned or ()), pos_std, vel_std))):
            return
        if vel_ned is not None and hypot(vel_ned[0], vel_ned[1]) > _SPEED_MAX_M_S:
            return
        if self.time_us is None or self._is_elsewhere(time_us, pos_ned, pos_std):
            self._level, self._vertical = AxisFilter(pos_std**2), AxisFilter(pos_std**2)
            self.pos_ned, self.vel_ned = pos_ned, vel_ned or (0.0, 0.0, 0.0)
            self.time_us = self.heard_us = time_us
            return
        dt_s = (time_us - self.time_us) * 1e-6
        self.pos_ned = self.at(time_us)
        self.time_us = self.heard_us = time_us
        for axis in (self._level, self._vertical):
            axis.predict(dt_s, self.accel_std**2)
        self._correct_position(pos_ned, pos_std)
        if vel_ned is not None:
            self._correct_velocity(vel_ned, vel_std)
        if not all(map(isfinite, self.pos_ned)) or not self.speed_xy <= _SPEED_MAX_M_S:
            self.forget()

    def _is_elsewhere(self, time_us: int, pos_ned: Vector, pos_std: float) -> bool:
        expected = self.at(time_us)
        dt_s = (time_us - (self.time_us or time_us)) * 1e-6
        allowed = _RESET_SIGMA * (pos_std + self._level.pos_var**0.5) + 0.5 * self.accel_std * 10.0 * dt_s * dt_s
        away_m = hypot(pos_ned[0] - expected[0], pos_ned[1] - expected[1])
        return bool(away_m > allowed)

    def _correct_position(self, pos_ned: Vector, std: float) -> None:
        level, vertical = self._level.gains_of_position(std**2), self._vertical.gains_of_position(std**2)
        self._apply(_sum(pos_ned, self.pos_ned, -1.0), level, vertical)

    def _correct_velocity(self, vel_ned: Vector, std: float) -> None:
        level, vertical = self._level.gains_of_velocity(std**2), self._vertical.gains_of_velocity(std**2)
        self._apply(_sum(vel_ned, self.vel_ned, -1.0), level, vertical)

    def _apply(self, innov: Vector, level: tuple[float, float], vertical: tuple[float, float]) -> None:
        gains = (level, level, vertical)
        north, east, down = (pos + gain[0] * error for pos, gain, error in zip(self.pos_ned, gains, innov, strict=True))
        self.pos_ned = (north, east, down)
        north, east, down = (vel + gain[1] * error for vel, gain, error in zip(self.vel_ned, gains, innov, strict=True))
        self.vel_ned = (north, east, down)


def _sum(a: Vector, b: Vector, scale: float) -> Vector:
    """A + scale · b."""
    return a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]
