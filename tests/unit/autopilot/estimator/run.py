"""Runs the estimator over recorded samples and keeps what it answered at each tick."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from autopilot.estimator.ekf import Ekf, estimator_reset, estimator_step, make_ekf
from autopilot.estimator.params import ESTIMATOR_PARAMETERS, estimator_params
from autopilot.estimator.state import EstimatorState
from autopilot.estimator.wheel_params import WHEEL_PARAMETERS
from autopilot.ports import CONTACT_UNKNOWN, ExternalSample, Samples
from common.params import ParameterTable
from tests.unit.autopilot.estimator.flights import (
    FIELD_NED_GAUSS,
    Flight,
    quat_conjugate,
    quat_multiply,
    rotvec_from_quat,
)

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def run_samples(
    ekf: Ekf,
    samples: wp.array2d(dtype=Samples),
    external: wp.array2d(dtype=ExternalSample),
    contact: int,
    trace: wp.array2d(dtype=EstimatorState),
):
    i = wp.tid()
    for k in range(samples.shape[1]):
        if k < external.shape[1]:
            ekf.external[i] = external[i, k]
        estimator_step(ekf, i, samples[i, k], contact)
        if k < trace.shape[1]:
            trace[i, k] = ekf.rows[i]


@wp.kernel(enable_backward=False)
def reset_one(ekf: Ekf, chosen: int):
    estimator_reset(ekf, chosen)


def default_ekf(vehicle_count: int = 1, **changes: float) -> Ekf:
    """Estimators at power-on in the field of the flights, on vehicles without legs, with some parameters changed."""
    table = ParameterTable([*ESTIMATOR_PARAMETERS, *WHEEL_PARAMETERS])
    table.set("EKF2_MIN_RNG", 0.0)
    for name, value in changes.items():
        table.set(name, value)
    return make_ekf(vehicle_count, "cpu", estimator_params(table, FIELD_NED_GAUSS))


def run(
    ekf: Ekf, samples: Any, *, external: Any = None, contact: int = CONTACT_UNKNOWN, keep_trace: bool = True
) -> Any:
    """The states after each tick, shape (vehicles, ticks), for samples of that shape (or of one vehicle)."""
    rows = np.atleast_2d(samples)
    trace = wp.zeros((rows.shape[0], rows.shape[1] if keep_trace else 0), dtype=EstimatorState, device="cpu")
    device_samples = wp.array(rows, dtype=Samples, device="cpu")
    held = np.zeros((rows.shape[0], 0), ExternalSample.numpy_dtype()) if external is None else np.atleast_2d(external)
    device_external = wp.array(held, dtype=ExternalSample, device="cpu")
    inputs = [ekf, device_samples, device_external, contact, trace]
    wp.launch(run_samples, rows.shape[0], inputs=inputs, device="cpu")
    return trace.numpy()


@dataclass
class Errors:
    """Estimate minus truth at each tick."""

    pos: Any
    vel: Any
    tilt_deg: Any
    yaw_deg: Any


def errors(flight: Flight, trace: Any) -> Errors:
    """Errors of one vehicle's trace."""
    estimate = trace["estimate"]
    turn = rotvec_from_quat(quat_multiply(estimate["q_ned_from_frd"].astype(float), quat_conjugate(flight.q)))
    return Errors(
        estimate["pos_ned"] - flight.pos_ned,
        estimate["vel_ned"] - flight.vel_ned,
        np.degrees(np.hypot(turn[:, 0], turn[:, 1])),
        np.degrees(turn[:, 2]),
    )


def rms(values: Any) -> Any:
    """Root mean square over the first axis."""
    return np.sqrt(np.mean(np.square(values), axis=0))


def share_in_band(trace: Any, aid: str, components: int, from_tick: int) -> Any:
    """Share of normalised innovations inside ±1.96 per component, over the samples judged after `from_tick`."""
    column = trace[aid][from_tick:]
    is_new = np.flatnonzero(np.diff(column["judged_time_us"]) > 0) + 1
    ratio = column["innov"][is_new, :components] ** 2 / column["innov_var"][is_new, :components]
    return np.mean(ratio < 1.96**2, axis=0)


def fields(row: Any, prefix: str = "") -> dict[str, Any]:
    """The leaves of a structured row by name: rows hold padding, so their bytes cannot be compared."""
    leaves: dict[str, Any] = {}
    for name in row.dtype.names:
        if row[name].dtype.names:
            leaves |= fields(row[name], f"{prefix}{name}.")
        else:
            leaves[prefix + name] = np.array(row[name])
    return leaves


def assert_same(row: Any, other: Any) -> None:
    """Every field has the same bits."""
    found = fields(other)
    for name, value in fields(row).items():
        np.testing.assert_array_equal(value, found[name], err_msg=name)
