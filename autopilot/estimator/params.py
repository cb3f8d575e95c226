"""The estimator's parameters: declared once, copied into `EstimatorParams` rows for the kernels.

Names are PX4's where the meaning is. Defaults describe the default sensors: an inertial sensor of the BMI088 class on
a shaking airframe, and a receiver, barometer, magnetometer and range finder as in the projects' airframe files.
"""

from math import sqrt
from typing import Any

import numpy as np
import warp as wp

from common.airframe import Airframe
from common.kernels import GRAVITY_M_S2
from common.params import Parameter, ParameterTable

wp.set_module_options({"enable_backward": False})

# EKF2_GPS_CTRL
GPS_CTRL_POS = wp.constant(1)
GPS_CTRL_HEIGHT = wp.constant(2)
GPS_CTRL_VEL = wp.constant(4)

MAG_TYPE_NONE = wp.constant(5)

HEIGHT_REF_BARO = wp.constant(0)
HEIGHT_REF_GNSS = wp.constant(1)


@wp.struct
class EstimatorParams:
    earth_field_ned_gauss: wp.vec3  # world magnetic model at the origin; zero: unknown
    delay_s: float
    predict_s: float
    gyro_noise: float
    accel_noise: float
    gyro_bias_walk: float
    accel_bias_walk: float
    gyro_bias_init: float
    accel_bias_init: float
    accel_bias_limit: float
    gyro_bias_limit: float
    tilt_init: float
    tau_vel_s: float
    tau_pos_s: float
    no_aid_s: float
    height_ref: int
    gnss_ctrl: int
    gnss_pos_noise: float
    gnss_vel_noise: float
    gnss_pos_gate: float
    gnss_vel_gate: float
    gnss_wander: float
    gnss_wander_time: float
    gnss_min_fix: int
    gnss_min_satellites: int
    gnss_max_pos_h_std: float
    gnss_max_pos_v_std: float
    gnss_max_vel_std: float
    baro_ctrl: int
    baro_noise: float
    baro_walk: float
    baro_gate: float
    mag_type: int
    mag_noise: float
    mag_gate: float
    earth_field_walk: float
    body_field_walk: float
    body_field_init: float
    rest_height: float
    range_ctrl: int
    range_noise: float
    range_noise_share: float
    range_gate: float
    terrain_walk: float
    terrain_gradient: float
    drag_ctrl: int
    drag_noise: float
    drag_linear: float
    drag_ballistic_x: float
    drag_ballistic_y: float
    wind_walk: float


_BMI088 = "BMI088 data sheet and vibration of a 10-inch quadrotor (guess)"
_TUNED = "tuned on simulated flights: innovations inside their 95 % band"
_PX4 = "PX4 default"

