"""What range finders on board tell, as a navigating policy takes it: sectors round the nose, and tilted beams.

In: OBSTACLE_DISTANCE and DISTANCE_SENSOR, of whichever component of the vehicle's system. Out: ranges in the order of
training. A tilted beam is a DISTANCE_SENSOR of orientation MAV_SENSOR_ROTATION_CUSTOM whose quaternion says where it
looks; it counts for the elevation of the layout that it is nearest to once it is levelled, by the attitude of when it
was measured.
"""

from functools import lru_cache
from math import asin, atan2, cos, degrees, dist, hypot, isfinite, isnan, sin
from typing import Any

import numpy as np
import warp as wp

from autopilot.mavlink.wire.convert import UINT16_MAX, quat_from_wxyz
from autopilot.mavlink.wire.number_bounds import is_known
from common.attitude import Quat, rotated, yaw_of
from common.range_sectors import SCANNER, RangeLayout
from common.warp_start import start_warp
from policies.companion.senses.poses import PoseHistory
from policies.companion.skills.skill import Floats
from policies.companion.telemetry import NEVER_US
from policies.companion.vehicle_link import VehicleLink
from policies.tasks.flight.moved_ranges import move_rows, sectors_struct

SCAN_HZ = 20.0  # that the vehicle is asked for
OLD_US = 500_000  # guess, as of images: five scans missed
UNKNOWN_MAX = 1 / 8  # of the sectors; guess: six times what training has lost
_STAMP_OLD_US = 5_000_000  # the sender's clock is another than the vehicle's if a scan seems older; guess
_NORTH_FRAMES, _BODY_FRAMES = frozenset({0, 1}), frozenset({8, 12})  # MAV_FRAME
_CUSTOM_ROTATION = 100  # MAV_SENSOR_ROTATION_CUSTOM
_ELEVATION_OFF_DEG, _BEARING_OFF_DEG = 6.0, 20.0  # guess: the attitude is a frame older than the beam
_POSE_OFF_US = 60_000  # of telemetry at 10 Hz the nearest pose is at most half as far off
_JUMP_M, _CHANGE_M_S = 0.5, 3.0  # so far, and so much faster than now, a vehicle may have moved; guess
_OVERLAP_DEG = 0.1  # by which a bin must reach into a sector to count there: rounding


