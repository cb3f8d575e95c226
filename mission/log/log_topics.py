"""The flight log's topics: PX4's names and fields, filled from rows of the kernel structs.

Each builder turns a batch of rows, one per 20 ms frame, into the columns of one topic. Quaternions leave as
(w, x, y, z). A sensor's rows are those frames in which a new sample had arrived. PX4's fields that could only ever
hold one value here are left out.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.estimator.yaw_estimator import CONVERGED_VAR
from autopilot.ports import HEIGHT_VALID, POSITION_VALID, TERRAIN_VALID, VELOCITY_VALID
from common.geodesy import GeoPoint, geodetic_from_ned
from common.kernels import YAW_MODELS
from mission.log.euler_angles import wxyz, yaw_rad
from sim.sensors.range import MAX_DISTANCE_M, MIN_DISTANCE_M

Rows = npt.NDArray[Any]
Columns = dict[str, npt.ArrayLike]

FIX_3D = 3  # fix_type
LASER = 0  # distance_sensor.type
FACING_DOWN = 25  # distance_sensor.orientation


@dataclass(frozen=True, slots=True)
class Batch:
    """Rows of some consecutive frames."""

    time_us: Rows  # (frames,)
    estimate: Rows  # Estimate
    samples: Rows  # Samples
    samples_before: Rows  # Samples of the frame before the first, one row
    actuators: Rows  # Actuators
    health: Rows  # EstimatorState
    yaw: Rows  # YawEstimator
    truth: Rows  # Truth
    vehicle: Rows  # STATUS_DTYPE of mission.log.flight_log
    origin: GeoPoint
    shown: Rows | None = None  # SHOWN of mission.log.replay_topic, in flights that are to be replayed
    begins: tuple[int, ...] = (0,)  # the log gets the frames in pieces: where each of them begins

    def only(self, frames: Rows | slice, samples_before: Rows) -> "Batch":
        """Some of the frames; `samples_before` as of the frame before the first of them."""
        names = ("time_us", "estimate", "samples", "actuators", "health", "yaw", "truth", "vehicle")
        rows = {name: getattr(self, name)[frames] for name in names}
        shown = None if self.shown is None else self.shown[frames]
        return replace(self, samples_before=samples_before, shown=shown, **rows)


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic: its ULog fields and how a batch fills them."""

    name: str
    fields: dict[str, str]
    columns: Callable[[Batch], Columns]
    frames: Callable[[Batch], Rows] | None = None  # marks those that have a row; None: all have


def is_fresh(batch: Batch, sensor: str) -> Rows:
    """The frames in which a sample of this sensor is new: its time differs from the frame before and is not 0."""
    times = batch.samples[sensor]["time_us"]
    times_before = np.concatenate([batch.samples_before[sensor]["time_us"], times[:-1]])
    new: Rows = (times != times_before) & (times > 0)
    return new


def fresh(batch: Batch, sensor: str) -> Rows:
    """The new samples of a sensor."""
    rows: Rows = batch.samples[sensor][is_fresh(batch, sensor)]
    return rows


def _axes(names: str, vectors: Rows) -> Columns:
    return dict(zip(names.split(), vectors.T, strict=True))


def _attitude(batch: Batch) -> Columns:
    estimate = batch.estimate
    return {"timestamp": batch.time_us, "timestamp_sample": estimate["time_us"], "q": wxyz(estimate["q_ned_from_frd"])}


def _attitude_true(batch: Batch) -> Columns:
    return {"timestamp": batch.time_us, "timestamp_sample": batch.time_us, "q": wxyz(batch.truth["q_ned_from_frd"])}


def _rates(batch: Batch) -> Columns:
    estimate = batch.estimate
    return {"timestamp": batch.time_us, "timestamp_sample": estimate["time_us"], "xyz": estimate["omega_frd"]}


def _rates_true(batch: Batch) -> Columns:
    return {"timestamp": batch.time_us, "timestamp_sample": batch.time_us, "xyz": batch.truth["omega_frd"]}


