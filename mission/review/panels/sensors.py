"""Battery, GNSS, magnetometer, heights: what the sensors told."""

import numpy as np

from mission.review.curves import Curve, Panel, Section, curves
from mission.review.logged_flight import LoggedFlight, Topic


def power(flight: LoggedFlight) -> Section:
    topic = flight.topic("battery_status")
    if topic is None:
        return Section("power", "Battery", (), ("no battery (topic battery_status)",))
    fields = (
        ("voltage", "Voltage", "V", ("voltage_v", "voltage_filtered_v"), 1.0),
        ("current", "Current", "A", ("current_a", "current_filtered_a"), 1.0),
        ("used", "Charge drawn", "mAh", ("discharged_mah",), 1.0),
        ("remaining", "Charge left", "%", ("remaining",), 100.0),
    )
    panels, missing = [], []
    for key, title, unit, names, scale in fields:
        values = topic.get(*names)
        if values is None or not np.isfinite(values).any() or np.nanmax(values) <= 0.0:
            missing.append(f"no {title.lower()}")
            continue
        lines = curves(topic.time_s, scale * values, [title.lower()])
        panels.append(Panel(key, title, unit, tuple(lines), least_span=1.0))
    return Section("power", "Battery", tuple(panels), tuple(missing))


def gnss_topic(flight: LoggedFlight) -> Topic | None:
    return flight.first("vehicle_gps_position", "sensor_gps")


def gnss(flight: LoggedFlight) -> Section:
    topic = gnss_topic(flight)
    if topic is None:
        return Section("gnss", "GNSS", (), ("no GNSS (topic vehicle_gps_position or sensor_gps)",))
    panels = []
    plots = (
        ("satellites", "Satellites and fix", "", (("satellites", "satellites_used"), ("fix type", "fix_type")), True),
        ("gnss_std", "Accuracy told by the receiver", "m", (("horizontal", "eph"), ("vertical", "epv")), False),
        ("gnss_noise", "Noise and jamming", "", (("noise", "noise_per_ms"), ("jamming", "jamming_indicator")), False),
    )
    for key, title, unit, names, is_step in plots:
        lines: list[Curve] = []
        for name, field in names:
            if field in topic and np.nanmax(topic[field], initial=0) > 0:
                lines += curves(topic.time_s, topic[field], [name], is_step=is_step)
        if lines:
            panels.append(Panel(key, title, unit, tuple(lines), starts_at_zero=True, least_span=1.0))
    return Section("gnss", "GNSS", tuple(panels))


def field_gauss(flight: LoggedFlight) -> tuple[Topic, np.ndarray] | None:
    """The magnetic field [gauss], (rows, 3)."""
    topic = flight.topic("vehicle_magnetometer")
    if topic is not None and (columns := topic.vector("magnetometer_ga", 3)) is not None:
        return topic, columns
    topic = flight.topic("sensor_mag")
    columns = None if topic is None else topic.columns("x", "y", "z")
    return None if topic is None or columns is None else (topic, columns)


def magnetometer(flight: LoggedFlight) -> Section:
    found = field_gauss(flight)
    if found is None:
        return Section("mag", "Magnetometer", (), ("no magnetic field (topic vehicle_magnetometer or sensor_mag)",))
    topic, columns = found
    strength = np.linalg.norm(columns, axis=1)
    lines = curves(topic.time_s, np.column_stack([columns, strength]), ("x", "y", "z", "strength"))
    return Section("mag", "Magnetometer", (Panel("mag", "Magnetic field", "gauss", tuple(lines), least_span=0.1),))


def heights(flight: LoggedFlight) -> Section:
    """Height above the origin by all that measures it."""
    lines: list[Curve] = []
    local = flight.topic("vehicle_local_position")
    if local is not None and "z" in local:
        lines += curves(local.time_s, -local["z"], ["estimate"])
    topic = gnss_topic(flight)
    alt = None if topic is None else topic.get("altitude_msl_m", "alt")
    if topic is not None and alt is not None:
        alt = 1e-3 * alt if alt.dtype.kind in "iu" else alt  # PX4's older logs: millimetres
        ref = None if local is None else local.get("ref_alt")
        start_m, name = (_first(alt), "GNSS, from its first") if ref is None else (_last(ref), "GNSS, above the origin")
        lines += curves(topic.time_s, alt - start_m, [name])
    baro = flight.topic("vehicle_air_data")
    if baro is not None and "baro_alt_meter" in baro:
        alt = baro["baro_alt_meter"]
        lines += curves(baro.time_s, alt - float(_first(alt)), ["barometer, from its first"])
    ranged = flight.topic("distance_sensor")
    if ranged is not None and "current_distance" in ranged:
        lines += curves(ranged.time_s, ranged["current_distance"], ["range finder"])
    if not lines:
        return Section("heights", "Height", (), ("no height",))
    return Section("heights", "Height", (Panel("heights", "Height", "m", tuple(lines), least_span=1.0),))


def _last(values: np.ndarray) -> float:
    return _first(values[::-1])


def _first(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite[0]) if len(finite) else 0.0
