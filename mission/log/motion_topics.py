"""Topics of the vehicle's motion: the estimate, and the truth beside it."""

from autopilot.ports import HEIGHT_VALID, POSITION_VALID, TERRAIN_VALID, VELOCITY_VALID
from common.geodesy import GeoPoint
from mission.log.euler_angles import wxyz, yaw_rad
from mission.log.topic import SAMPLED, Batch, Columns, Topic, axes, geodetic


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


def _steering_true(batch: Batch) -> Columns:
    return {"timestamp": batch.time_us, "timestamp_sample": batch.time_us, "angle": batch.truth["steering_rad"]}


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
        **axes("x y z", estimate["pos_ned"]),
        **axes("vx vy vz", estimate["vel_ned"]),
        **axes("ax ay az", estimate["accel_ned"]),
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
        **axes("x y z", truth["pos_ned"]),
        **axes("vx vy vz", truth["vel_ned"]),
        "heading": yaw_rad(truth["q_ned_from_frd"]),
        "dist_bottom": truth["height_agl_m"],
        **_reference(batch.origin),
    }


def _reference(origin: GeoPoint) -> Columns:
    return {"ref_lat": origin.lat_deg, "ref_lon": origin.lon_deg, "ref_alt": origin.alt_m}


def _global_position(batch: Batch) -> Columns:
    estimate = batch.estimate
    points = geodetic(estimate["pos_ned"], batch.origin)
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


STEERING_TOPIC = Topic("steering_groundtruth", {**SAMPLED, "angle": "float"}, _steering_true)
MOTION_TOPICS = (
    Topic("vehicle_attitude", {**SAMPLED, "q": "float[4]"}, _attitude),
    Topic("vehicle_attitude_groundtruth", {**SAMPLED, "q": "float[4]"}, _attitude_true),
    Topic("vehicle_angular_velocity", {**SAMPLED, "xyz": "float[3]"}, _rates),
    Topic("vehicle_angular_velocity_groundtruth", {**SAMPLED, "xyz": "float[3]"}, _rates_true),
    Topic("vehicle_local_position", LOCAL_POSITION_FIELDS, _local_position),
    Topic("vehicle_local_position_groundtruth", TRUE_LOCAL_POSITION_FIELDS, _local_position_true),
    Topic(
        "vehicle_global_position",
        {
            **SAMPLED,
            "lat": "double",
            "lon": "double",
            **dict.fromkeys("alt eph epv terrain_alt".split(), "float"),
            "terrain_alt_valid": "bool",
        },
        _global_position,
    ),
)
