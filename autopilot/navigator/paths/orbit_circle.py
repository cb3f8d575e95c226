"""A point that runs round a circle: the moving setpoint of an orbit, which a pilot may change while it is flown.

The turns of a mission are a way with an end (autopilot.navigator.paths.spline).
"""

from math import atan2, cos, hypot, isfinite, pi, sin, sqrt

from autopilot.interface.client_requests import OrbitRequest
from autopilot.navigator.setpoint import Vector
from common.attitude import wrapped

ACCEL_FRACTION = 0.6  # of `limits.accel_hor` that a circle may take; the rest keeps to it in wind: guess


class Circle:
    """A circle flown at a constant speed, starting at the point of it nearest to a position.

    Args:
        centre_ned: [m]; its height is that of the circle.
        radius_m: positive is clockwise seen from above, as MAVLink counts.
        speed_m_s: along the circle.
        start_ned: [m] where the vehicle comes from; the centre itself starts in the north.
    """

    __slots__ = ("angle", "centre_ned", "direction", "radius_m", "speed_m_s", "turned_rad")

    def __init__(self, centre_ned: Vector, radius_m: float, speed_m_s: float, start_ned: Vector) -> None:
        self.centre_ned = centre_ned
        self.radius_m = abs(radius_m)
        self.direction = 1.0 if radius_m >= 0.0 else -1.0
        self.speed_m_s = speed_m_s
        away = (start_ned[0] - centre_ned[0], start_ned[1] - centre_ned[1])
        self.angle = atan2(away[1], away[0]) if hypot(*away) > 0.1 else 0.0  # [rad] from north, of the point
        self.turned_rad = 0.0

    @property
    def pos_ned(self) -> Vector:
        """Where the point is [m]."""
        north, east, down = self.centre_ned
        return north + self.radius_m * cos(self.angle), east + self.radius_m * sin(self.angle), down

    @property
    def vel_ned(self) -> Vector:
        """Its velocity [m/s]."""
        speed = self.direction * self.speed_m_s
        return -speed * sin(self.angle), speed * cos(self.angle), 0.0

    @property
    def yaw_to_centre(self) -> float:
        return self.angle + pi if self.angle <= 0.0 else self.angle - pi

    @property
    def yaw_along(self) -> float:
        return wrapped(self.angle + self.direction * 0.5 * pi)

    @property
    def yaw_rate(self) -> float:
        """Of a heading that turns with the point [rad/s]."""
        return self.direction * self.speed_m_s / self.radius_m

    def advance(self, dt_s: float) -> None:
        """Moves the point on."""
        step = self.speed_m_s * dt_s / self.radius_m
        self.turned_rad += step
        self.angle = wrapped(self.angle + self.direction * step)


def orbit_refusal(request: OrbitRequest, radius_m: float, bounds_m: tuple[float, float], fastest: float) -> str:
    """Why a circle of a radius [m] cannot be gone round as asked; empty if it can.

    Args:
        request: what a client asks for.
        radius_m: of the circle, either way round.
        bounds_m: least and greatest radius.
        fastest: [m/s] with which the circle can be gone round.
    """
    least, most = bounds_m
    if not least <= abs(radius_m) <= most:
        return f"a radius of {abs(radius_m):.1f} m is not between {least:g} and {most:g}"
    if isfinite(request.lat_deg) != isfinite(request.lon_deg):
        return "needs both latitude and longitude"
    if abs(request.speed_m_s) > fastest:
        return f"{abs(request.speed_m_s):.1f} m/s is too fast for this circle: {fastest:.1f} m/s at most"
    if request.speed_m_s == 0.0:
        return "an orbit needs a speed"
    return "the number of turns cannot be negative" if request.turns_rad < 0.0 else ""


def speed_limit(radius_m: float, accel_max: float) -> float:
    """The speed [m/s] with which a circle can be flown with an acceleration [m/s²] of the vehicle."""
    return sqrt(ACCEL_FRACTION * accel_max * abs(radius_m))
