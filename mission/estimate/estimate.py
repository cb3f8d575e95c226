"""`honeyguide estimate`: the estimator alone over the sensors of a recorded flight, real or simulated.

In: a PX4 ULog or a sensor CSV. Out: a folder with the estimate, innovations and biases as ULog and CSV, a summary and
images. Nothing is written before everything has been computed.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from math import isfinite, nan
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.table import Table

from common.clock import wall_time_s
from common.files import write_whole
from common.geodesy import GeoPoint, geodetic_from_ned
from common.logs.ulog import UlogWriter
from common.params import ParameterError, ParameterTable
from mission.console.option_checks import UserError, parameter_of
from mission.console.terminal import print_line
from mission.estimate.estimate_difference import Difference
from mission.estimate.estimate_noise import FoundNoise, found_noise
from mission.estimate.estimate_plots import plot_estimate, plot_innovations
from mission.estimate.estimate_run import (
    SOURCES,
    UNITS,
    Replay,
    estimator_table,
    load_kernels,
    run_estimator,
    time_s,
)
from mission.estimate.estimate_summary import EstimateSummary, summarise_replay
from mission.estimate.sensor_csv import HEADER, is_sensor_csv, read_csv
from mission.estimate.sensor_log import Recording, SensorLog, SensorLogError, prepare
from mission.estimate.sensor_ulog import MAGIC, read_ulog
from mission.log.euler_angles import euler_rad
from mission.log.log_topics import TOPICS
from mission.log.topic import Batch

LOGGED = (
    "vehicle_attitude vehicle_angular_velocity vehicle_local_position vehicle_global_position wind "
    "estimator_sensor_bias estimator_innovations estimator_innovation_variances"
).split()
CSV_EVERY = 5  # 50 Hz to 10 Hz
CSV_COLUMNS = (
    "time_us time_s lat_deg lon_deg alt_amsl_m north_m east_m down_m vel_n_m_s vel_e_m_s vel_d_m_s roll_deg pitch_deg "
    "yaw_deg gyro_bias_x_rad_s gyro_bias_y_rad_s gyro_bias_z_rad_s accel_bias_x_m_s2 accel_bias_y_m_s2 "
    "accel_bias_z_m_s2 pos_h_std_m pos_v_std_m vel_std_m_s tilt_std_deg yaw_std_deg flags"
).split()
CSV_FORMATS = ["%d", "%.3f", "%.8f", "%.8f", *["%.3f"] * 10, *["%.6f"] * 6, *["%.3f"] * 5, "%d"]


class EstimateError(ValueError):
    """Something about the log or the output folder is wrong; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Estimation:
    """The estimator's answer to a log."""

    sensors: SensorLog
    table: ParameterTable  # with which it ran
    replay: Replay
    noise: dict[str, FoundNoise]  # by source, empty for a log of this project
    taken_s: float


