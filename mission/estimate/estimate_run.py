"""The estimator alone, over recorded samples: the flight controller's own kernel, launched over many ticks at a time.

In: a `SensorLog`. Out: the estimate at 50 Hz, and every innovation of every source.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from autopilot.advance import estimate_samples
from autopilot.estimator.ekf import make_ekf, reset_rows
from autopilot.estimator.params import ESTIMATOR_PARAMETERS, estimator_params
from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.estimator.state import PHASE_RUNNING, EstimatorState
from autopilot.estimator.wheel_params import WHEEL_PARAMETERS
from autopilot.ports import Estimate, Samples
from common.geomagnetic import field_ned_gauss
from common.params import ParameterTable
from common.warp_start import start_warp
from mission.estimate.sensor_log import Recording, Rows, SensorLog, row_dtype

CHUNK_TICKS = 1000
OUTPUT_PERIOD_US = 20_000
_AIDS = tuple(aid for sensor in FUSED_SENSORS for aid in sensor.aids)
SOURCES = {**{aid.name: aid.axes for aid in _AIDS}, "drag": 2, "rest": 3}
UNITS = {**{aid.name: aid.unit for aid in _AIDS}, "drag": "m/s²", "rest": "m/s"}
UNHEARD = (
    "external_pos",
    "external_height",
    "external_vel",
    "external_yaw",
)  # recordings hold none of it; logs name it

# The defaults describe this project's simulated sensors. What differs for real ones, of which nothing is known:
REAL_SENSORS: dict[str, float] = {
    "EKF2_DRAG_CTRL": 0,  # the drag of the airframe is not known
    # PX4's 0.015 rad/s and 0.35 m/s² at its steps of 10 ms; ours are those of 4 ms
    "EKF2_GYR_NOISE": 0.024,
    "EKF2_ACC_NOISE": 0.55,
    "EKF2_GYR_B_NOISE": 1.0e-4,  # PX4's 1e-3 rad/s², as a random walk at its 10 ms steps
    "EKF2_GBIAS_INIT": 0.1,  # PX4 default
    # PX4 has 0.2, which lets touchdowns and turns in the air be taken for a bias: tilt beside EKF2 is twice as far off
    "EKF2_ABIAS_INIT": 0.05,
    "EKF2_GPS_P_NOISE": 0.5,  # PX4 default
    "EKF2_GPS_V_NOISE": 0.3,  # PX4 default
    "EKF2_REQ_EPH": 10.0,  # guess: the noise grows with the receiver's own figures, so worse fixes are of use too
    "EKF2_REQ_EPV": 15.0,
    "EKF2_REQ_SACC": 2.0,
    "EKF2_BARO_NOISE": 1.0,  # guess: propeller wash; PX4 has 3.5
    "EKF2_BARO_WALK": 0.1,  # guess
    "EKF2_MAG_CHECK": 0,  # of old simulators' logs the field is not Earth's, and sound all the same
    "EKF2_MAG_NOISE": 0.05,  # PX4 default
    "EKF2_MAG_E_NOISE": 1.0e-4,  # PX4's 1e-3 gauss/s, as a random walk at its 10 ms steps
    "EKF2_MAG_B_NOISE": 1.0e-5,  # PX4's 1e-4 gauss/s, likewise
    "EKF2_MAG_B_INIT": 0.03,  # guess: what a field calibration leaves
    "EKF2_MIN_RNG": 0.0,  # the origin is where the receiver stands
    "EKF2_RNG_NOISE": 0.1,  # PX4 default
    "EKF2_RNG_SFE": 0.05,  # PX4 default
    "EKF2_TERR_GRAD": 0.5,  # PX4 default
}

AID_DTYPE = np.dtype([("innov", "<f4", (3,)), ("innov_var", "<f4", (3,))])
OUTPUT_DTYPE = np.dtype(
    [
        ("estimate", row_dtype(Estimate)),
        ("horizon_time_us", "<i8"),
        ("body_field_frd", "<f4", (3,)),
        *((name, AID_DTYPE) for name in (*SOURCES, *UNHEARD)),
    ]
)
EVENT_DTYPE = np.dtype(
    [("time_us", "<i8"), ("innov", "<f4", (3,)), ("innov_var", "<f4", (3,)), ("is_fused", "?"), ("is_reset", "?")]
)


@dataclass(frozen=True, slots=True)
class Replay:
    """What the estimator answered."""

    output: Rows  # OUTPUT_DTYPE, every 20 ms once aligned
    events: dict[str, Rows]  # EVENT_DTYPE per source: every sample whose innovation was judged
    fault_count: int  # times the covariance lost its shape

    @property
    def estimate(self) -> Rows:
        estimate: Rows = self.output["estimate"]
        return estimate


def estimator_table(recording: Recording, given: Mapping[str, float]) -> ParameterTable:
    """The parameters for a log: its own if this project wrote it, else our defaults with the noise of real sensors.

    Args:
        recording: the log.
        given: parameters that the user sets.

    Raises:
        ParameterError: there is none of a given name, or it cannot have that value.
    """
    has_wheels = len(recording.others.get("wheels", ())) > 0
    table = ParameterTable([*ESTIMATOR_PARAMETERS, *(WHEEL_PARAMETERS if has_wheels else ())])
    for name, value in (recording.parameters if recording.is_own else REAL_SENSORS).items():
        if name in table:
            table.set(name, value)
    for name, value in given.items():
        table.set_exactly(name, value)
    if "EKF2_DELAY_MAX" in given:
        return table
    # The horizon lies behind the latest sensor's delay by one sample of a slow IMU.
    table.set("EKF2_DELAY_MAX", max(table["EKF2_DELAY_MAX"], recording.gnss_delay_s * 1e3 + 20.0))
    return table


def load_kernels() -> None:
    """Compiles what the cache lacks, so that it is not taken for the estimator's own time."""
    start_warp()
    wp.load_module(estimate_samples.module, device="cpu")
    wp.load_module(reset_rows.module, device="cpu")


