"""A synthetic flight as PX4 logs of two ages and as a sensor CSV: at rest, then circling, seen by noisy sensors."""

import numpy as np

from common.geodesy import GeoPoint, geodetic_from_ned
from common.geomagnetic import field_ned_gauss
from common.logs.ulog import UlogWriter

GRAVITY = 9.80665
HOME = GeoPoint(47.397742, 8.545594, 488.0)
IMU_US = 4_000
START_US = 70_000_000  # a flight controller that has been on for a while
REST_S, SPIN_UP_S = 6.0, 3.0
RADIUS_M, TURN_RATE, CLIMB_RATE = 12.0, 0.35, 0.5
GYRO_BIAS = np.array([0.004, -0.003, 0.002])
GPS_DELAY_US = 130_000
GPS_STD, GPS_VEL_STD, BARO_STD, MAG_STD, RANGE_STD = 0.3, 0.1, 0.1, 0.002, 0.02

Tables = dict  # topic: (ULog fields, columns)


class Flight:
    """True motion at 250 Hz: level, the nose along the track; and what the sensors make of it."""

    def __init__(self, duration_s=24.0):
        self.rng = np.random.default_rng(5)
        self.time_s = np.arange(1, round(duration_s * 1e6 / IMU_US) + 1) * IMU_US * 1e-6
        self.time_us = START_US + np.round(self.time_s * 1e6).astype(np.int64)
        ramp = np.clip((self.time_s - REST_S) / SPIN_UP_S, 0.0, 1.0)
        smooth = ramp * ramp * (3.0 - 2.0 * ramp)
        rate = TURN_RATE * smooth
        self.yaw = np.cumsum(rate) * IMU_US * 1e-6
        self.turn = np.stack([np.cos(self.yaw), np.sin(self.yaw)])
        speed = RADIUS_M * rate
        self.vel_ned = np.stack([*(speed * self.turn), -CLIMB_RATE * smooth], axis=1)
        self.pos_ned = np.cumsum(self.vel_ned, axis=0) * IMU_US * 1e-6
        accel_ned = np.gradient(self.vel_ned, IMU_US * 1e-6, axis=0)
        count = len(rate)
        self.gyro = np.stack([np.zeros(count), np.zeros(count), rate], axis=1) + GYRO_BIAS + self.noise(0.003, count, 3)
        self.accel = self.in_body(accel_ned - [0.0, 0.0, GRAVITY]) + self.noise(0.03, count, 3)
        self.field = self.in_body(np.tile(field_ned_gauss(HOME.lat_deg, HOME.lon_deg, HOME.alt_m), (count, 1)))
        self.slow, self.fix = self.every(0.04), self.every(0.2)
        self.pressure = 101325.0 * (1.0 - self._height(BARO_STD) / 44330.77) ** 5.2558797
        noisy = self.pos_ned[self.fix] + self.noise(GPS_STD, len(self.fix), 3)
        self.places = np.array([geodetic_from_ned(*pos, HOME) for pos in noisy.tolist()])
        self.gps_vel = self.vel_ned[self.fix] + self.noise(GPS_VEL_STD, len(self.fix), 3)
        self.mag = self.field[self.slow] + self.noise(MAG_STD, len(self.slow), 3)

    def noise(self, std, *shape):
        return self.rng.normal(scale=std, size=shape)

    def in_body(self, vectors_ned):
        cos, sin = self.turn
        north, east, down = vectors_ned.T
        return np.stack([cos * north + sin * east, cos * east - sin * north, down], axis=1)

    def every(self, period_s):
        """Indices of the IMU samples at which a slower sensor measures."""
        step = round(period_s * 1e6 / IMU_US)
        return np.arange(step, len(self.time_s), step)

    def _height(self, std):
        return HOME.alt_m - self.pos_ned[self.slow, 2] + self.noise(std, len(self.slow))


def floats(names):
    return dict.fromkeys(names.split(), "float")


def px4_tables(flight, is_old=False):
    """Topics as PX4 1.15 logs them, or as PX4 1.8 did: integer places, millibar, raw magnetometer, no sample times."""
    tables: Tables = {
        "sensor_combined": (
            {"gyro_rad": "float[3]", "gyro_integral_dt": "uint32_t", "accelerometer_m_s2": "float[3]"},
            {
                "timestamp": flight.time_us,
                "gyro_rad": flight.gyro,
                "gyro_integral_dt": IMU_US,
                "accelerometer_m_s2": flight.accel,
            },
        ),
        "vehicle_gps_position": _gps_table(flight, is_old),
        "distance_sensor": (
            floats("min_distance max_distance current_distance")
            | {"signal_quality": "int8_t", "orientation": "uint8_t"},
            {
                "timestamp": flight.time_us[flight.slow],
                "min_distance": 0.1,
                "max_distance": 40.0,
                "current_distance": 0.2 - flight.pos_ned[flight.slow, 2] + flight.noise(RANGE_STD, len(flight.slow)),
                "signal_quality": -1,
                "orientation": 25,
            },
        ),
    }
    return tables | (_old_slow_tables(flight) if is_old else _new_slow_tables(flight)) | _answer_tables(flight)


