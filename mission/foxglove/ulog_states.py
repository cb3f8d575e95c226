"""The states that a kept log holds: ours, and as far as it has the same topics PX4's.

In: a ULog. Out: a state at most every 40 ms, where the log has an attitude: each topic as it was last till then. What a
log lacks is left out.
"""

from collections.abc import Iterator, Sequence
from math import nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from autopilot.vehicles.default_class import DEFAULT_CLASS
from common.geodesy import GeoPoint
from mission.foxglove.vehicle_state import NOWHERE, Battery, GnssFix, Motion, Person, VehicleState

PERIOD_US = 40_000
ARMED = 2  # vehicle_status.arming_state
FIX_3D = 3  # fix_type
Columns = NDArray[np.float64]
_VECTOR, _XYZ, _SPEEDS = ("x", "y", "z"), tuple(f"xyz[{i}]" for i in range(3)), ("vx", "vy", "vz")
_XYZW = tuple(f"q[{i}]" for i in (1, 2, 3, 0))  # a log's begin with w
_XYZW_SP = tuple(f"q_d[{i}]" for i in (1, 2, 3, 0))
_GROUNDTRUTH = "_groundtruth"
_GATES = {  # innovations by the field of PX4's message: its parameter, and PX4's default
    "gps_hpos": ("EKF2_GPS_P_GATE", 5.0), "gps_vpos": ("EKF2_GPS_P_GATE", 5.0), "gps_hvel": ("EKF2_GPS_V_GATE", 5.0),
    "gps_vvel": ("EKF2_GPS_V_GATE", 5.0), "baro_vpos": ("EKF2_BARO_GATE", 5.0), "rng_vpos": ("EKF2_RNG_GATE", 5.0),
    "mag_field": ("EKF2_MAG_GATE", 3.0), "ev_hpos": ("EKF2_EVP_GATE", 5.0), "ev_vpos": ("EKF2_EVP_GATE", 5.0),
    "ev_hvel": ("EKF2_EVV_GATE", 3.0), "ev_vvel": ("EKF2_EVV_GATE", 3.0),
}  # fmt: skip
_TITLES = {spec.nav_state: mode.name.replace("_", " ").title() for mode, spec in DEFAULT_CLASS.modes.items()}


class _Topic:
    """A topic's rows in the order of time, read one after the other."""

    def __init__(self, data: Any) -> None:
        times = data.data["timestamp"]
        self._order = np.argsort(times, kind="stable")
        self._data = data.data
        self.times: NDArray[np.int64] = times[self._order].astype(np.int64)
        self._found: dict[tuple[str, ...], Columns] = {}

    def at(self, time_us: int, names: tuple[str, ...]) -> Sequence[float] | None:
        """The fields as they were last at a time; None: not yet, or it has no such field."""
        columns = self._columns(names)
        row = int(np.searchsorted(self.times, time_us, side="right")) - 1
        if columns.shape[1] == 0 or row < 0:
            return None
        values: list[float] = columns[row].tolist()
        return values

    def has(self, name: str) -> bool:
        return name in self._data

    def all_named(self, start: str) -> tuple[str, ...]:
        """The elements of an array."""
        return tuple(name for name in self._data if name.startswith(f"{start}["))

    def _columns(self, names: tuple[str, ...]) -> Columns:
        found = self._found.get(names)
        if found is None:
            is_there = all(name in self._data for name in names)
            parts = [self._data[name][self._order].astype(float) for name in names] if is_there else []
            found = np.stack(parts, axis=1) if parts else np.zeros((len(self.times), 0))
            self._found[names] = found
        return found


class Text(NamedTuple):
    """What the vehicle has said."""

    time_us: int
    severity: int
    text: str


