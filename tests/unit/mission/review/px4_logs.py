"""Small ULogs with PX4's topic names: a vehicle that flies a circle, with what a test asks for."""

import numpy as np

from common.logs.ulog import UlogWriter

START_US = 100_000_000
SECONDS = 20.0
HOME = (47.397742, 8.545594, 488.0)
RADIUS_M, TURN_RAD_S, HEIGHT_M = 10.0, 0.5, 5.0
SHAKE_HZ, SHAKE_M_S2 = 40.0, 2.0
INFO = {"sys_name": "PX4", "ver_hw": "TEST", "ver_sw": "0123456789abcdef"}
ALL = frozenset(
    "vehicle_local_position vehicle_local_position_setpoint vehicle_attitude vehicle_attitude_setpoint "
    "vehicle_angular_velocity vehicle_rates_setpoint sensor_combined vehicle_status vehicle_land_detected "
    "estimator_innovations estimator_innovation_variances actuator_motors battery_status vehicle_gps_position "
    "vehicle_magnetometer home_position".split()
)


def times_us(rate_hz):
    return START_US + (np.arange(int(SECONDS * rate_hz)) * 1e6 / rate_hz).astype(np.uint64)


def circle(time_us):
    """Position and velocity, ned; on the ground for the first and last two seconds."""
    t = (time_us - START_US) * 1e-6
    angle = TURN_RAD_S * t
    height = HEIGHT_M * np.clip(np.minimum(t - 2.0, SECONDS - 2.0 - t) / 2.0, 0.0, 1.0)
    pos = np.stack([RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle), -height], axis=1)
    return pos, np.gradient(pos, t, axis=0)


def write(path, *, topics=ALL, info=INFO, start_us=START_US, texts=(), parameters=None, defaults=None):
    """Writes the log."""
    log = UlogWriter(path, start_us, info, parameters or {"SYS_AUTOSTART": 4001}, defaults or {})
    rows = {name: (fields, columns) for name, (fields, columns) in _topics().items() if name in topics}
    declared = {name: log.add_topic(name, fields) for name, (fields, _) in rows.items()}
    for time_us, level, text in texts:
        log.message(time_us, level, text)
    for name, topic in declared.items():
        topic.write(rows[name][1])
    log.close()
    return path


def floats(names):
    return dict.fromkeys(names.split(), "float")


def _topics():
    slow, fast = times_us(50.0), times_us(250.0)
    pos, vel = circle(slow)
    t, t_fast = (slow - START_US) * 1e-6, (fast - START_US) * 1e-6
    xyz = {name: pos[:, k] for k, name in enumerate("xyz")} | {f"v{name}": vel[:, k] for k, name in enumerate("xyz")}
    level = np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1))
    accel = np.zeros((len(fast), 3))
    accel[:, 2] = -9.81 + SHAKE_M_S2 * np.sin(2.0 * np.pi * SHAKE_HZ * t_fast)
    state = START_US + np.array([0, 2, 10, 18], np.uint64) * 1_000_000
    fix = times_us(5.0)
    ones, many = np.ones(len(t)), np.ones(len(fix))
    return {
        "vehicle_local_position": (
            floats("x y z vx vy vz eph epv ref_alt") | dict.fromkeys(("ref_lat", "ref_lon"), "double"),
            {"timestamp": slow, **xyz, "eph": 0.5 * ones, "epv": 0.7 * ones}
            | {"ref_lat": HOME[0] * ones, "ref_lon": HOME[1] * ones, "ref_alt": HOME[2] * ones},
        ),
        "vehicle_local_position_setpoint": (floats("x y z vx vy vz"), {"timestamp": slow, **xyz}),
        "vehicle_attitude": ({"q": "float[4]"}, {"timestamp": slow, "q": level}),
        "vehicle_attitude_setpoint": ({"q_d": "float[4]"}, {"timestamp": slow, "q_d": level}),
        "vehicle_angular_velocity": ({"xyz": "float[3]"}, {"timestamp": slow, "xyz": 0.1 * vel}),
        "vehicle_rates_setpoint": (
            floats("roll pitch yaw"),
            {"timestamp": slow, "roll": 0.1 * ones, "pitch": 0.0 * ones, "yaw": 0.0 * ones},
        ),
        "sensor_combined": (
            {"gyro_rad": "float[3]", "accelerometer_m_s2": "float[3]"},
            {"timestamp": fast, "gyro_rad": np.zeros((len(fast), 3)), "accelerometer_m_s2": accel},
        ),
        "vehicle_status": (
            dict.fromkeys("nav_state arming_state system_type".split(), "uint8_t") | {"failsafe": "bool"},
            {"timestamp": state, "nav_state": [4, 3, 5, 4], "arming_state": [1, 2, 2, 1]}
            | {"system_type": [2, 2, 2, 2], "failsafe": [0, 0, 1, 0]},
        ),
        "vehicle_land_detected": ({"landed": "bool"}, {"timestamp": state, "landed": [1, 0, 0, 1]}),
        "estimator_innovations": (
            {"gps_hpos": "float[2]", "baro_vpos": "float"},
            {"timestamp": slow, "gps_hpos": np.stack([ones, 2.0 * ones], axis=1), "baro_vpos": 0.1 * ones},
        ),
        "estimator_innovation_variances": (
            {"gps_hpos": "float[2]", "baro_vpos": "float"},
            {"timestamp": slow, "gps_hpos": np.stack([ones, ones], axis=1), "baro_vpos": ones},
        ),
        "actuator_motors": (
            {"control": "float[12]"},
            {"timestamp": slow, "control": np.where(np.arange(12) < 4, 0.4, np.nan) * ones[:, None]},
        ),
        "battery_status": (
            floats("voltage_v current_a discharged_mah remaining"),
            {"timestamp": slow, "voltage_v": 16.0 - 0.01 * t, "current_a": 10.0 * ones, "discharged_mah": 3.0 * t}
            | {"remaining": 1.0 - 0.01 * t},
        ),
        "vehicle_gps_position": (
            dict.fromkeys(("lat", "lon", "alt"), "int32_t")
            | floats("eph epv")
            | dict.fromkeys(("fix_type", "satellites_used"), "uint8_t"),
            {"timestamp": fix, "lat": many * round(HOME[0] * 1e7), "lon": many * round(HOME[1] * 1e7)}
            | {"alt": many * round(HOME[2] * 1e3), "eph": 0.8 * many, "epv": 1.2 * many}
            | {"fix_type": 3 * many, "satellites_used": 12 * many},
        ),
        "vehicle_magnetometer": (
            {"magnetometer_ga": "float[3]"},
            {"timestamp": slow, "magnetometer_ga": np.tile([0.2, 0.0, 0.4], (len(t), 1))},
        ),
        "home_position": (
            dict.fromkeys(("lat", "lon"), "double") | {"alt": "float"},
            {"timestamp": state[:1], "lat": [HOME[0]], "lon": [HOME[1]], "alt": [HOME[2]]},
        ),
    }
