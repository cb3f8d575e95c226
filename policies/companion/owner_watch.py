"""Where the owner is, and for how long they have been lost: what the pilot sees and the phone reports, tracked.

In: where the pilot saw the owner, telemetry and reports as they come in. Out: the track, and the age of the last word
of the owner. Only whether the companion may fly, and what its line of figures shows, depends on it: policies see
images and reports.
"""

from math import asin, atan2, inf, isfinite, sqrt

from common.attitude import Quat, Vector, product, quat_of, yaw_of
from policies.companion.telemetry import Own, Owner
from policies.tasks.follow_me.observe import REPORT_LAG_S
from policies.tracker import OwnerTrack, OwnerTracker, PhoneReport, Sighting

_AHEAD = (0.5, 0.5, 0.5, 0.5)  # q_frd_from_rdf of an eye that looks ahead


class OwnerWatch:
    """The tracker, fed with what a companion gets.

    Args:
        hears: whether the phone's reports count; who flies by sight alone has lost an owner who is out of sight.
    """

    def __init__(self, *, hears: bool = True) -> None:
        self._tracker = OwnerTracker()
        self._hears = hears
        self._track: OwnerTrack | None = None
        self._reports = 0  # fed so far

    def update(self, now_us: int, own: Own, owner: Owner, seen_hfrd: Vector | None) -> None:
        """Takes in what a new image showed, and the report that came since the last one.

        Args:
            now_us: when the image was taken, on the vehicle's clock.
            own: the vehicle's newest telemetry.
            owner: the phone's newest report.
            seen_hfrd: [m] where it showed the owner's chest, from the vehicle; None: nowhere.
        """
        if isfinite(own.pos_ned[0]):  # no directions from nowhere
            self.take(now_us, now_us, owner, None if seen_hfrd is None else sighting_of(seen_hfrd, own))

    def take(self, image_us: int, now_us: int, owner: Owner, sighting: Sighting | None) -> bool:
        """Takes in a picture that is older than now, and the report that came since the last one.

        Args:
            image_us: when it was taken, on the vehicle's clock.
            now_us: on that clock.
            owner: the phone's newest report.
            sighting: the owner in it; None: nowhere.

        Returns:
            Whether the sighting is plausible.
        """
        if self._track is not None and now_us < self._track.time_us:  # the vehicle has restarted: another frame, too
            self._tracker = OwnerTracker()
        if self._hears and owner.count != self._reports:
            self._reports = owner.count
            valid_us = now_us - round(REPORT_LAG_S * 1e6)
            self._tracker.hear(now_us, PhoneReport(valid_us, owner.pos_ned, owner.vel_ned))
        is_plausible = sighting is not None and self._tracker.see(image_us, sighting)
        self._track = self._tracker.at(now_us)
        return is_plausible

    def forget(self) -> None:
        """Who was tracked was somebody else."""
        self._tracker = OwnerTracker()

    @property
    def track(self) -> OwnerTrack | None:
        """As of the newest update; None before the first."""
        return self._track

    def silence_s(self, vehicle_us: int) -> float:
        """Since the owner was last seen or heard of.

        Args:
            vehicle_us: now, on the vehicle's clock.
        """
        track = self._track
        if track is None:
            return inf
        return min(track.seen_age_s, track.heard_age_s - REPORT_LAG_S) + (vehicle_us - track.time_us) * 1e-6

    def distance_m(self, own: Own) -> float:
        """From the vehicle to the owner's chest; NaN while nothing is known."""
        if self._track is None or not self._track.is_known:
            return float("nan")
        return sqrt(sum((a - b) ** 2 for a, b in zip(self._track.pos_ned, own.pos_ned, strict=True)))


def sighting_of(seen_hfrd: Vector, own: Own) -> Sighting:
    """A position ahead, right and down of the vehicle [m] as the tracker takes it."""
    return sighting_from(seen_hfrd, own.pos_ned, own.q_ned_from_frd)


def sighting_from(seen_hfrd: Vector, pos_ned: Vector, q_ned_from_frd: Quat) -> Sighting:
    """The same from a pose of the vehicle: seen by a level eye inside it."""
    ahead, right, down = seen_hfrd
    range_m = sqrt(ahead**2 + right**2 + down**2)
    elevation_rad = asin(-down / max(range_m, 1.0e-6))
    q_ned_from_rdf = product(quat_of(yaw_of(q_ned_from_frd), 0.0), _AHEAD)
    return Sighting(atan2(right, ahead), elevation_rad, range_m, pos_ned, q_ned_from_rdf)
