"""The scanner on board as a component of the vehicle's MAVLink network: what its driver sends, ten times a second.

In: ranges of the simulated sensor. Out: OBSTACLE_DISTANCE of the sectors, and a DISTANCE_SENSOR of each tilted beam,
whose quaternion says where it looks from the body. The vehicle passes them on, as all that is for everybody.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

from autopilot.mavlink.client_end import ClientEnd
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.convert import UINT16_MAX, u16, wxyz_from_quat
from common.attitude import Quat, inverse, product, quat_of, yaw_of
from common.range_sectors import BEAM_ELEVATIONS_DEG, FIRST_EDGE_DEG, RANGE_M, SECTOR_DEG, SECTORS
from sim.sensors.scanner import Scanner

PERIOD_US = 100_000
COMPONENT = 196  # MAV_COMP_ID_OBSTACLE_AVOIDANCE
LEAST_CM = 20  # guess
REACH_CM = round(100.0 * RANGE_M)
BODY_FRD = 12  # MAV_FRAME
CUSTOM_ROTATION = 100  # MAV_SENSOR_ROTATION_CUSTOM
LASER = 0  # MAV_DISTANCE_SENSOR
_BINS = 72  # of OBSTACLE_DISTANCE
_FIRST_BEAM_ID = 1  # the range finder that looks down is 0
_COVARIANCE_UNKNOWN = 255


@dataclass(frozen=True, slots=True)
class Scan:
    """What was measured once."""

    time_us: int
    centimetres: Sequence[int]  # of the sectors and then of the beams
    q_ned_from_frd: Quat  # that it was levelled by


class ScannerDevice:
    """The scanner of one flight.

    Args:
        scanner: what it measures with.
        system_id: of the vehicle.
        lag_us: from a scan to its messages, which say when it was taken.
    """

    def __init__(self, scanner: Scanner, system_id: int, lag_us: int = 0) -> None:
        self._scanner, self._lag_us = scanner, lag_us
        self._under_way: deque[Scan] = deque()
        self.vehicle_end, self._link = memory_pair(LinkRole.ONBOARD)
        self._client = ClientEnd(self._link, system_id, COMPONENT, vehicle_id=system_id)
        self._due_us = 0

    def frame(self, time_us: int) -> None:
        """Scans if it is time; before the flight controller's frame."""
        self._link.receive()  # it hears the vehicle's telemetry too; ours reads the attitude that it levels by itself
        self._client.keep_alive(time_us)
        if time_us >= self._due_us:
            self._due_us = max(self._due_us + PERIOD_US, time_us)
            centimetres = [
                REACH_CM + 1 if range_m >= RANGE_M else max(u16(100.0 * float(range_m)), LEAST_CM)
                for range_m in self._scanner.measure(time_us)
            ]
            self._under_way.append(Scan(time_us, centimetres, self._scanner.q_ned_from_frd))
        while self._under_way and time_us >= self._under_way[0].time_us + self._lag_us:
            scan = self._under_way.popleft()
            self._tell_beams(scan)
            self._tell_sectors(scan.time_us, scan.centimetres[:SECTORS])

    def _tell_sectors(self, time_us: int, centimetres: Sequence[int]) -> None:
        self._client.send(
            "OBSTACLE_DISTANCE",
            time_usec=time_us,
            sensor_type=LASER,
            distances=(*centimetres, *(UINT16_MAX,) * (_BINS - SECTORS)),
            increment=round(SECTOR_DEG),
            min_distance=LEAST_CM,
            max_distance=REACH_CM,
            increment_f=SECTOR_DEG,
            angle_offset=FIRST_EDGE_DEG + 0.5 * SECTOR_DEG,
            frame=BODY_FRD,
        )

    def _tell_beams(self, scan: Scan) -> None:
        time_us, centimetres, q_ned_from_frd = scan.time_us, scan.centimetres[SECTORS:], scan.q_ned_from_frd
        heading = yaw_of(q_ned_from_frd)
        for i, (elevation_deg, distance_cm) in enumerate(zip(BEAM_ELEVATIONS_DEG, centimetres, strict=True)):
            q_frd_from_beam = product(inverse(q_ned_from_frd), quat_of(heading, radians(elevation_deg)))
            self._client.send(
                "DISTANCE_SENSOR",
                time_boot_ms=time_us // 1000 & 0xFFFFFFFF,
                min_distance=LEAST_CM,
                max_distance=REACH_CM,
                current_distance=distance_cm,
                type=LASER,
                id=_FIRST_BEAM_ID + i,
                orientation=CUSTOM_ROTATION,
                covariance=_COVARIANCE_UNKNOWN,
                quaternion=wxyz_from_quat(q_frd_from_beam),
            )