REFERENCE_FIELDS = {"ref_lat": "double", "ref_lon": "double", "ref_alt": "float"}
LOCAL_POSITION_FIELDS = {
    "timestamp_sample": "uint64_t",
    **dict.fromkeys("x y z vx vy vz ax ay az heading eph epv evh evv".split(), "float"),
    **REFERENCE_FIELDS,
    "dist_bottom": "float",
    **dict.fromkeys("xy_valid z_valid v_xy_valid v_z_valid xy_global z_global dist_bottom_valid".split(), "bool"),
}
TRUE_LOCAL_POSITION_FIELDS = {
    "timestamp_sample": "uint64_t",
    **dict.fromkeys("x y z vx vy vz heading dist_bottom".split(), "float"),
    **REFERENCE_FIELDS,
}


def _local_position(batch: Batch) -> Columns:
    estimate = batch.estimate
    flags = estimate["flags"]
    position_valid = (flags & POSITION_VALID) != 0
    height_valid = (flags & HEIGHT_VALID) != 0
    return {
        "timestamp": batch.time_us,
        "timestamp_sample": estimate["time_us"],
        **_axes("x y z", estimate["pos_ned"]),
        **_axes("vx vy vz", estimate["vel_ned"]),
        **_axes("ax ay az", estimate["accel_ned"]),
        "heading": yaw_rad(estimate["q_ned_from_frd"]),
        "eph": estimate["pos_h_std"],
        "epv": estimate["pos_v_std"],
        "evh": estimate["vel_std"],
        "evv": estimate["vel_std"],
        **_reference(batch.origin),
        "dist_bottom": estimate["terrain_d"] - estimate["pos_ned"][:, 2],
        "xy_valid": position_valid,
        "z_valid": height_valid,
        "v_xy_valid": (flags & VELOCITY_VALID) != 0,
        "v_z_valid": (flags & VELOCITY_VALID) != 0,
        "xy_global": position_valid,
        "z_global": height_valid,
        "dist_bottom_valid": (flags & TERRAIN_VALID) != 0,
    }


def _local_position_true(batch: Batch) -> Columns:
    truth = batch.truth
    return {
        "timestamp": batch.time_us,
        "timestamp_sample": batch.time_us,
        **_axes("x y z", truth["pos_ned"]),
        **_axes("vx vy vz", truth["vel_ned"]),
        "heading": yaw_rad(truth["q_ned_from_frd"]),
        "dist_bottom": truth["height_agl_m"],
        **_reference(batch.origin),
    }


def _reference(origin: GeoPoint) -> Columns:
    return {"ref_lat": origin.lat_deg, "ref_lon": origin.lon_deg, "ref_alt": origin.alt_m}


def _geodetic(pos_ned: Rows, origin: GeoPoint) -> Rows:
    """Latitude [deg], longitude [deg] and altitude [m] of ned points; shape (rows, 3)."""
    points = [geodetic_from_ned(north, east, down, origin) for north, east, down in pos_ned.tolist()]
    return np.array(points, dtype=float).reshape(-1, 3)


def _global_position(batch: Batch) -> Columns:
    estimate = batch.estimate
    points = _geodetic(estimate["pos_ned"], batch.origin)
    return {
        "timestamp": batch.time_us,
        "timestamp_sample": estimate["time_us"],
        "lat": points[:, 0],
        "lon": points[:, 1],
        "alt": points[:, 2],
        "eph": estimate["pos_h_std"],
        "epv": estimate["pos_v_std"],
        "terrain_alt": batch.origin.alt_m - estimate["terrain_d"],
        "terrain_alt_valid": (estimate["flags"] & TERRAIN_VALID) != 0,
    }


def _gps(batch: Batch) -> Columns:
    gnss = fresh(batch, "gnss")
    points = _geodetic(gnss["pos_ned"], batch.origin)
    velocity = gnss["vel_ned"]
    return {
        "timestamp": batch.time_us[is_fresh(batch, "gnss")],  # arrival
        "timestamp_sample": gnss["time_us"],
        "latitude_deg": points[:, 0],
        "longitude_deg": points[:, 1],
        "altitude_msl_m": points[:, 2],
        "fix_type": gnss["fix_type"],
        "satellites_used": gnss["satellites"],
        "eph": gnss["pos_h_std"],
        "epv": gnss["pos_v_std"],
        "s_variance_m_s": gnss["vel_std"],
        "vel_m_s": np.hypot(velocity[:, 0], velocity[:, 1]),
        **_axes("vel_n_m_s vel_e_m_s vel_d_m_s", velocity),
        "cog_rad": np.arctan2(velocity[:, 1], velocity[:, 0]),
        "vel_ned_valid": gnss["fix_type"] >= FIX_3D,
    }


