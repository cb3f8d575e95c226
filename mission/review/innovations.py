"""How far measurements were from what the estimator expected: test ratios, by PX4's definition.

A ratio is (innovation / (gate * its standard deviation))^2; above 1 the measurement is rejected. PX4 has logged them in
three forms; where only innovations and their variances were logged, as in our own logs, they are computed here.
"""

from dataclasses import dataclass

import numpy as np

from mission.review.curves import Rows
from mission.review.logged_flight import LoggedFlight, Topic

DEFAULT_GATE = 5.0  # PX4's default of most EKF2_*_GATE
# What is measured: title, unit, fields of estimator_innovations, the gate's parameter, PX4's default of it
_SOURCES = {
    "gnss_pos": ("GNSS position", "m", "gps_hpos[0] gps_hpos[1]", "EKF2_GPS_P_GATE", 5.0),
    "gnss_vel": ("GNSS velocity", "m/s", "gps_hvel[0] gps_hvel[1] gps_vvel", "EKF2_GPS_V_GATE", 5.0),
    "gnss_hgt": ("GNSS height", "m", "gps_vpos", "EKF2_GPS_P_GATE", 5.0),
    "baro_hgt": ("Barometer", "m", "baro_vpos", "EKF2_BARO_GATE", 5.0),
    "mag": ("Magnetometer", "gauss", "mag_field[0] mag_field[1] mag_field[2]", "EKF2_MAG_GATE", 3.0),
    "heading": ("Heading", "rad", "heading", "EKF2_HDG_GATE", 2.6),
    "rng_hgt": ("Range finder", "m", "rng_vpos", "EKF2_RNG_GATE", 5.0),
    "ev_pos": ("External position", "m", "ev_hpos[0] ev_hpos[1] ev_vpos", "EKF2_EVP_GATE", 5.0),
    "ev_vel": ("External velocity", "m/s", "ev_hvel[0] ev_hvel[1] ev_vvel", "EKF2_EVV_GATE", 3.0),
    "optical_flow": ("Optical flow", "rad/s", "flow[0] flow[1]", "EKF2_OF_GATE", 3.0),
    "airspeed": ("Airspeed", "m/s", "airspeed", "EKF2_TAS_GATE", 5.0),
}
# The fields of estimator_status, in all versions
_STATUS = {
    "vel_test_ratio": "Velocity",
    "pos_test_ratio": "Position",
    "hgt_test_ratio": "Height",
    "mag_test_ratio": "Magnetometer",
    "hdg_test_ratio": "Heading",
    "tas_test_ratio": "Airspeed",
    "hagl_test_ratio": "Height above ground",
    "beta_test_ratio": "Sideslip",
}
# ekf2_innovations, until PX4 1.10
_OLD = {
    "gnss_vel": ("vel_pos_innov", (0, 1, 2)),
    "gnss_pos": ("vel_pos_innov", (3, 4)),
    "baro_hgt": ("vel_pos_innov", (5,)),
    "mag": ("mag_innov", (0, 1, 2)),
    "heading": ("heading_innov", ()),
}


@dataclass(frozen=True, slots=True)
class Ratio:
    """One kind of measurement."""

    name: str
    time_s: Rows
    ratio: Rows  # the greatest of its axes
    source: str


@dataclass(frozen=True, slots=True)
class Innovation:
    """Measured minus expected, axis by axis."""

    key: str
    name: str
    unit: str
    time_s: Rows
    innov: Rows  # (rows, axes)
    std: Rows | None  # expected, (rows, axes)


def ratios(flight: LoggedFlight) -> list[Ratio]:
    """In the form that tells most, of those that were logged."""
    return _of_aid_sources(flight) or _logged(flight) or _of_status(flight) or _computed(flight)


def innovations(flight: LoggedFlight) -> list[Innovation]:
    """Those of estimator_innovations, or of ekf2_innovations, that ever were anything but 0."""
    topic, variances = flight.topic("estimator_innovations"), flight.topic("estimator_innovation_variances")
    found = []
    for key, (title, unit, fields, _, _) in _SOURCES.items():
        names = fields.split()
        if topic is not None:
            columns = topic.columns(*names)
            var = None if variances is None or len(variances) != len(topic) else variances.columns(*names)
            time_s = topic.time_s
        else:
            time_s, columns, var = _old_innovation(flight, key)
        if columns is not None and np.nanmax(np.abs(columns), initial=0.0) > 0.0:
            std = None if var is None else np.sqrt(np.maximum(var, 0.0))
            found.append(Innovation(key, title, unit, time_s, columns, std))
    return found


def _old_innovation(flight: LoggedFlight, key: str) -> tuple[Rows, Rows | None, Rows | None]:
    topic = flight.topic("ekf2_innovations")
    if topic is None or key not in _OLD:
        return np.zeros(0), None, None
    field, axes = _OLD[key]
    suffixes = [f"[{axis}]" for axis in axes] or [""]
    columns = topic.columns(*(f"{field}{suffix}" for suffix in suffixes))
    return topic.time_s, columns, topic.columns(*(f"{field}_var{suffix}" for suffix in suffixes))


def _of_aid_sources(flight: LoggedFlight) -> list[Ratio]:
    found = []
    for key, (title, *_) in _SOURCES.items():
        topic = flight.first(f"estimator_aid_src_{key}", f"estimator_aid_src_{key.replace('heading', 'mag_heading')}")
        if topic is None:
            continue
        count = topic.length("test_ratio")
        columns = topic.vector("test_ratio", count) if count else topic.columns("test_ratio")
        if columns is not None:
            found.append(_ratio(title, topic, columns, "estimator_aid_src_*"))
    return _alive(found)


def _logged(flight: LoggedFlight) -> list[Ratio]:
    topic = flight.topic("estimator_innovation_test_ratios")
    if topic is None:
        return []
    found = [
        _ratio(title, topic, columns, topic.name)
        for title, _, fields, _, _ in _SOURCES.values()
        if (columns := topic.columns(*fields.split())) is not None
    ]
    return _alive(found)


def _of_status(flight: LoggedFlight) -> list[Ratio]:
    topic = flight.topic("estimator_status")
    if topic is None:
        return []
    found = [
        _ratio(title, topic, topic[field][:, None], topic.name) for field, title in _STATUS.items() if field in topic
    ]
    return _alive(found)


def _computed(flight: LoggedFlight) -> list[Ratio]:
    found = []
    for each in innovations(flight):
        if each.std is None:
            continue
        *_, gate_name, default = _SOURCES[each.key]
        gate = flight.parameters.get(gate_name, default) or DEFAULT_GATE
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(each.std > 0.0, (each.innov / (gate * each.std)) ** 2, np.nan)
        found.append(Ratio(each.name, each.time_s, _greatest(ratio), "innovations and their variances"))
    return _alive(found)


def _ratio(title: str, topic: Topic, columns: Rows, source: str) -> Ratio:
    return Ratio(title, topic.time_s, _greatest(columns), source)


def _greatest(columns: Rows) -> Rows:
    """Of each row; NaN where there is none."""
    filled: Rows = np.where(np.isfinite(columns), columns, -np.inf).max(axis=1).astype(float)
    filled[~np.isfinite(filled)] = np.nan
    return filled


def _alive(found: list[Ratio]) -> list[Ratio]:
    """Those that ever were anything but 0: what is not fused is logged as 0."""
    return [each for each in found if np.nanmax(each.ratio, initial=0.0) > 0.0]
