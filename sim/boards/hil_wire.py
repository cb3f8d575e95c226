"""PX4's HIL messages: what its simulator link takes of sensors, and what it gives of actuators.

Facts: src/modules/simulation/simulator_mavlink/SimulatorMavlink.cpp of PX4, and MAVLink's common.xml. Its clock is
the time of HIL_SENSOR of id 0.
"""

from math import atan2, hypot, pi
from typing import Any

from autopilot.mavlink.telemetry.sensors import COVARIANCE_UNKNOWN, LASER, LOOKS_DOWN, pressure_altitude_m
from autopilot.mavlink.wire.codec import MessageType, frame_bytes, known_type
from common.geodesy import GeoPoint, geodetic_from_ned
from sim.sensors.range import MAX_DISTANCE_M, MIN_DISTANCE_M

SYSTEM_ID, COMPONENT_ID = 1, 200  # guess: of a simulator; PX4 does not ask
HIL_SENSOR, HIL_GPS = known_type("HIL_SENSOR"), known_type("HIL_GPS")
DISTANCE = known_type("DISTANCE_SENSOR")
HIL_STATE = known_type("HIL_STATE_QUATERNION")
ACTUATORS_ID = known_type("HIL_ACTUATOR_CONTROLS").msg_id
SAFETY_ARMED = 128  # MAV_MODE_FLAG, in `mode` of HIL_ACTUATOR_CONTROLS

# HIL_SENSOR.fields_updated: all bits of a group, or PX4 leaves the group out
ACCEL, GYRO, MAG, BARO, AIRSPEED = 0x7, 0x38, 0x1C0, 0x1A00, 0x400
_PA_PER_HPA = 100.0
_MIN_CM, _MAX_CM = round(100.0 * MIN_DISTANCE_M), round(100.0 * MAX_DISTANCE_M)
_UNKNOWN_YAW = 0
_G_MILLI = 1000.0 / 9.80665


class HilWriter:
    """Frames of a simulator, numbered.

    Args:
        home: origin of ned.
    """

    def __init__(self, home: GeoPoint) -> None:
        self._home = home
        self._seq = 0

    def sensors(self, time_us: int, samples: Any, *, has_mag: bool, has_baro: bool, has_airspeed: bool) -> bytes:
        """HIL_SENSOR of a tick.

        Args:
            time_us: PX4's clock will be this.
            samples: a row of `Samples`; magnetometer, barometer and pitot tube count only if they are new.
            has_mag: that of the magnetometer is.
            has_baro: that of the barometer is.
            has_airspeed: that of the pitot tube is.
        """
        imu, mag, baro = samples["imu"], samples["mag"], samples["baro"]
        updated = ACCEL | GYRO | (MAG if has_mag else 0) | (BARO if has_baro else 0)
        updated |= AIRSPEED if has_airspeed else 0
        pressure_pa = float(baro["pressure_pa"])
        return self._frame(
            HIL_SENSOR,
            time_us,
            *imu["accel_frd"].tolist(),
            *imu["gyro_frd"].tolist(),
            *mag["field_frd_gauss"].tolist(),
            pressure_pa / _PA_PER_HPA,
            float(samples["airspeed"]["pressure_pa"]) / _PA_PER_HPA if has_airspeed else 0.0,
            pressure_altitude_m(pressure_pa) if has_baro else 0.0,
            float(baro["temperature_c"]),
            updated,
            0,
        )

    def gnss(self, time_us: int, sample: Any) -> bytes:
        """HIL_GPS of a new sample; `eph` and `epv` are taken for accuracies [cm]."""
        lat_deg, lon_deg, alt_m = self._position(sample["pos_ned"])
        vn, ve, vd = (round(100.0 * part) for part in sample["vel_ned"].tolist())
        course_cdeg = round(atan2(ve, vn) % (2.0 * pi) * 18000.0 / pi) % 36000
        return self._frame(
            HIL_GPS,
            time_us,
            int(sample["fix_type"]),
            round(lat_deg * 1e7),
            round(lon_deg * 1e7),
            round(alt_m * 1e3),
            _centi(sample["pos_h_std"]),
            _centi(sample["pos_v_std"]),
            min(round(hypot(vn, ve)), 65534),
            vn,
            ve,
            vd,
            course_cdeg,
            int(sample["satellites"]),
            0,
            _UNKNOWN_YAW,
        )

    def distance(self, time_us: int, sample: Any) -> bytes:
        """DISTANCE_SENSOR of a new sample of the range finder that looks down."""
        distance_cm = round(100.0 * float(sample["distance_m"])) if sample["is_valid"] else _MAX_CM + 1
        return self._frame(
            DISTANCE, time_us // 1000, _MIN_CM, _MAX_CM, distance_cm, LASER, 0, LOOKS_DOWN, COVARIANCE_UNKNOWN
        )

    def truth(self, time_us: int, truth: Any) -> bytes:
        """HIL_STATE_QUATERNION, for PX4's log of the truth alone."""
        x, y, z, w = truth["q_ned_from_frd"].tolist()
        lat_deg, lon_deg, alt_m = self._position(truth["pos_ned"])
        return self._frame(
            HIL_STATE,
            time_us,
            (w, x, y, z),
            *truth["omega_frd"].tolist(),
            round(lat_deg * 1e7),
            round(lon_deg * 1e7),
            round(alt_m * 1e3),
            *(_short(100.0 * part) for part in truth["vel_ned"].tolist()),
            0,
            0,
            *(_short(_G_MILLI * part) for part in truth["accel_frd"].tolist()),
        )

    def _position(self, pos_ned: Any) -> tuple[float, float, float]:
        north, east, down = pos_ned.tolist()
        return geodetic_from_ned(north, east, down, self._home)

    def _frame(self, kind: MessageType, *values: Any) -> bytes:
        self._seq = self._seq + 1 & 0xFF
        return frame_bytes(kind, kind.pack(*values), self._seq, SYSTEM_ID, COMPONENT_ID)


def _centi(value_m: Any) -> int:
    return min(max(round(100.0 * float(value_m)), 1), 65534)


def _short(value: float) -> int:
    return min(max(round(value), -32768), 32767)
