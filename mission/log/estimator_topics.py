"""Topics of the estimator: innovations of all that it fuses, its second opinion of heading, wind and biases."""

from functools import partial

import numpy as np

from autopilot.estimator.sensor_spec import AidSpec
from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.estimator.yaw_estimator import CONVERGED_VAR
from common.kernels import YAW_MODELS
from mission.log.euler_angles import yaw_rad
from mission.log.topic import SAMPLED, Batch, Columns, Rows, Topic

_AIDS = (
    *(aid for sensor in FUSED_SENSORS for aid in sensor.aids),
    AidSpec("external_vel", 3, "m/s", {"ev_hvel": slice(0, 2), "ev_vvel": slice(2, 3)}),
    AidSpec("external_pos", 2, "m", {"ev_hpos": slice(0, 2)}),
    AidSpec("external_height", 1, "m", {"ev_vpos": slice(0, 1)}),
    AidSpec("external_yaw", 1, "rad", {"heading": slice(0, 1)}),
    AidSpec("drag", 2, "m/s²", {"drag": slice(0, 2)}),
)
_PX4_ORDER = (
    "gps_hvel gps_vvel gps_hpos gps_vpos ev_hvel ev_vvel ev_hpos ev_vpos heading baro_vpos rng_vpos mag_field drag"
).split()


def _innovation_axes() -> dict[str, tuple[str, slice]]:
    """Aid and axes of each field, in the order of PX4's message; what it does not have comes last."""
    found = {field: (aid.name, axes) for aid in _AIDS for field, axes in aid.logged.items()}
    order = [*_PX4_ORDER, *(field for field in found if field not in _PX4_ORDER)]
    return {field: found[field] for field in order}


_INNOVATION_AXES = _innovation_axes()


def _innovation_type(axes: slice) -> str:
    count = axes.stop - axes.start
    return "float" if count == 1 else f"float[{count}]"


INNOVATION_FIELDS = {**SAMPLED, **{field: _innovation_type(axes) for field, (_, axes) in _INNOVATION_AXES.items()}}


def _innovations(batch: Batch, part: str) -> Columns:
    health = batch.health
    columns: Columns = {"timestamp": batch.time_us, "timestamp_sample": health["horizon_time_us"]}
    for field, (aid, axes) in _INNOVATION_AXES.items():
        values = health[aid][part][:, axes]
        columns[field] = values[:, 0] if values.shape[1] == 1 else values
    return columns


def _wind(batch: Batch) -> Columns:
    wind = batch.estimate["wind_ned"]
    return {
        "timestamp": batch.time_us,
        "timestamp_sample": batch.estimate["time_us"],
        "windspeed_north": wind[:, 0],
        "windspeed_east": wind[:, 1],
    }


def _biases(batch: Batch) -> Columns:
    estimate = batch.estimate
    return {
        "timestamp": batch.time_us,
        "timestamp_sample": estimate["time_us"],
        "gyro_bias": estimate["gyro_bias_frd"],
        "accel_bias": estimate["accel_bias_frd"],
    }


def _has_yaw(batch: Batch) -> Rows:
    """One row per fix, and one at the start of each piece."""
    is_new: Rows = np.diff(batch.yaw["fix_time_us"], prepend=-1) != 0
    is_new[list(batch.begins)] = True
    return is_new


def _yaw_estimator(batch: Batch) -> Columns:
    is_new = _has_yaw(batch)
    rows = batch.yaw[is_new]
    heading = yaw_rad(rows["q_level_from_frd"])
    return {
        "timestamp": batch.time_us[is_new],
        "timestamp_sample": rows["fix_time_us"],
        "yaw_composite": _wrapped(rows["yaw_level"] + heading),
        "yaw_variance": rows["yaw_var"],
        "yaw_composite_valid": (rows["is_running"] != 0) & (rows["yaw_var"] < CONVERGED_VAR),
        "yaw": _wrapped(rows["yaw"] + heading[:, None]),
        "innov_vn": rows["innov_north"],
        "innov_ve": rows["innov_east"],
        "weight": rows["weight"],
    }


def _wrapped(angles: Rows) -> Rows:
    wrapped: Rows = np.arctan2(np.sin(angles), np.cos(angles))
    return wrapped


ESTIMATOR_TOPICS = (
    Topic("estimator_innovations", INNOVATION_FIELDS, partial(_innovations, part="innov")),
    Topic("estimator_innovation_variances", INNOVATION_FIELDS, partial(_innovations, part="innov_var")),
    Topic(
        "yaw_estimator_status",
        {
            **SAMPLED,
            **dict.fromkeys("yaw_composite yaw_variance".split(), "float"),
            "yaw_composite_valid": "bool",
            **dict.fromkeys("yaw innov_vn innov_ve weight".split(), f"float[{YAW_MODELS}]"),
        },
        _yaw_estimator,
        _has_yaw,
    ),
    Topic("wind", {**SAMPLED, "windspeed_north": "float", "windspeed_east": "float"}, _wind),
    Topic(
        "estimator_sensor_bias",
        {**SAMPLED, "gyro_bias": "float[3]", "accel_bias": "float[3]"},
        _biases,
    ),
)