class Ranges:
    """The newest ranges of one vehicle.

    Args:
        vehicle: whose links it hears.
        layout: of what the policy takes.
        scan_hz: how often the vehicle is asked to tell them; more often than it scans: each scan is told sooner.
    """

    def __init__(self, vehicle: VehicleLink, layout: RangeLayout = SCANNER, scan_hz: float = SCAN_HZ) -> None:
        beam_count = len(layout.beam_elevations_deg)
        self.ranges_m: Floats = np.full(layout.sectors + beam_count, layout.range_m, dtype=np.float32)
        self.is_known = np.ones(layout.sectors, dtype=np.bool_)
        """Of the sectors: something was told of them, and be it that nothing is there."""
        self.scan_us = NEVER_US  # when the newest sectors came in
        self.stamp_us = -1  # the sender's time of them
        self.taken_us = NEVER_US
        """When they were measured, on the vehicle's clock."""
        self.poses = PoseHistory()
        """Of the vehicle, to say where it was then."""
        self.layout = layout
        self._beam_us = [NEVER_US] * beam_count
        self._unknown_count = layout.sectors
        self._is_new = False
        self._boot_us = NEVER_US
        self._prepare_move()
        self._own, self._clock = vehicle.own, vehicle.clock
        system_id = vehicle.system_id

        def sectors(sysid: int, _: int, fields: Any, time_us: int) -> None:
            if sysid == system_id:
                self._sectors_reported(fields, time_us)

        def beam(sysid: int, _: int, fields: Any, time_us: int) -> None:
            if sysid == system_id:
                self._beam_reported(fields, time_us)

        vehicle.listen("OBSTACLE_DISTANCE", sectors, scan_hz)
        if beam_count:
            vehicle.listen("DISTANCE_SENSOR", beam)

    def follow(self) -> None:
        """Remembers where the vehicle is now; at every step."""
        if self._own.boot_us < self._boot_us:  # it has restarted: what was measured before was at no time that it knows
            self.poses, self.taken_us = PoseHistory(), NEVER_US
        self._boot_us = self._own.boot_us
        self.poses.note(self._own)

    def take_new(self) -> bool:
        """Whether new sectors have come in since the last call."""
        is_new, self._is_new = self._is_new, False
        return is_new

    def from_here(self) -> Floats:
        """The newest ranges as they would be from where the vehicle is now, by the kernel function of training.

        Those of tilted beams are as they were measured, and all are where it is not known where that was: telemetry has
        no pose of then, the scan is too old, or the position has jumped since, as estimates do when GNSS is back.
        """
        pose, own = self.poses.at(self.taken_us), self._own
        age_us = own.boot_us - self.taken_us
        if pose is None or abs(pose.time_us - self.taken_us) > _POSE_OFF_US or not 0 <= age_us <= OLD_US:
            return self.ranges_m
        moved_m = dist(pose.pos_ned[:2], own.pos_ned[:2])
        if not moved_m <= _JUMP_M + age_us * 1e-6 * (hypot(*own.vel_ned[:2]) + _CHANGE_M_S):
            return self.ranges_m
        self._measured[0] = self._moved[0] = self.ranges_m
        self._was[0] = *pose.pos_ned[:2], yaw_of(pose.q_ned_from_frd)
        self._here[0] = *own.pos_ned[:2], yaw_of(own.q_ned_from_frd)
        self._move.launch()
        moved: Floats = self._moved[0].copy()
        return moved

    def _prepare_move(self) -> None:
        start_warp()
        shape = (1, self.ranges_m.size)
        measured, moved = wp.zeros(shape, dtype=float), wp.zeros(shape, dtype=float)
        was, here = wp.zeros(1, dtype=wp.vec3), wp.zeros(1, dtype=wp.vec3)
        self._measured: Floats = measured.numpy()  # live views, as of the others
        self._moved: Floats = moved.numpy()
        self._was: Floats = was.numpy()
        self._here: Floats = here.numpy()
        inputs = [measured, was, here, sectors_struct(self.layout), moved]
        self._move = wp.launch(move_rows, 1, inputs, record_cmd=True)

    def trouble(self, time_us: int, old_us: int = OLD_US) -> str:
        """Why nothing can be decided on them; "" if it can.

        Args:
            time_us: the companion's own clock.
            old_us: an age of the sectors that is too old.
        """
        if time_us - self.scan_us > old_us:
            return "no ranges all round"
        if self._unknown_count > UNKNOWN_MAX * self.layout.sectors:
            return "the range finder does not look round far enough"
        if any(time_us - beam_us > OLD_US for beam_us in self._beam_us):
            return "no ranges of the tilted beams"
        return ""

    def _sectors_reported(self, fields: Any, time_us: int) -> None:
        increment_deg = fields.increment if isnan(fields.increment_f) else fields.increment_f or fields.increment
        first_deg = fields.angle_offset
        if not is_known(360.0, increment_deg, first_deg) or not increment_deg or fields.time_usec == self.stamp_us:
            return
        taken_us = self._taken_us(fields.time_usec)
        if fields.frame in _NORTH_FRAMES:
            first_deg -= degrees(yaw_of(self._attitude_at(taken_us)))
        elif fields.frame not in _BODY_FRAMES:
            return
        layout = self.layout
        nearest = np.full(layout.sectors, np.inf, dtype=np.float32)
        for i, distance_cm in enumerate(fields.distances):
            if distance_cm == UINT16_MAX:
                continue
            is_met = distance_cm <= fields.max_distance
            distance_m = min(distance_cm * 0.01, layout.range_m) if is_met else layout.range_m
            for k in _sectors_of(layout, first_deg + i * increment_deg, abs(increment_deg)):
                nearest[k] = min(nearest[k], distance_m)
        is_unknown = np.isinf(nearest)
        self._unknown_count = int(is_unknown.sum())
        self.is_known = ~is_unknown
        self.ranges_m[: layout.sectors] = np.where(is_unknown, layout.range_m, nearest)
        self.stamp_us, self.scan_us, self._is_new = fields.time_usec, time_us, True
        self.taken_us = taken_us

    def _taken_us(self, stamp_us: int) -> int:
        """A sender's time on the vehicle's clock: the same, unless it makes no sense there."""
        boot_us = self._own.boot_us
        return stamp_us if 0 <= boot_us - stamp_us < _STAMP_OLD_US else boot_us

    def _attitude_at(self, time_us: int) -> Quat:
        pose = self.poses.at(time_us)
        own = self._own
        is_newer = pose is None or abs(own.boot_us - time_us) <= abs(pose.time_us - time_us)
        return own.q_ned_from_frd if pose is None or is_newer else pose.q_ned_from_frd

    def _beam_reported(self, fields: Any, time_us: int) -> None:
        if fields.orientation != _CUSTOM_ROTATION or not is_known(1.1, *fields.quaternion):
            return
        forward = rotated(quat_from_wxyz(tuple(fields.quaternion)), (1.0, 0.0, 0.0))
        attitude = self._attitude_at(self._taken_us(self._clock.time_us(fields.time_boot_ms)))
        north, east, down = rotated(attitude, forward)
        if not isfinite(down) or abs(down) > 1.0:
            return
        off_rad = atan2(east, north) - yaw_of(attitude)
        if abs(degrees(atan2(sin(off_rad), cos(off_rad)))) > _BEARING_OFF_DEG:
            return
        elevation_deg = degrees(asin(-down))
        layout = self.layout
        off_deg = [abs(beam_deg - elevation_deg) for beam_deg in layout.beam_elevations_deg]
        k = min(range(len(off_deg)), key=off_deg.__getitem__)
        if off_deg[k] > _ELEVATION_OFF_DEG:
            return
        is_inside = fields.min_distance <= fields.current_distance <= fields.max_distance
        range_m = min(fields.current_distance * 0.01, layout.range_m) if is_inside else layout.range_m
        self.ranges_m[layout.sectors + k] = range_m
        self._beam_us[k] = time_us


@lru_cache(maxsize=256)
def _sectors_of(layout: RangeLayout, middle_deg: float, width_deg: float) -> tuple[int, ...]:
    """The sectors that a bin reaches into."""
    found = []
    for k in range(layout.sectors):
        sector_deg = layout.first_edge_deg + (k + 0.5) * layout.sector_deg
        apart_deg = abs((middle_deg - sector_deg + 180.0) % 360.0 - 180.0)
        if apart_deg < 0.5 * (width_deg + layout.sector_deg) - _OVERLAP_DEG:
            found.append(k)
    return tuple(found)
