"""Topics of the sensors: a row for each frame in which a new sample had arrived."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from autopilot.estimator.airspeed_params import AIRSPEED_PARAMETERS
from autopilot.estimator.sensor_spec import SensorSpec
from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.ports import AIRSPEED_VALID
from mission.log.topic import Batch, Columns, Rows, Topic, axes, fresh, geodetic, is_fresh
from sim.bodies.rigid_body import density_ratio_at
from sim.sensors.range import MAX_DISTANCE_M, MIN_DISTANCE_M

SEA_LEVEL_DENSITY_KG_M3 = 1.225  # ISO 2533
FIX_3D = 3  # fix_type
LASER = 0  # distance_sensor.type
FACING_DOWN = 25  # distance_sensor.orientation


def _gps(batch: Batch) -> Columns:
    gnss = fresh(batch, "gnss")
    points = geodetic(gnss["pos_ned"], batch.origin)
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
        **axes("vel_n_m_s vel_e_m_s vel_d_m_s", velocity),
        "cog_rad": np.arctan2(velocity[:, 1], velocity[:, 0]),
        "vel_ned_valid": gnss["fix_type"] >= FIX_3D,
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


def _sampled(batch: Batch, sensor: str, holds: Mapping[str, str]) -> Columns:
    rows = fresh(batch, sensor)
    return {"timestamp": rows["time_us"], **{field: rows[part] for field, part in holds.items()}}


def _airspeed(batch: Batch) -> Columns:
    sample = fresh(batch, "airspeed")
    indicated = _speed_of(sample["pressure_pa"])
    return {
        "timestamp": batch.time_us[is_fresh(batch, "airspeed")],
        "timestamp_sample": sample["time_us"],
        "indicated_airspeed_m_s": indicated,
        "true_airspeed_m_s": indicated * _true_over_indicated(batch)[is_fresh(batch, "airspeed")],
        "confidence": np.ones(len(sample)),
    }


def _validated(batch: Batch) -> Columns:
    is_valid = (batch.estimate["flags"] & int(AIRSPEED_VALID)) != 0
    indicated = np.where(is_valid, batch.estimate["airspeed"], np.nan)
    check = batch.health["airspeed"]
    through = batch.estimate["vel_ned"].astype(float)
    through[:, :2] -= check["wind_ne"]
    by_motion = np.where(check["wind_count"] > 0.0, np.linalg.norm(through, axis=1), np.nan)
    ratio = _true_over_indicated(batch)
    return {
        "timestamp": batch.time_us,
        "indicated_airspeed_m_s": indicated,
        "calibrated_airspeed_m_s": indicated,
        "true_airspeed_m_s": indicated * ratio,
        "calibrated_ground_minus_wind_m_s": by_motion / ratio,
        "true_ground_minus_wind_m_s": by_motion,
        "airspeed_sensor_measurement_valid": is_valid,
        "selected_airspeed_index": np.where(is_valid, 1, -1),
    }


def _speed_of(pressure_pa: Rows) -> Rows:
    return np.sign(pressure_pa) * np.sqrt(2.0 * np.abs(pressure_pa) / SEA_LEVEL_DENSITY_KG_M3)


def _true_over_indicated(batch: Batch) -> Rows:
    """By the standard atmosphere at the height flown."""
    alt_m = batch.origin.alt_m - batch.estimate["pos_ned"][:, 2].astype(float)
    return 1.0 / np.sqrt([density_ratio_at(each) for each in alt_m])


_AIRSPEED = Topic(
    "airspeed",
    {
        "timestamp_sample": "uint64_t",
        **dict.fromkeys("indicated_airspeed_m_s true_airspeed_m_s confidence".split(), "float"),
    },
    _airspeed,
    partial(is_fresh, sensor="airspeed"),
    AIRSPEED_PARAMETERS[0].name,
)
_VALIDATED = Topic(
    "airspeed_validated",
    {
        **dict.fromkeys(
            "indicated_airspeed_m_s calibrated_airspeed_m_s true_airspeed_m_s calibrated_ground_minus_wind_m_s "
            "true_ground_minus_wind_m_s".split(),
            "float",
        ),
        "airspeed_sensor_measurement_valid": "bool",
        "selected_airspeed_index": "int8_t",
    },
    _validated,
    parameter=AIRSPEED_PARAMETERS[0].name,
)
_OWN_TOPICS = {
    "gnss": Topic(
        "vehicle_gps_position",
        {
            "timestamp_sample": "uint64_t",
            **dict.fromkeys("latitude_deg longitude_deg altitude_msl_m".split(), "double"),
            **dict.fromkeys("s_variance_m_s eph epv vel_m_s vel_n_m_s vel_e_m_s vel_d_m_s cog_rad".split(), "float"),
            **dict.fromkeys("fix_type satellites_used".split(), "uint8_t"),
            "vel_ned_valid": "bool",
        },
        _gps,
        partial(is_fresh, sensor="gnss"),
    ),
    "range": Topic(
        "distance_sensor",
        {
            **dict.fromkeys("min_distance max_distance current_distance".split(), "float"),
            "signal_quality": "int8_t",
            **dict.fromkeys("type orientation".split(), "uint8_t"),
        },
        _range,
        partial(is_fresh, sensor="range"),
    ),
}
_BATTERY = Topic(
    "battery_status",
    dict.fromkeys("voltage_v current_a discharged_mah remaining".split(), "float"),
    _battery,
    partial(is_fresh, sensor="battery"),
)


def _topic(sensor: SensorSpec) -> Topic:
    if sensor.topic is None:
        return _OWN_TOPICS[sensor.name]
    is_new = partial(is_fresh, sensor=sensor.name)
    columns = partial(_sampled, sensor=sensor.name, holds=sensor.topic.holds)
    return Topic(sensor.topic.name, dict(sensor.topic.fields), columns, is_new, sensor.parameter)


SENSOR_TOPICS = (*(_topic(sensor) for sensor in FUSED_SENSORS), _AIRSPEED, _VALIDATED, _BATTERY)