def _gps_table(flight, is_old):
    if is_old:
        place_fields = dict.fromkeys("lat lon alt".split(), "int32_t")
        place = dict(zip(place_fields, np.round(flight.places * [1e7, 1e7, 1e3]).T, strict=True))
    else:
        place_fields = dict.fromkeys("latitude_deg longitude_deg altitude_msl_m".split(), "double")
        place = dict(zip(place_fields, flight.places.T, strict=True))
        place_fields["timestamp_sample"] = "uint64_t"
        place["timestamp_sample"] = flight.time_us[flight.fix]
    speeds = "vel_n_m_s vel_e_m_s vel_d_m_s"
    fields = (
        place_fields
        | floats(f"{speeds} eph epv s_variance_m_s")
        | {"fix_type": "uint8_t", "satellites_used": "uint8_t", "vel_ned_valid": "bool"}
    )
    accuracy = {"eph": 0.8, "epv": 1.2, "s_variance_m_s": 0.3, "fix_type": 3, "satellites_used": 14}
    velocity = dict(zip(speeds.split(), flight.gps_vel.T, strict=True))
    times = {"timestamp": flight.time_us[flight.fix] + GPS_DELAY_US}
    return fields, times | place | velocity | accuracy | {"vel_ned_valid": True}


def _new_slow_tables(flight):
    times = flight.time_us[flight.slow]
    return {
        "vehicle_air_data": (
            {"timestamp_sample": "uint64_t", **floats("baro_pressure_pa baro_temp_celcius")},
            {
                "timestamp": times + 3_000,
                "timestamp_sample": times,
                "baro_pressure_pa": flight.pressure,
                "baro_temp_celcius": 20.0,
            },
        ),
        "vehicle_magnetometer": (
            {"timestamp_sample": "uint64_t", "magnetometer_ga": "float[3]"},
            {"timestamp": times, "timestamp_sample": 0, "magnetometer_ga": flight.mag},
        ),
    }


def _old_slow_tables(flight):
    times = flight.time_us[flight.slow]
    return {
        "sensor_baro": (
            floats("pressure temperature"),
            {"timestamp": times, "pressure": flight.pressure / 100.0, "temperature": 20.0},
        ),
        "sensor_mag": (floats("x y z"), {"timestamp": times, **dict(zip("xyz", flight.mag.T, strict=True))}),
    }


def _answer_tables(flight):
    """What the estimator of the log made of it: here, the truth."""
    rows = flight.every(0.1)
    times = flight.time_us[rows]
    q = np.stack([np.cos(flight.yaw[rows] / 2), *np.zeros((2, len(rows))), np.sin(flight.yaw[rows] / 2)], axis=1)
    return {
        "vehicle_local_position": (
            floats("x y z vx vy vz ref_alt") | {"ref_lat": "double", "ref_lon": "double", "xy_valid": "bool"},
            {
                "timestamp": times,
                **dict(zip("x y z".split(), flight.pos_ned[rows].T, strict=True)),
                **dict(zip("vx vy vz".split(), flight.vel_ned[rows].T, strict=True)),
                "ref_lat": HOME.lat_deg,
                "ref_lon": HOME.lon_deg,
                "ref_alt": HOME.alt_m,
                "xy_valid": True,
            },
        ),
        "vehicle_attitude": ({"q": "float[4]"}, {"timestamp": times, "q": q}),
    }


def only(table, is_kept):
    """A table with some of its rows."""
    fields, columns = table
    return fields, {name: value[is_kept] if np.ndim(value) else value for name, value in columns.items()}


def write_ulog(path, tables, parameters=None, sys_name="PX4"):
    parameters = {"EKF2_GPS_DELAY": GPS_DELAY_US * 1e-3, "EKF2_MAG_NOISE": 0.5} | (parameters or {})
    with UlogWriter(path, START_US, {"sys_name": sys_name}, parameters) as log:
        topics = [(log.add_topic(name, fields), columns) for name, (fields, columns) in tables.items()]
        for topic, columns in topics:
            topic.write(columns)


def csv_lines(flight):
    """The flight as lines of a sensor CSV, header first."""
    fix_times, slow_times = flight.time_us[flight.fix], flight.time_us[flight.slow]
    rows = [
        *(
            (time, "imu", *gyro, *accel)
            for time, gyro, accel in zip(flight.time_us, flight.gyro, flight.accel, strict=True)
        ),
        *(
            (time, "gnss", *place, *velocity, 0.8, 1.2, 0.3, 3, 14)
            for time, place, velocity in zip(fix_times, flight.places, flight.gps_vel, strict=True)
        ),
        *((time, "baro", pressure, 20.0) for time, pressure in zip(slow_times, flight.pressure, strict=True)),
        *((time, "mag", *field) for time, field in zip(slow_times, flight.mag, strict=True)),
    ]
    rows.sort(key=lambda row: row[0])
    return ["time_us,sensor,v0,v1", *(",".join(map(str, row)) for row in rows)]