class UlogStates:
    """Reads a log.

    Args:
        log: which.
        home: origin of ned, where the log does not say it.
    """

    def __init__(self, log: ULog, home: GeoPoint) -> None:
        self._topics = {data.name: _Topic(data) for data in reversed(log.data_list) if data.multi_id == 0}
        self._parameters: dict[str, float] = log.initial_parameters
        self._home = home
        self.texts = [
            Text(int(message.timestamp), _severity(message.log_level), message.message)
            for message in sorted(log.logged_messages, key=lambda each: int(each.timestamp))
        ]

    def __iter__(self) -> Iterator[VehicleState]:
        return map(self.at, self.times())

    def times(self) -> list[int]:
        """When there is a state [µs]."""
        names = ("vehicle_attitude_groundtruth", "vehicle_attitude", "vehicle_local_position")
        rows = [self._topics[name].times for name in names if name in self._topics]
        if not rows:
            return []
        times = max(rows, key=len)
        _, first = np.unique(times // PERIOD_US, return_index=True)
        found: list[int] = times[first].tolist()
        return found

    def at(self, time_us: int) -> VehicleState:
        """The state at a time."""
        true, est = self._motion(time_us, _GROUNDTRUTH), self._motion(time_us, "")
        status = self._read(time_us, "vehicle_status", ("arming_state", "nav_state"))
        is_armed = status is not None and status[0] == ARMED
        battery = self._read(time_us, "battery_status", ("voltage_v", "current_a", "remaining"))
        return VehicleState(
            time_us=time_us,
            origin=self._origin(time_us),
            true=true,
            est=est,
            setpoint=self._setpoint(time_us) if is_armed else None,
            outputs=self._outputs(time_us),
            test_ratios=self._test_ratios(time_us),
            battery=None if battery is None else Battery(*battery),
            gnss=self._gnss(time_us),
            mode="" if status is None else _TITLES.get(int(status[1]), f"Mode {int(status[1])}"),
            is_armed=is_armed,
            goal_ned=self._read(time_us, "replay_frame", tuple(f"goal_ned[{i}]" for i in range(3))) or NOWHERE,
            owner=self._owner(time_us),
        )

    def _read(self, time_us: int, topic: str, names: tuple[str, ...]) -> Sequence[float] | None:
        found = self._topics.get(topic)
        return None if found is None else found.at(time_us, names)

    def _motion(self, time_us: int, which: str) -> Motion | None:
        place, attitude = f"vehicle_local_position{which}", f"vehicle_attitude{which}"
        parts = (
            self._read(time_us, place, _VECTOR),
            self._read(time_us, place, _SPEEDS),
            self._read(time_us, attitude, _XYZW),
            self._read(time_us, f"vehicle_angular_velocity{which}", _XYZ),
        )
        return None if all(part is None for part in parts) else _whole(*parts)

    def _setpoint(self, time_us: int) -> Motion | None:
        parts = (
            self._read(time_us, "vehicle_local_position_setpoint", _VECTOR),
            self._read(time_us, "vehicle_local_position_setpoint", _SPEEDS),
            self._read(time_us, "vehicle_attitude_setpoint", _XYZW_SP),
            self._read(time_us, "vehicle_rates_setpoint", ("roll", "pitch", "yaw")),
        )
        return None if all(part is None for part in parts) else _whole(*parts)

    def _origin(self, time_us: int) -> GeoPoint:
        for topic in ("vehicle_local_position", "vehicle_local_position_groundtruth"):
            found = self._read(time_us, topic, ("ref_lat", "ref_lon", "ref_alt"))
            if found is not None and any(found[:2]):
                return GeoPoint(*found)
        return self._home

    def _outputs(self, time_us: int) -> list[float]:
        found: list[float] = []
        for name in ("actuator_motors", "actuator_servos"):
            topic = self._topics.get(name)
            values = None if topic is None else topic.at(time_us, topic.all_named("control"))
            found += [value for value in values or () if value == value]  # the rest is room for more
        return found

    def _test_ratios(self, time_us: int) -> dict[str, float]:
        """Largest innov² / (gate² innov_var) of each."""
        innov, innov_var = (self._topics.get(f"estimator_innovation{end}") for end in ("s", "_variances"))
        if innov is None or innov_var is None:
            return {}
        found = {}
        for field, (parameter, default) in _GATES.items():
            names = (field,) if innov.has(field) else innov.all_named(field)
            values, variances = innov.at(time_us, names), innov_var.at(time_us, names)
            if values is not None and variances is not None and all(variance > 0.0 for variance in variances):
                gate = float(self._parameters.get(parameter, default))
                found[field] = max(v * v / s for v, s in zip(values, variances, strict=True)) / (gate * gate)
        return found

    def _gnss(self, time_us: int) -> GnssFix | None:
        for topic in ("vehicle_gps_position", "sensor_gps"):
            names = ("timestamp", "latitude_deg", "longitude_deg", "altitude_msl_m", "eph", "epv", "fix_type")
            found = self._read(time_us, topic, names)
            if found is None:  # before PX4 1.14
                old = self._read(time_us, topic, ("timestamp", "lat", "lon", "alt", "eph", "epv", "fix_type"))
                found = None if old is None else [old[0], 1e-7 * old[1], 1e-7 * old[2], 1e-3 * old[3], *old[4:]]
            if found is not None and found[-1] >= FIX_3D:
                return GnssFix(int(found[0]), *found[1:6])
        return None

    def _owner(self, time_us: int) -> Person | None:
        names = (*(f"owner_pos_ned[{i}]" for i in range(3)), "owner_heading_rad", "owner_stature_m")
        found = self._read(time_us, "replay_frame", names)
        return None if found is None else Person(found[:3], found[3], found[4])


def _whole(
    pos: Sequence[float] | None, vel: Sequence[float] | None, q: Sequence[float] | None, omega: Sequence[float] | None
) -> Motion:
    """A motion of what there is; the rest is NaN."""
    return Motion(pos or NOWHERE, vel or NOWHERE, q or (nan,) * 4, omega or NOWHERE)


def _severity(level: int) -> int:
    """Of a log's level, which is a digit."""
    number = level - ord("0")
    return number if 0 <= number <= 7 else 6
