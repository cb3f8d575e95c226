"""`python -m bench.estimate FOLDER`: how far `honeyguide estimate` lies from EKF2, over a folder of recorded flights.

In: each NAME.ulg of the folder and, where there is one, NAME.ekf2.csv: what PX4's EKF2 makes of the same samples
(docs/how-to/estimate.md has its columns). Out: median and largest difference of tilt, yaw, velocity and position from
10 s on, and whether they are inside the band in which EKF2 agrees with its own past; the vehicle's own estimate beside
both.
"""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table
from rich.text import Text

from autopilot.ports import Estimate
from mission.estimate.estimate import EstimateError, Estimation, run_log
from mission.estimate.estimate_difference import Difference, difference
from mission.estimate.estimate_noise import in_flight, median_spread
from mission.estimate.estimate_run import SOURCES
from mission.estimate.sensor_log import Rows, Track, row_dtype

SETTLE_US = 10_000_000  # from the first sample on
# EKF2 of 2026 beside that of 2023 over the same real flights: median and largest
BAND = {"tilt_deg": (0.15, 0.33), "yaw_deg": (0.70, 1.46), "vel_m_s": (0.024, 0.10)}
QUANTITIES = {"tilt_deg": "tilt [deg]", "yaw_deg": "yaw [deg]", "vel_m_s": "velocity [m/s]", "pos_m": "position [m]"}
WIDTH = 160  # however narrow the terminal is: lines are not cut in files
EKF2_COLUMNS = ("time_us", "qw", "qx", "qy", "qz", "vn", "ve", "vd", "pn", "pe", "pd")


@dataclass(frozen=True, slots=True)
class Compared:
    """Two answers to one log."""

    log: str
    answer: str
    other: str
    difference: Difference

    def cell(self, quantity: str) -> str:
        """Median and largest difference, and whether both, the median alone or none is inside the band."""
        median, largest = getattr(self.difference.median, quantity), getattr(self.difference.largest, quantity)
        if np.isnan(median):
            return "-"
        return f"{median:.3f} / {largest:.2f}{_verdict(median, largest, quantity)}"


def _verdict(median: float, largest: float, quantity: str) -> str:
    if quantity not in BAND:
        return ""
    most_median, most_largest = BAND[quantity]
    if median > most_median:
        return " out"
    return " in" if largest <= most_largest else " median in"


def read_ekf2(path: Path) -> Track:
    """EKF2's answer, from when its heading is aligned; its positions count from its own origin.

    Raises:
        EstimateError: the file cannot be read or lacks a column.
    """
    try:
        table = np.atleast_1d(np.genfromtxt(path, delimiter=",", names=True))
    except (OSError, ValueError) as error:
        raise EstimateError(f"{path}: cannot be read as a table of numbers") from error
    names = table.dtype.names or ()
    missing = [name for name in EKF2_COLUMNS if name not in names]
    if missing:
        raise EstimateError(f"{path}: no column {missing[0]}")
    if "yaw_aligned" in names:
        table = table[table["yaw_aligned"] == 1]
    times = table["time_us"].astype(np.int64)
    pos_ned, vel_ned, q = (
        np.stack([table[name] for name in group.split()], axis=1) for group in ("pn pe pd", "vn ve vd", "qx qy qz qw")
    )
    return Track("EKF2", None, times, pos_ned, vel_ned, times, q)


def compare(log: Path, estimation: Estimation) -> list[Compared]:
    """Our answer beside EKF2's and the log's own, and EKF2's beside the log's own.

    Raises:
        EstimateError: EKF2's answer cannot be used.
    """
    sensors = estimation.sensors
    start_us = int(sensors.imu["time_us"][0]) + SETTLE_US
    path = log.with_suffix(".ekf2.csv")
    ekf2 = [_from(read_ekf2(path), start_us)] if path.exists() else []
    own = [_from(track, start_us) for track in sensors.recording.tracks]
    answers = [("ours", estimation.replay.estimate, [*ekf2, *own])]
    answers += [("EKF2", _as_estimate(track), own) for track in ekf2]
    return [
        Compared(log.stem, name, other.name, difference(rows, other, sensors.origin, own_origins=True))
        for name, rows, others in answers
        for other in others
    ]


def spreads(estimation: Estimation) -> dict[str, float]:
    """The spread of normalised innovations in flight over the noise found, by source: 1 if they are normal."""
    found = {}
    for name, noise in estimation.noise.items():
        events, components = in_flight(estimation.replay, name), SOURCES[name]
        normalised = events["innov"][:, :components] / np.sqrt(events["innov_var"][:, :components])
        found[name] = median_spread(normalised) / noise.scale
    return found


def _from(track: Track, start_us: int) -> Track:
    is_late, q_is_late = track.pos_time_us >= start_us, track.q_time_us >= start_us
    return replace(
        track,
        pos_time_us=track.pos_time_us[is_late],
        pos_ned=track.pos_ned[is_late],
        vel_ned=track.vel_ned[is_late],
        q_time_us=track.q_time_us[q_is_late],
        q_ned_from_frd=track.q_ned_from_frd[q_is_late],
    )


def _as_estimate(track: Track) -> Rows:
    rows = np.zeros(len(track.pos_time_us), dtype=row_dtype(Estimate))
    rows["time_us"], rows["flags"] = track.pos_time_us, -1  # every flag: it was asked for its valid rows
    rows["pos_ned"], rows["vel_ned"], rows["q_ned_from_frd"] = track.pos_ned, track.vel_ned, track.q_ned_from_frd
    return rows


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.estimate", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="of NAME.ulg and NAME.ekf2.csv")
    parser.add_argument(
        "--ignore-velocity-flag", action="store_true", help="use GNSS velocities that the receiver calls invalid, too"
    )
    given = parser.parse_args(arguments)
    logs = sorted(given.folder.glob("*.ulg"))
    if not logs:
        print(f"bench.estimate: {given.folder}: no .ulg file in it", file=sys.stderr)
        return 2
    console = Console(highlight=False, width=WIDTH)
    table = Table(title="median / largest difference after 10 s", title_justify="left", box=SIMPLE)
    for heading in ("log", "answer", "beside", *QUANTITIES.values()):
        table.add_column(Text(heading), no_wrap=True)
    innovations = Table(
        title="noise found in flight, and spread of the innovations over it", title_justify="left", box=SIMPLE
    )
    for heading in ("log", *SOURCES):
        innovations.add_column(heading, no_wrap=True)
    try:
        for log in logs:
            estimation = run_log(log, {}, lambda _done, _all: None, ignores_velocity_flag=given.ignore_velocity_flag)
            for row in compare(log, estimation):
                table.add_row(row.log, row.answer, row.other, *map(row.cell, QUANTITIES))
            spread = spreads(estimation)
            cells = [
                f"{estimation.noise[name].std:.2g}, {spread[name]:.2f}" if name in spread else "" for name in SOURCES
            ]
            innovations.add_row(log.stem, *cells)
    except EstimateError as error:
        print(f"bench.estimate: {error}", file=sys.stderr)
        return 2
    console.print(table)
    band = ", ".join(f"{QUANTITIES[name]} {median:g} / {largest:g}" for name, (median, largest) in BAND.items())
    console.print(f"EKF2 beside its own past: {band}", markup=False)
    console.print(innovations)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
