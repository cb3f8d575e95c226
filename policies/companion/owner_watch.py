"""Where the owner is, and for how long they have been lost: sightings in the pictures and the phone's reports, tracked.

In: pictures, telemetry and reports as they come in. Out: the track, and the age of the last word of the owner. Only
whether the companion may fly, and what its line of figures shows, depends on it: policies see pictures and reports.
"""

from math import asin, atan2, inf, isfinite, sqrt

from common.attitude import inverse, product, rotated
from common.image_stream import ImageFrame
from policies.companion.observation import REPORT_LAG_S
from policies.companion.vehicle_link import Own, Owner
from policies.sight import SHIRT_OVER_CHEST_M, find_owner
from policies.tasks.follow_me.observe import camera_mount
from policies.tracker import OwnerTrack, OwnerTracker, PhoneReport, Sighting


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

    def update(self, picture: ImageFrame, own: Own, owner: Owner) -> None:
        """Takes in a new picture, and the report that came since the last one.

        Args:
            picture: of this moment.
            own: the vehicle's newest telemetry.
            owner: the phone's newest report.
        """
        if not isfinite(own.pos_ned[0]):  # directions from nowhere
            return
        now_us = picture.time_us
        if self._hears and owner.count != self._reports:
            self._reports = owner.count
            valid_us = now_us - round(REPORT_LAG_S * 1e6)
            self._tracker.hear(now_us, PhoneReport(valid_us, owner.pos_ned, owner.vel_ned))
        sighting = sighting_of(picture, own)
        if sighting is not None:
            self._tracker.see(now_us, sighting)
        self._track = self._tracker.at(now_us)

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


def sighting_of(picture: ImageFrame, own: Own) -> Sighting | None:
    """The owner in a picture, as the tracker takes it; None if they are not to be seen."""
    sight = find_owner(picture.pixels, picture.hfov_deg, picture.depth_half_m)
    if sight is None:
        return None
    q_ned_from_rdf = product(own.q_ned_from_frd, camera_mount())
    north, east, below = rotated(q_ned_from_rdf, sight.place_rdf)
    right, down, ahead = rotated(inverse(q_ned_from_rdf), (north, east, below + SHIRT_OVER_CHEST_M))
    range_m = sqrt(right**2 + down**2 + ahead**2)
    elevation_rad = asin(-down / max(range_m, 1.0e-6))
    pos_ned = own.pos_ned  # of the lens, a decimetre away
    return Sighting(atan2(right, ahead), elevation_rad, range_m, pos_ned, q_ned_from_rdf)