def _baro(batch: Batch) -> Columns:
    baro = fresh(batch, "baro")
    return {
        "timestamp": baro["time_us"],
        "timestamp_sample": baro["time_us"],
        "pressure": baro["pressure_pa"],
        "temperature": baro["temperature_c"],
    }


def _mag(batch: Batch) -> Columns:
    mag = fresh(batch, "mag")
    return {
        "timestamp": mag["time_us"],
        "timestamp_sample": mag["time_us"],
        "magnetometer_ga": mag["field_frd_gauss"],
    }


def _range(batch: Batch) -> Columns:
    ranges = fresh(batch, "range")
    return {
        "timestamp": ranges["time_us"],
        "min_distance": MIN_DISTANCE_M,
        "max_distance": MAX_DISTANCE_M,
        "current_distance": ranges["distance_m"],
        "signal_quality": np.where(ranges["is_valid"] != 0, 100, 0),
        "type": LASER,
        "orientation": FACING_DOWN,
    }


def _battery(batch: Batch) -> Columns:
    is_new = is_fresh(batch, "battery")
    battery = batch.samples["battery"][is_new]
    return {
        "timestamp": battery["time_us"],
        "voltage_v": battery["voltage_v"],
        "current_a": battery["current_a"],
        "discharged_mah": batch.vehicle["battery_used_mah"][is_new],
        "remaining": batch.vehicle["battery_remaining"][is_new],
    }


def _motors(batch: Batch) -> Columns:
    command = batch.actuators["command"]
    control = np.full((len(command), 12), nan, dtype=np.float32)
    control[:, : command.shape[1]] = command
    return {"timestamp": batch.time_us, "timestamp_sample": batch.time_us, "control": control}


def _attitude_setpoint(batch: Batch) -> Columns:
    actuators = batch.actuators
    thrust = np.zeros((len(actuators), 3), dtype=np.float32)
    thrust[:, 2] = -actuators["thrust_sp"]
    return {
        "timestamp": batch.time_us,
        "yaw_sp_move_rate": actuators["traj_yaw_rate"],
        "q_d": wxyz(actuators["q_sp_ned_from_frd"]),
        "thrust_body": thrust,
    }


def _rates_setpoint(batch: Batch) -> Columns:
    return {"timestamp": batch.time_us, **_axes("roll pitch yaw", batch.actuators["omega_sp_frd"])}


def _local_setpoint(batch: Batch) -> Columns:
    actuators = batch.actuators
    return {
        "timestamp": batch.time_us,
        **_axes("x y z", actuators["traj_pos_ned"]),
        **_axes("vx vy vz", actuators["traj_vel_ned"]),
        "acceleration": actuators["traj_accel_ned"],
        "yaw": actuators["traj_yaw"],
        "yawspeed": actuators["traj_yaw_rate"],
    }


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


INNOVATION_FIELDS = {
    "timestamp_sample": "uint64_t",
    "gps_hvel": "float[2]",
    "gps_vvel": "float",
    "gps_hpos": "float[2]",
    "gps_vpos": "float",
    "ev_hvel": "float[2]",
    "ev_vvel": "float",
    "ev_hpos": "float[2]",
    "ev_vpos": "float",
    "heading": "float",
    "baro_vpos": "float",
    "rng_vpos": "float",
    "mag_field": "float[3]",
    "drag": "float[2]",
}


def _innovation_columns(batch: Batch, field: str) -> Columns:
    health = batch.health
    return {
        "timestamp": batch.time_us,
        "timestamp_sample": health["horizon_time_us"],
        "gps_hvel": health["gnss_vel"][field][:, :2],
        "gps_vvel": health["gnss_vel"][field][:, 2],
        "gps_hpos": health["gnss_pos"][field][:, :2],
        "gps_vpos": health["gnss_height"][field][:, 0],
        "ev_hvel": health["external_vel"][field][:, :2],
        "ev_vvel": health["external_vel"][field][:, 2],
        "ev_hpos": health["external_pos"][field][:, :2],
        "ev_vpos": health["external_height"][field][:, 0],
        "heading": health["external_yaw"][field][:, 0],
        "baro_vpos": health["baro"][field][:, 0],
        "rng_vpos": health["range"][field][:, 0],
        "mag_field": health["mag"][field],
        "drag": health["drag"][field][:, :2],
    }


