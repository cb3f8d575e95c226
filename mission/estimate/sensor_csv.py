"""Sensor CSV files as recordings: one line per sample, `time_us,sensor,v0,v1,...` (docs/how-to/estimate.md)."""

from math import isfinite
from pathlib import Path

import numpy as np

from mission.estimate.sensor_log import (
    BARO_DTYPE,
    FIX_DTYPE,
    IMU_DTYPE,
    MAG_DTYPE,
    RANGE_DTYPE,
    Recording,
    Rows,
    SensorLogError,
)

HEADER = "time_us,sensor"
VALUES = {
    "imu": "gx gy gz ax ay az".split(),
    "gnss": "lat_deg lon_deg alt_m vn ve vd eph epv sacc fix satellites".split(),
    "baro": "pressure_pa temperature_c".split(),
    "mag": "x y z".split(),
    "range": "distance_m".split(),
}
LIMITS = {"lat_deg": 90.0, "lon_deg": 180.0}

Line = tuple[int, list[float]]


def is_sensor_csv(start: bytes) -> bool:
    """The file begins with the header."""
    return start.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(HEADER.encode())


def read_csv(path: Path) -> Recording:
    """Reads a sensor CSV.

    Raises:
        SensorLogError: a line is wrong; its number is named.
    """
    lines: dict[str, list[Line]] = {name: [] for name in VALUES}
    try:
        with path.open(encoding="utf-8-sig") as stream:
            is_header_due = True
            for number, text in enumerate(stream, start=1):
                if not text.strip() or text.startswith("#"):
                    continue
                if is_header_due:
                    is_header_due = False
                    continue
                sensor, line = _parsed(text, f"{path}: line {number}")
                lines[sensor].append(line)
    except UnicodeDecodeError as error:
        raise SensorLogError(f"{path}: not a text file in UTF-8") from error
    if not lines["imu"]:
        raise SensorLogError(f"{path}: no IMU samples: no line names the sensor imu")
    return Recording(
        path=path,
        imu=_table(lines["imu"], IMU_DTYPE, {"gyro_frd": slice(0, 3), "accel_frd": slice(3, 6)}),
        fixes=_table(
            lines["gnss"],
            FIX_DTYPE,
            {
                "lat_deg": 0,
                "lon_deg": 1,
                "alt_m": 2,
                "vel_ned": slice(3, 6),
                "pos_h_std": 6,
                "pos_v_std": 7,
                "vel_std": 8,
                "fix_type": 9,
                "satellites": 10,
            },
        ),
        baro=_table(lines["baro"], BARO_DTYPE, {"pressure_pa": 0, "temperature_c": 1}),
        mag=_table(lines["mag"], MAG_DTYPE, {"field_frd_gauss": slice(0, 3)}),
        range=_ranges(lines["range"]),
    )


def _parsed(text: str, source: str) -> tuple[str, Line]:
    """Sensor, time and values of one line."""
    cells = [cell.strip() for cell in text.rstrip("\r\n").split(",")]
    sensor = cells[1] if len(cells) > 1 else ""
    if sensor not in VALUES:
        raise SensorLogError(f"{source}: sensor '{sensor}' is none of {', '.join(VALUES)}")
    try:
        time_us = int(cells[0])
    except ValueError:
        time_us = -1
    if not 0 <= time_us < 2**63:
        raise SensorLogError(f"{source}: time_us '{cells[0]}' is no whole number of microseconds from 0 on")
    names = VALUES[sensor]
    while len(cells) > 2 + len(names) and not cells[-1]:
        cells.pop()  # a spreadsheet pads its lines to the same number of columns
    if len(cells) != 2 + len(names):
        raise SensorLogError(f"{source}: {sensor} needs {len(names)} values ({', '.join(names)}), not {len(cells) - 2}")
    return sensor, (time_us, [_number(name, cell, source) for name, cell in zip(names, cells[2:], strict=True)])


def _number(name: str, cell: str, source: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise SensorLogError(f"{source}: {name} '{cell}' is no number") from None
    if name == "distance_m" and not isfinite(value):
        return -1.0  # no return
    if not isfinite(value) or abs(value) > LIMITS.get(name, 1e9):
        raise SensorLogError(f"{source}: {name} {cell} is out of range")
    return value


def _table(lines: list[Line], dtype: np.dtype[np.void], columns: dict[str, int | slice]) -> Rows:
    rows = np.zeros(len(lines), dtype=dtype)
    if lines:
        rows["time_us"] = [time_us for time_us, _ in lines]
        values = np.array([numbers for _, numbers in lines])
        for name, column in columns.items():
            rows[name] = values[:, column]
    return rows


def _ranges(lines: list[Line]) -> Rows:
    ranges = _table(lines, RANGE_DTYPE, {"distance_m": 0})
    ranges["is_valid"] = ranges["distance_m"] > 0.0
    return ranges