ESTIMATOR_PARAMETERS: list[Parameter] = [
    Parameter("EKF2_DELAY_MAX", 140.0, 0.0, 220.0, "ms", "Age of the fusion horizon: at least the latest sensor's delay", "GNSS 120 ms late, and one sample", "delay_s"),
    Parameter("EKF2_PREDICT_US", 8000, 4000, 20000, "us", "Interval of the covariance prediction", _PX4, "predict_s"),
    Parameter("EKF2_GYR_NOISE", 0.006, 0.0001, 0.1, "rad/s", "Gyro noise of one 4 ms sample", _BMI088, "gyro_noise"),
    Parameter("EKF2_ACC_NOISE", 0.35, 0.01, 1.0, "m/s^2", "Accelerometer noise of one 4 ms sample", _PX4, "accel_noise"),
    Parameter("EKF2_GYR_B_NOISE", 1.0e-5, 0.0, 0.01, "rad/s/sqrt(s)", "Random walk of the gyro bias", "guess: 8 deg/h after a second's warm-up", "gyro_bias_walk"),
    Parameter("EKF2_ACC_B_NOISE", 5.0e-4, 0.0, 0.1, "m/s^2/sqrt(s)", "Random walk of the accelerometer bias", "guess: 5 mg in 10000 s", "accel_bias_walk"),
    Parameter("EKF2_GBIAS_INIT", 0.02, 0.0, 0.2, "rad/s", "Turn-on gyro bias when it could not be averaged at rest", "BMI088 data sheet: 1 deg/s", "gyro_bias_init"),
    Parameter("EKF2_ABIAS_INIT", 0.05, 0.0, 0.5, "m/s^2", "Turn-on accelerometer bias", "guess: 5 mg after calibration", "accel_bias_init"),
    Parameter("EKF2_ABL_LIM", 0.4, 0.0, 0.8, "m/s^2", "Limit of the accelerometer bias", _PX4, "accel_bias_limit"),
    Parameter("EKF2_GYR_B_LIM", 0.15, 0.0, 0.4, "rad/s", "Limit of the gyro bias", _PX4, "gyro_bias_limit"),
    Parameter("EKF2_ANGERR_INIT", 0.1, 0.0, 0.5, "rad", "Tilt error after alignment", _PX4, "tilt_init"),
    Parameter("EKF2_TAU_VEL", 0.25, 0.05, 1.0, "s", "Time constant of the output predictor's velocity", _PX4, "tau_vel_s"),
    Parameter("EKF2_TAU_POS", 0.25, 0.05, 1.0, "s", "Time constant of the output predictor's position", _PX4, "tau_pos_s"),
    Parameter("EKF2_NOAID_TOUT", 5000.0, 500.0, 10000.0, "ms", "Dead reckoning after which position and velocity are invalid", _PX4, "no_aid_s"),
    Parameter("EKF2_HGT_REF", 0, 0, 1, "", "Height reference: 0 barometer, 1 GNSS", "barometer: white noise of decimetres, drift of decimetres", "height_ref"),
    Parameter("EKF2_GPS_CTRL", 7, 0, 7, "", "GNSS use: 1 horizontal position, 2 height, 4 velocity", _PX4, "gnss_ctrl"),
    Parameter("EKF2_GPS_P_NOISE", 0.3, 0.01, 10.0, "m", "GNSS position noise from sample to sample, per horizontal axis; vertical 1.5 times", "receiver model: white part", "gnss_pos_noise"),
    Parameter("EKF2_GPS_V_NOISE", 0.1, 0.01, 5.0, "m/s", "GNSS velocity noise per axis", "receiver model", "gnss_vel_noise"),
    Parameter("EKF2_GPS_P_GATE", 5.0, 1.0, 50.0, "SD", "GNSS position gate", _PX4, "gnss_pos_gate"),
    Parameter("EKF2_GPS_V_GATE", 5.0, 1.0, 50.0, "SD", "GNSS velocity gate", _PX4, "gnss_vel_gate"),
    Parameter("EKF2_GPS_CORR", 0.6, 0.0, 10.0, "m", "GNSS position wander per horizontal axis; vertical 1.5 times", "receiver model: correlated part", "gnss_wander"),
    Parameter("EKF2_GPS_CORR_T", 60.0, 1.0, 3600.0, "s", "Time constant of the GNSS position wander", "receiver model: correlated part", "gnss_wander_time"),
    Parameter("EKF2_REQ_FIX", 3, 0, 6, "", "Least GNSS fix type", _PX4, "gnss_min_fix"),
    Parameter("EKF2_REQ_NSATS", 6, 4, 12, "", "Least number of satellites", _PX4, "gnss_min_satellites"),
    Parameter("EKF2_REQ_EPH", 3.0, 0.5, 100.0, "m", "Largest horizontal accuracy figure", _PX4, "gnss_max_pos_h_std"),
    Parameter("EKF2_REQ_EPV", 5.0, 0.5, 100.0, "m", "Largest vertical accuracy figure", _PX4, "gnss_max_pos_v_std"),
    Parameter("EKF2_REQ_SACC", 0.5, 0.1, 5.0, "m/s", "Largest speed accuracy figure", _PX4, "gnss_max_vel_std"),
    Parameter("EKF2_BARO_CTRL", 1, 0, 1, "", "Barometer use: 0 off, 1 on", _PX4, "baro_ctrl"),
    Parameter("EKF2_BARO_NOISE", 0.11, 0.01, 15.0, "m", "Barometer noise from sample to sample", "MS5611 data sheet: 0.012 mbar", "baro_noise"),
    Parameter("EKF2_BARO_WALK", 0.03, 0.0, 1.0, "m/sqrt(s)", "Wander of the barometer's height that the height follows", "barometer model: 0.35 m sqrt(2 / 300 s)", "baro_walk"),
    Parameter("EKF2_BARO_GATE", 5.0, 1.0, 50.0, "SD", "Barometer gate", _PX4, "baro_gate"),
    Parameter("EKF2_MAG_TYPE", 0, 0, 5, "", "Magnetometer use: 0 field states and heading, 5 none", _PX4, "mag_type"),
    Parameter("EKF2_MAG_NOISE", 1.5e-4, 1.0e-5, 1.0, "gauss", "Magnetometer noise", "RM3100 data sheet: 15 nT", "mag_noise"),
    Parameter("EKF2_MAG_GATE", 5.0, 1.0, 50.0, "SD", "Magnetometer gate", "3 in PX4, whose noise is wider", "mag_gate"),
    Parameter("EKF2_MAG_E_NOISE", 1.0e-5, 0.0, 0.1, "gauss/sqrt(s)", "Random walk of the earth field", "1e-5 gauss per kilometre of flight", "earth_field_walk"),
    Parameter("EKF2_MAG_B_NOISE", 4.0e-4, 0.0, 0.1, "gauss/sqrt(s)", "Random walk of the body field", _TUNED, "body_field_walk"),
    Parameter("EKF2_MAG_B_INIT", 5.0e-3, 0.0, 0.3, "gauss", "Body field left after calibration", "guess: hard iron 3e-3, soft iron 3e-3 of the field", "body_field_init"),
    Parameter("EKF2_MIN_RNG", 0.2, 0.0, 2.0, "m", "Height above the ground while it stands there: of the origin at boot, and of the terrain", "landing gear of the airframe", "rest_height"),
    Parameter("EKF2_RNG_CTRL", 1, 0, 1, "", "Range finder use: 0 off, 1 terrain height", _PX4, "range_ctrl"),
    Parameter("EKF2_RNG_NOISE", 0.02, 0.01, 5.0, "m", "Range finder noise", "TF02-Pro data sheet: 6 cm, three deviations", "range_noise"),
    Parameter("EKF2_RNG_SFE", 0.0033, 0.0, 0.2, "m/m", "Range finder noise per distance", "TF02-Pro data sheet: 1 %, three deviations", "range_noise_share"),
    Parameter("EKF2_RNG_GATE", 5.0, 1.0, 50.0, "SD", "Range finder gate", _PX4, "range_gate"),
    Parameter("EKF2_TERR_NOISE", 0.02, 0.0, 10.0, "m/sqrt(s)", "Random walk of the terrain height", _TUNED, "terrain_walk"),
    Parameter("EKF2_TERR_GRAD", 0.1, 0.0, 5.0, "m/m", "Slope of the terrain", _TUNED, "terrain_gradient"),
    Parameter("EKF2_DRAG_CTRL", 1, 0, 2, "", "Drag fusion: 0 off, 1 wind only, 2 also velocity while nothing else measures it", "measured: harmless to the other states", "drag_ctrl"),
    Parameter("EKF2_DRAG_NOISE", 0.5, 0.05, 10.0, "m/s^2", "Noise of the drag acceleration averaged over 40 ms", _TUNED, "drag_noise"),
    Parameter("EKF2_MCOEF", 0.14, 0.0, 1.0, "1/s", "Rotor drag per airspeed", "x500 airframe: rotor drag at hover over mass", "drag_linear"),
    Parameter("EKF2_BCOEF_X", 75.0, 0.0, 200.0, "kg/m^2", "Ballistic coefficient along x, 0: none", "x500 airframe: mass over drag area", "drag_ballistic_x"),
    Parameter("EKF2_BCOEF_Y", 75.0, 0.0, 200.0, "kg/m^2", "Ballistic coefficient along y, 0: none", "x500 airframe: mass over drag area", "drag_ballistic_y"),
    Parameter("EKF2_WIND_NSD", 0.1, 0.0, 1.0, "m/s/sqrt(s)", "Random walk of the wind", "guess: gusts", "wind_walk"),
]  # fmt: skip