def estimate_log(
    log: Path,
    output: Path | None,
    console: Console,
    *,
    parameters: Sequence[str] = (),
    ignores_velocity_flag: bool = False,
) -> None:
    """Runs the estimator over a log and writes the results into a new or empty folder.

    Args:
        log: a PX4 ULog or a sensor CSV.
        output: folder for the results; None: NAME-estimate beside the log.
        console: for progress and the summary.
        parameters: of the estimator, each NAME=VALUE.
        ignores_velocity_flag: GNSS velocities count as valid though the receiver says they are not.

    Raises:
        EstimateError: the log, a parameter or the folder cannot be used; no file has been written.
    """
    folder = output if output is not None else log.with_name(f"{log.stem}-estimate")
    _check_folder(folder)
    given = dict(_parameter(text) for text in parameters)
    columns = (TextColumn("estimating"), BarColumn(), TaskProgressColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=None)

        def show(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        estimation = run_log(log, given, show, ignores_velocity_flag=ignores_velocity_flag)
    sensors, table = estimation.sensors, estimation.table
    parameter_values = {name: float(table[name]) for name in table}
    summary = summarise_replay(sensors, estimation.replay, estimation.noise, parameter_values)
    _write(folder, estimation, summary)
    _show(summary, folder, estimation.taken_s, console)


def run_log(
    log: Path,
    given: Mapping[str, float],
    progress: Callable[[int, int], None],
    *,
    ignores_velocity_flag: bool = False,
) -> Estimation:
    """Runs the estimator over a log.

    Args:
        log: a PX4 ULog or a sensor CSV.
        given: parameters of the estimator.
        progress: called with the number of IMU samples done and to do.
        ignores_velocity_flag: GNSS velocities count as valid though the receiver says they are not.

    Raises:
        EstimateError: the log or a parameter cannot be used.
    """
    try:
        recording = _read(log, ignores_velocity_flag)
        table = estimator_table(recording, given)
        sensors = prepare(recording, table)
    except (SensorLogError, ParameterError) as error:
        raise EstimateError(str(error)) from error
    load_kernels()
    started_s = wall_time_s()
    done = 0

    def add(count: int) -> None:
        nonlocal done
        done += count
        progress(done, len(sensors.imu))

    replay = run_estimator(sensors, table, add)
    if not len(replay.output):
        raise EstimateError(f"{log}: {sensors.duration_s:.1f} s are too short for the estimator to find its attitude")
    taken_s = wall_time_s() - started_s
    return Estimation(sensors, table, replay, {} if recording.is_own else found_noise(replay), taken_s)


def _parameter(text: str) -> tuple[str, float]:
    try:
        return parameter_of(text)
    except UserError as error:
        raise EstimateError(str(error)) from error


def _check_folder(folder: Path) -> None:
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise EstimateError(f"{folder}: already exists and is not an empty folder; name another with --output")
    except OSError as error:
        raise EstimateError(f"{folder}: {error.strerror}") from error


def _read(log: Path, ignores_velocity_flag: bool) -> Recording:
    try:
        with log.open("rb") as stream:
            start = stream.read(256)
        if start.startswith(MAGIC):
            return read_ulog(log, ignores_velocity_flag=ignores_velocity_flag)
        if is_sensor_csv(start):
            return read_csv(log)
    except OSError as error:
        raise EstimateError(f"{log}: {error.strerror}") from error
    raise EstimateError(f"{log}: neither a ULog nor a sensor CSV, whose first line begins with {HEADER}")


def _write(folder: Path, estimation: Estimation, summary: EstimateSummary) -> None:
    log, replay = estimation.sensors, estimation.replay
    files = {
        "estimate.ulg": _ulog(log, replay, summary),
        "estimate.csv": _csv(log, replay),
        "summary.json": (json.dumps(summary.as_json(), indent=2) + "\n").encode(),
        "estimate.png": plot_estimate(log, replay),
        "innovations.png": plot_innovations(log, replay, estimation.noise),
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            write_whole(folder / name, content)
    except OSError as error:
        raise EstimateError(f"{folder}: {error.strerror}") from error


def _ulog(log: SensorLog, replay: Replay, summary: EstimateSummary) -> bytes:
    """The estimate under PX4's topic names, with the times of the log."""
    output = replay.output
    batch = Batch(
        time_us=output["estimate"]["time_us"],
        estimate=output["estimate"],
        samples=output[:0],
        samples_before=output[:0],
        actuators=output[:0],
        health=output,
        yaw=output[:0],
        truth=output[:0],
        vehicle=output[:0],
        origin=log.origin or GeoPoint(nan, nan, nan),
    )
    stream = BytesIO()
    info = {"sys_name": "Honeyguide estimate", "replay": log.recording.path.name}
    with UlogWriter(stream, int(log.imu["time_us"][0]), info, summary.parameters) as writer:
        topics = [topic for topic in TOPICS if topic.name in LOGGED]
        if log.origin is None:
            topics = [topic for topic in topics if topic.name != "vehicle_global_position"]
        logged = [(writer.add_topic(topic.name, topic.fields), topic.columns(batch)) for topic in topics]
        for ulog_topic, columns in logged:
            ulog_topic.write(columns)
    return stream.getvalue()


def _csv(log: SensorLog, replay: Replay) -> bytes:
    """The estimate and the biases at 10 Hz."""
    estimate = replay.estimate[::CSV_EVERY]
    pos_ned = estimate["pos_ned"].astype(float)
    places = np.full(pos_ned.shape, nan)
    if log.origin is not None:
        places = np.array([geodetic_from_ned(north, east, down, log.origin) for north, east, down in pos_ned.tolist()])
    stds = ("pos_h_std", "pos_v_std", "vel_std")
    columns = np.column_stack(
        [
            estimate["time_us"],
            time_s(log, estimate["time_us"]),
            places,
            pos_ned,
            estimate["vel_ned"],
            np.degrees(euler_rad(estimate["q_ned_from_frd"])),
            estimate["gyro_bias_frd"],
            estimate["accel_bias_frd"],
            *(estimate[name] for name in stds),
            np.degrees(estimate["tilt_std"]),
            np.degrees(estimate["yaw_std"]),
            estimate["flags"],
        ]
    )
    stream = BytesIO()
    np.savetxt(stream, columns, fmt=CSV_FORMATS, delimiter=",", header=",".join(CSV_COLUMNS), comments="")
    return stream.getvalue()


def _show(summary: EstimateSummary, folder: Path, taken_s: float, console: Console) -> None:
    table = Table(title=f"{summary.log}: {summary.duration_s:.1f} s, estimated in {taken_s:.1f} s")
    table.add_column("source")
    for column in ("judged", "fused", "rejected", "resets", "noise found", "in 95 %"):
        table.add_column(column, justify="right", no_wrap=True)
    for name in SOURCES:
        source = summary.sources[name]
        if source.judged:
            counts = (source.judged, source.fused, source.rejected, source.resets)
            noise = f"{source.noise_found:.2g} {UNITS[name]}" if isfinite(source.noise_found) else ""
            band = f"{100.0 * source.in_band:.1f} %" if isfinite(source.in_band) else ""
            table.add_row(name, *map(str, counts), noise, band)
    console.print(table)
    gyro = ", ".join(f"{value:.5f}" for value in summary.final_gyro_bias_frd_rad_s)
    accel = ", ".join(f"{value:.4f}" for value in summary.final_accel_bias_frd_m_s2)
    console.print(f"biases at the end: gyro {gyro} rad/s, accelerometer {accel} m/s²", highlight=False)
    for name, other in summary.differences.items():
        if other.no_position == other.no_attitude != "":
            print_line(console, f"not compared with the {name}: {other.no_position}")
            continue
        print_line(console, f"difference to the {name}, median (rms):")
        print_line(console, f"  {_motion(other)}")
        print_line(console, f"  {_attitude(other)}")
    for note in summary.notes:
        print_line(console, f"note: {note}")
    print_line(console, f"results in {folder}")


def _motion(other: Difference) -> str:
    if other.no_position:
        return f"position and velocity not compared: {other.no_position}"
    near, rms = other.median, other.rms
    return (
        f"position {near.pos_n_m:.2f}, {near.pos_e_m:.2f}, {near.pos_d_m:.2f} "
        f"({rms.pos_n_m:.2f}, {rms.pos_e_m:.2f}, {rms.pos_d_m:.2f}) m, "
        f"velocity {near.vel_n_m_s:.2f}, {near.vel_e_m_s:.2f}, {near.vel_d_m_s:.2f} "
        f"({rms.vel_n_m_s:.2f}, {rms.vel_e_m_s:.2f}, {rms.vel_d_m_s:.2f}) m/s"
    )


def _attitude(other: Difference) -> str:
    if other.no_attitude:
        return f"attitude not compared: {other.no_attitude}"
    near, rms = other.median, other.rms
    return f"tilt {near.tilt_deg:.2f} ({rms.tilt_deg:.2f}) deg, yaw {near.yaw_deg:.2f} ({rms.yaw_deg:.2f}) deg"
