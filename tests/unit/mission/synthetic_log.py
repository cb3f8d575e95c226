"""Synthetic flights as logs: at rest, then circles at a steady turn, seen by noisy sensors."""

import numpy as np

from common.geodesy import GeoPoint, geodetic_from_ned
from common.geomagnetic import field_ned_gauss
from common.ulog import UlogWriter

GRAVITY = 9.80665
HOME = GeoPoint(47.397742, 8.545594, 488.0)
IMU_US = 4_000
REST_S, SPIN_UP_S = 6.0, 3.0
RADIUS_M, RATE = 12.0, 0.35  # turn rate [rad/s]: 4.2 m/s
GYRO_BIAS = np.array([0.004, -0.003, 0.002])
START_US = 70_000_000  # a flight controller that has been on for a while


class Flight:
    """True motion at 250 Hz: at rest, then circling with the nose along the track, level, climbing gently."""

    def __init__(self, duration_s=24.0):
        self.time_s = np.arange(1, round(duration_s * 1e6 / IMU_US) + 1) * IMU_US * 1e-6
        self.time_us = START_US + np.round(self.time_s * 1e6).astype(np.int64)
        since = self.time_s - REST_S
        ramp = np.clip(since / SPIN_UP_S, 0.0, 1.0)
        smooth = ramp * ramp * (3.0 - 2.0 * ramp)
        rate = RATE * smooth
        angle = np.cumsum(rate) * IMU_US * 1e-6
        self.yaw = angle
        speed = RADIUS_M * rate
        climb = 0.5 * smooth
        self.vel_ned = np.stack([speed * np.cos(angle), speed * np.sin(angle), -climb], axis=1)
        self.pos_ned = np.cumsum(self.vel_ned, axis=0) * IMU_US * 1e-6
        self.accel_ned = np.gradient(self.vel_ned, IMU_US * 1e-6, axis=0)
        cos, sin = np.cos(angle), np.sin(angle)
        force_ned = self.accel_ned - [0.0, 0.0, GRAVITY]
        self.force_frd = np.stack(
            [cos * force_ned[:, 0] + sin * force_ned[:, 1], -sin * force_ned[:, 0] + cos * force_ned[:, 1], force_ned[:, 2]],
            axis=1,
        )
        self.omega_frd = np.stack([np.zeros_like(rate), np.zeros_like(rate), rate], axis=1)
        field = field_ned_gauss(HOME.lat_deg, HOME.lon_deg, HOME.alt_m)
        self.field_frd = np.stack(
            [cos * field[0] + sin * field[1], -sin * field[0] + cos * field[1], np.full_like(cos, field[2])], axis=1
        )
        self.rng = np.random.default_rng(5)

    def noise(self, std, *shape):
        return self.rng.normal(scale=std, size=shape)

    def imu(self):
        count = len(self.time_s)
        return self.omega_frd + GYRO_BIAS + self.noise(0.003, count, 3), self.force_frd + self.noise(0.03, count, 3)

    def every(self, period_s):
        """Indices of the IMU samples at which a slower sensor measures."""
        step = round(period_s * 1e6 / IMU_US)
        return np.arange(step, len(self.time_s), step)

    def places(self, index):
        noisy = self.pos_ned[index] + self.noise(0.3, len(index), 3)
        return np.array([geodetic_from_ned(*pos, HOME) for pos in noisy.tolist()]), (
            self.vel_ned[index] + self.noise(0.1, len(index), 3)
        )

    def pressures(self, index):
        height = HOME.alt_m - self.pos_ned[index, 2] + self.noise(0.1, len(index))
        return 101325.0 * (1.0 - height / 44330.77) ** 5.2558797


def gps_columns(flight, index, form, delay_us):
    places, velocity = flight.places(index)
    columns = {
        "timestamp": flight.time_us[index] + delay_us,
        "vel_n_m_s": velocity[:, 0],
        "vel_e_m_s": velocity[:, 1],
        "vel_d_m_s": velocity[:, 2],
        "eph": 0.8,
        "epv": 1.2,
        "s_variance_m_s": 0.3,
        "fix_type": 3,
        "satellites_used": 14,
        "vel_ned_valid": True,
    }
    if form == "old":
        columns |= {
            "lat": np.round(places[:, 0] * 1e7),
            "lon": np.round(places[:, 1] * 1e7),
            "alt": np.round(places[:, 2] * 1e3),
        }
    else:
        columns |= {
            "timestamp_sample": flight.time_us[index],
            "latitude_deg": places[:, 0],
            "longitude_deg": places[:, 1],
            "altitude_msl_m": places[:, 2],
        }
    return columns


GPS_FIELDS = {
    **dict.fromkeys("vel_n_m_s vel_e_m_s vel_d_m_s eph epv s_variance_m_s".split(), "float"),
    "fix_type": "uint8_t",
    "satellites_used": "uint8_t",
    "vel_ned_valid": "bool",
}
OLD_PLACE = dict.fromkeys("lat lon alt".split(), "int32_t")
NEW_PLACE = {
    "timestamp_sample": "uint64_t",
    **dict.fromkeys("latitude_deg longitude_deg altitude_msl_m".split(), "double"),
}