def airframe_parameters(airframe: Airframe) -> dict[str, float]:
    """Parameters that follow from the airframe: landing gear and drag."""
    mass = airframe.body.mass_kg
    thrust = mass * GRAVITY_M_S2 / len(airframe.rotors)
    hover_speed = sqrt(thrust / airframe.rotor_model.thrust_n_s2)
    return {
        "EKF2_MIN_RNG": airframe.contact.leg_z_m,
        "EKF2_MCOEF": len(airframe.rotors) * airframe.rotor_model.drag_n_s2_m * hover_speed / mass,
        "EKF2_BCOEF_X": mass / airframe.body.drag_area_x_m2,
        "EKF2_BCOEF_Y": mass / airframe.body.drag_area_y_m2,
    }


def estimator_fields(table: ParameterTable) -> dict[str, float]:
    """Fields of `EstimatorParams` and their values in SI."""
    fields = table.fields(ESTIMATOR_PARAMETERS)
    fields["predict_s"] *= 1.0e-6
    return fields


def estimator_params(
    table: ParameterTable | None = None, earth_field_ned_gauss: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Any:
    """One `EstimatorParams` from a parameter table (defaults where None) and the magnetic field at the origin."""
    params = EstimatorParams()
    for name, value in estimator_fields(table or ParameterTable(ESTIMATOR_PARAMETERS)).items():
        setattr(params, name, value)
    params.earth_field_ned_gauss = wp.vec3(*earth_field_ned_gauss)
    return params


def fill_params(rows: "np.ndarray[Any, Any]", table: ParameterTable) -> None:
    """Writes the table into a live view of parameter rows (`ekf.params.numpy()`, or a slice of it); keeps the field."""
    for name, value in estimator_fields(table).items():
        rows[name] = value