def _innovations(batch: Batch) -> Columns:
    return _innovation_columns(batch, "innov")


def _innovation_variances(batch: Batch) -> Columns:
    return _innovation_columns(batch, "innov_var")


def _fresh_of(sensor: str) -> Callable[[Batch], Rows]:
    return partial(is_fresh, sensor=sensor)


_SAMPLED = {"timestamp_sample": "uint64_t"}

TOPICS = [
    Topic("vehicle_attitude", {**_SAMPLED, "q": "float[4]"}, _attitude),
    Topic("vehicle_attitude_groundtruth", {**_SAMPLED, "q": "float[4]"}, _attitude_true),
    Topic("vehicle_angular_velocity", {**_SAMPLED, "xyz": "float[3]"}, _rates),
    Topic("vehicle_angular_velocity_groundtruth", {**_SAMPLED, "xyz": "float[3]"}, _rates_true),
    Topic("vehicle_local_position", LOCAL_POSITION_FIELDS, _local_position),
    Topic("vehicle_local_position_groundtruth", TRUE_LOCAL_POSITION_FIELDS, _local_position_true),
    Topic(
        "vehicle_global_position",
        {
            **_SAMPLED,
            "lat": "double",
            "lon": "double",
            **dict.fromkeys("alt eph epv terrain_alt".split(), "float"),
            "terrain_alt_valid": "bool",
        },
        _global_position,
    ),
    Topic(
        "vehicle_gps_position",
        {
            "timestamp_sample": "uint64_t",
            **dict.fromkeys("latitude_deg longitude_deg altitude_msl_m".split(), "double"),
            **dict.fromkeys("s_variance_m_s eph epv vel_m_s vel_n_m_s vel_e_m_s vel_d_m_s cog_rad".split(), "float"),
            **dict.fromkeys("fix_type satellites_used".split(), "uint8_t"),
            "vel_ned_valid": "bool",
        },
        _gps,
        _fresh_of("gnss"),
    ),
    Topic("sensor_baro", {**_SAMPLED, "pressure": "float", "temperature": "float"}, _baro, _fresh_of("baro")),
    Topic("vehicle_magnetometer", {**_SAMPLED, "magnetometer_ga": "float[3]"}, _mag, _fresh_of("mag")),
    Topic(
        "distance_sensor",
        {
            **dict.fromkeys("min_distance max_distance current_distance".split(), "float"),
            "signal_quality": "int8_t",
            **dict.fromkeys("type orientation".split(), "uint8_t"),
        },
        _range,
        _fresh_of("range"),
    ),
    Topic(
        "battery_status",
        dict.fromkeys("voltage_v current_a discharged_mah remaining".split(), "float"),
        _battery,
        _fresh_of("battery"),
    ),
    Topic("actuator_motors", {**_SAMPLED, "control": "float[12]"}, _motors),
    Topic(
        "vehicle_attitude_setpoint",
        {"yaw_sp_move_rate": "float", "q_d": "float[4]", "thrust_body": "float[3]"},
        _attitude_setpoint,
    ),
    Topic("vehicle_rates_setpoint", dict.fromkeys("roll pitch yaw".split(), "float"), _rates_setpoint),
    Topic(
        "vehicle_local_position_setpoint",
        {
            **dict.fromkeys("x y z yaw yawspeed vx vy vz".split(), "float"),
            "acceleration": "float[3]",
        },
        _local_setpoint,
    ),
    Topic("estimator_innovations", INNOVATION_FIELDS, _innovations),
    Topic("estimator_innovation_variances", INNOVATION_FIELDS, _innovation_variances),
    Topic(
        "yaw_estimator_status",
        {
            **_SAMPLED,
            **dict.fromkeys("yaw_composite yaw_variance".split(), "float"),
            "yaw_composite_valid": "bool",
            **dict.fromkeys("yaw innov_vn innov_ve weight".split(), f"float[{YAW_MODELS}]"),
        },
        _yaw_estimator,
        _has_yaw,
    ),
    Topic("wind", {**_SAMPLED, "windspeed_north": "float", "windspeed_east": "float"}, _wind),
    Topic(
        "estimator_sensor_bias",
        {**_SAMPLED, "gyro_bias": "float[3]", "accel_bias": "float[3]"},
        _biases,
    ),
]
