"""A level frame that does not jump when the vehicle's estimate is set right.

In: positions and velocities as the vehicle tells them. Out: how far its local frame has moved against what it has
flown. While GNSS is away its position drifts; once it is back the estimate goes to where the vehicle is, within a
second or two, and everything that was put down in its frame (a map, the track of who is followed) would be beside the
trees by as much. What a position changes by beyond the velocity is that correction; less it, places stay where they
were seen. Positions of others by GNSS move along, so that they are where they are from the vehicle.
"""

from common.attitude import Vector
from policies.companion.vehicle_clock import REORDERED_MS

_GAP_S = 0.5  # after a longer silence nobody knows what it has flown


class SteadyFrame:
    """Of one vehicle's telemetry."""

    def __init__(self) -> None:
        self.shift_ne: tuple[float, float] = (0.0, 0.0)
        """[m] from this frame to the vehicle's: north and east."""
        self.is_watched = False
        """Corrections count; otherwise positions are passed on as they come."""
        self._last: tuple[int, Vector, Vector] | None = None

    def steady(self, boot_us: int, pos_ned: Vector, vel_ned: Vector) -> Vector:
        """A position [m] in this frame.

        Args:
            boot_us: when it was, on the vehicle's clock.
            pos_ned: [m] as the vehicle tells it.
            vel_ned: [m/s] likewise.
        """
        last = self._last
        if last is not None and -REORDERED_MS <= (boot_us - last[0]) // 1000 < 0:
            return self.of(pos_ned)  # messages overtook each other
        self._last = (boot_us, pos_ned, vel_ned)
        if last is not None and boot_us < last[0]:  # it has restarted: another frame
            self.shift_ne, last = (0.0, 0.0), None
        if self.is_watched and last is not None:
            dt_s = (boot_us - last[0]) * 1e-6
            if dt_s <= _GAP_S:
                north, east = (
                    pos_ned[k] - last[1][k] - 0.5 * dt_s * (vel_ned[k] + last[2][k]) for k in (0, 1)
                )  # fmt: skip
                self.shift_ne = (self.shift_ne[0] + north, self.shift_ne[1] + east)
        return self.of(pos_ned)

    def of(self, pos_ned: Vector) -> Vector:
        """A place [m] of the vehicle's frame in this one."""
        north, east, down = pos_ned
        return north - self.shift_ne[0], east - self.shift_ne[1], down