def run_estimator(log: SensorLog, table: ParameterTable, progress: Callable[[int], None]) -> Replay:
    """Runs the estimator over a log.

    Args:
        log: prepared samples.
        table: the estimator's parameters.
        progress: called with the number of IMU samples done since its last call.
    """
    field = (0.0, 0.0, 0.0)
    if log.origin is not None:
        north, east, down = field_ned_gauss(log.origin.lat_deg, log.origin.lon_deg, log.origin.alt_m).tolist()
        field = (north, east, down)
    ekf = make_ekf(1, "cpu", estimator_params(table, field))
    samples = wp.zeros((1, CHUNK_TICKS), dtype=Samples, device="cpu")
    states = wp.zeros((1, CHUNK_TICKS), dtype=EstimatorState, device="cpu")
    samples_view, states_view = samples.numpy()[0], states.numpy()[0]
    collector = _Collector()
    fault_count = 0
    for first, end in log.stretches:
        wp.launch(reset_rows, dim=1, inputs=[ekf], device="cpu")
        collector.restart()
        deliver = _Delivery(log, first)
        for start in range(first, end, CHUNK_TICKS):
            imu = log.imu[start : min(end, start + CHUNK_TICKS)]
            deliver.fill(samples_view[: len(imu)], imu)
            wp.launch(estimate_samples, dim=1, inputs=[ekf, samples, states, len(imu)], device="cpu")
            collector.take(states_view[: len(imu)])
            progress(len(imu))
        fault_count += int(ekf.rows.numpy()["fault_count"][0])
    return collector.replay(fault_count)


class _Delivery:
    """Hands each tick the latest sample of every sensor that was valid by then."""

    def __init__(self, log: SensorLog, first: int) -> None:
        start_us = log.imu["time_us"][first]
        self._rows: dict[str, Rows] = {}
        for sensor in FUSED_SENSORS:
            rows = log.samples_of(sensor)
            rows = rows[rows["time_us"] >= start_us]
            self._rows[sensor.name] = np.concatenate([rows, np.zeros(1, dtype=rows.dtype)])  # the last one: none yet

    def fill(self, samples: Rows, imu: Rows) -> None:
        samples["imu"] = imu
        for name, rows in self._rows.items():
            latest = np.searchsorted(rows["time_us"][:-1], imu["time_us"], side="right") - 1
            samples[name] = rows[latest]


class _Collector:
    """Picks from the states after each tick what is kept."""

    def __init__(self) -> None:
        self._output: list[Rows] = []
        self._events: dict[str, list[Rows]] = {name: [np.zeros(0, dtype=EVENT_DTYPE)] for name in SOURCES}
        self._before: Rows = np.zeros(1, dtype=row_dtype(EstimatorState))

    def restart(self) -> None:
        self._before = np.zeros_like(self._before)

    def take(self, states: Rows) -> None:
        """Keeps what is new in the states of consecutive ticks."""
        is_running = (states["phase"] == PHASE_RUNNING) & (states["estimate"]["tilt_std"] > 0.0)
        slots = np.concatenate([self._before["time_us"], states["time_us"]]) // OUTPUT_PERIOD_US
        chosen = states[is_running & (np.diff(slots) > 0)]
        output = np.zeros(len(chosen), dtype=OUTPUT_DTYPE)
        output["estimate"] = chosen["estimate"]
        output["horizon_time_us"] = chosen["horizon_time_us"]
        output["body_field_frd"] = chosen["nominal"]["body_field_frd"]
        for name, events in self._events.items():
            for part in ("innov", "innov_var"):
                output[name][part] = chosen[name][part]
            events.append(_events(self._before[name], states[name]))
        self._output.append(output)
        self._before = states[-1:].copy()

    def replay(self, fault_count: int) -> Replay:
        events = {name: np.concatenate(parts) for name, parts in self._events.items()}
        return Replay(np.concatenate(self._output), events, fault_count)


def _events(before: Rows, aids: Rows) -> Rows:
    """The ticks in which a source judged a sample."""
    judged = np.concatenate([before["judged_time_us"], aids["judged_time_us"]])
    resets = np.concatenate([before["reset_count"], aids["reset_count"]])
    # A source that starts without an innovation notes the time of that sample, and no variance.
    is_new = (np.diff(judged) != 0) & (aids["innov_var"][:, 0] > 0.0)
    chosen = aids[is_new]
    events = np.zeros(len(chosen), dtype=EVENT_DTYPE)
    events["time_us"] = chosen["judged_time_us"]
    events["innov"], events["innov_var"] = chosen["innov"], chosen["innov_var"]
    events["is_reset"] = np.diff(resets)[is_new] > 0
    events["is_fused"] = (chosen["fused_time_us"] == chosen["judged_time_us"]) & ~events["is_reset"]
    return events


def time_s(log: SensorLog, time_us: Any) -> Any:
    """Seconds since the first IMU sample."""
    return (time_us - log.imu["time_us"][0]) * 1e-6