def write_ulog(path, flight, form="new", parameters=None, without=()):
    """A PX4 log: `new` as PX4 1.15 writes it, `old` as PX4 1.8, in integers, millibar and raw topics."""
    is_old = form == "old"
    parameters = {"EKF2_GPS_DELAY": 130.0, "EKF2_MAG_NOISE": 0.5} | (parameters or {})
    slow, fix = flight.every(0.04), flight.every(0.2)
    gyro, accel = flight.imu()
    with UlogWriter(path, START_US, {"sys_name": "PX4"}, parameters) as log:
        tables = {}
        tables["sensor_combined"] = (
            {
                "gyro_rad": "float[3]",
                "gyro_integral_dt": "uint32_t",
                "accelerometer_timestamp_relative": "int32_t",
                "accelerometer_m_s2": "float[3]",
                "accelerometer_integral_dt": "uint32_t",
            },
            {
                "timestamp": flight.time_us,
                "gyro_rad": gyro,
                "accelerometer_m_s2": accel,
                **dict.fromkeys(("gyro_integral_dt", "accelerometer_integral_dt"), IMU_US),
                "accelerometer_timestamp_relative": 0,
            },
        )
        tables["vehicle_gps_position"] = (
            {**(OLD_PLACE if is_old else NEW_PLACE), **GPS_FIELDS},
            gps_columns(flight, fix, form, delay_us=130_000),
        )
        pressure = flight.pressures(slow)
        if is_old:
            tables["sensor_baro"] = (
                {"pressure": "float", "temperature": "float"},
                {"timestamp": flight.time_us[slow], "pressure": pressure / 100.0, "temperature": 20.0},
            )
        else:
            tables["vehicle_air_data"] = (
                {"timestamp_sample": "uint64_t", "baro_pressure_pa": "float", "baro_temp_celcius": "float"},
                {
                    "timestamp": flight.time_us[slow] + 3_000,
                    "timestamp_sample": flight.time_us[slow],
                    "baro_pressure_pa": pressure,
                    "baro_temp_celcius": 20.0,
                },
            )
        field = flight.field_frd[slow] + flight.noise(0.002, len(slow), 3)
        if is_old:
            columns = dict(zip("xyz", field.T, strict=True))
            tables["sensor_mag"] = (dict.fromkeys("xyz", "float"), {"timestamp": flight.time_us[slow], **columns})
        else:
            tables["vehicle_magnetometer"] = (
                {"timestamp_sample": "uint64_t", "magnetometer_ga": "float[3]"},
                {"timestamp": flight.time_us[slow], "timestamp_sample": 0, "magnetometer_ga": field},
            )
        distance = 0.2 - flight.pos_ned[slow, 2]
        tables["distance_sensor"] = (
            {
                **dict.fromkeys("min_distance max_distance current_distance".split(), "float"),
                "signal_quality": "int8_t",
                "orientation": "uint8_t",
            },
            {
                "timestamp": flight.time_us[slow],
                "min_distance": 0.1,
                "max_distance": 40.0,
                "current_distance": distance + flight.noise(0.05, len(slow)),
                "signal_quality": -1,
                "orientation": 25,
            },
        )
        rows = flight.every(0.1)
        tables["vehicle_local_position"] = (
            {
                **dict.fromkeys("x y z vx vy vz".split(), "float"),
                "ref_lat": "double",
                "ref_lon": "double",
                "ref_alt": "float",
                "xy_valid": "bool",
            },
            {
                "timestamp": flight.time_us[rows],
                **dict(zip("x y z".split(), flight.pos_ned[rows].T, strict=True)),
                **dict(zip("vx vy vz".split(), flight.vel_ned[rows].T, strict=True)),
                "ref_lat": HOME.lat_deg,
                "ref_lon": HOME.lon_deg,
                "ref_alt": HOME.alt_m,
                "xy_valid": True,
            },
        )
        q = np.zeros((len(rows), 4))
        q[:, 0], q[:, 3] = np.cos(flight.yaw[rows] / 2), np.sin(flight.yaw[rows] / 2)
        tables["vehicle_attitude"] = ({"q": "float[4]"}, {"timestamp": flight.time_us[rows], "q": q})
        topics = {name: log.add_topic(name, fields) for name, (fields, _) in tables.items() if name not in without}
        for name, topic in topics.items():
            topic.write(tables[name][1])


def write_csv(path, flight):
    """The same flight as a sensor CSV."""
    gyro, accel = flight.imu()
    slow, fix = flight.every(0.04), flight.every(0.2)
    places, velocity = flight.places(fix)
    lines = [
        (time, f"imu,{','.join(f'{value:.6f}' for value in (*rate, *force))}")
        for time, rate, force in zip(flight.time_us, gyro, accel, strict=True)
    ]
    lines += [
        (time, f"gnss,{place[0]:.9f},{place[1]:.9f},{place[2]:.3f},{','.join(f'{v:.3f}' for v in vel)},0.8,1.2,0.3,3,14")
        for time, place, vel in zip(flight.time_us[fix], places, velocity, strict=True)
    ]
    lines += [
        (time, f"baro,{pressure:.2f},20")
        for time, pressure in zip(flight.time_us[slow], flight.pressures(slow), strict=True)
    ]
    lines += [
        (time, f"mag,{','.join(f'{value:.5f}' for value in field)}")
        for time, field in zip(flight.time_us[slow], flight.field_frd[slow] + flight.noise(0.002, len(slow), 3), strict=True)
    ]
    lines.sort()
    text = "\n".join(f"{time},{rest}" for time, rest in lines)
    path.write_text(f"time_us,sensor,v0,v1\n# a comment\n{text}\n")
