"""The estimator's parameters: declared once, copied into `EstimatorParams` rows for the kernels.

Names are PX4's where the meaning is. Defaults describe the default sensors: an inertial sensor of the BMI088 class on
a shaking airframe, and a receiver, barometer, magnetometer and range finder as in the projects' airframe files.
"""

from typing import Any

import warp as wp

from autopilot.estimator.airspeed_params import airspeed_fields
from autopilot.estimator.calibration_params import CALIBRATION_PARAMETERS
from autopilot.estimator.mag_params import MAG_PARAMETERS
from autopilot.estimator.wheel_params import wheel_fields
from common.params import Parameter, ParameterTable

wp.set_module_options({"enable_backward": False})

# EKF2_GPS_CTRL
GPS_CTRL_POS = wp.constant(1)
GPS_CTRL_HEIGHT = wp.constant(2)
GPS_CTRL_VEL = wp.constant(4)

MAG_TYPE_NONE = wp.constant(5)

# EKF2_MAG_CHECK
MAG_CHECK_STRENGTH = wp.constant(1)
MAG_CHECK_INCLINATION = wp.constant(2)

HEIGHT_REF_GNSS = wp.constant(1)


@wp.struct
class EstimatorParams:
    earth_field_ned_gauss: wp.vec3  # world magnetic model at the origin; zero: unknown
    gyro_offset_x: float
    gyro_offset_y: float
    gyro_offset_z: float
    accel_offset_x: float
    accel_offset_y: float
    accel_offset_z: float
    mag_offset_x: float
    mag_offset_y: float
    mag_offset_z: float
    mag_yaw: float
    board_roll: float
    board_pitch: float
    board_yaw: float
    delay_s: float
    predict_s: float
    gyro_noise: float
    accel_noise: float
    gyro_bias_walk: float
    accel_bias_walk: float
    gyro_bias_init: float
    accel_bias_init: float
    accel_bias_limit: float
    manoeuvre_accel: float
    manoeuvre_rate: float
    manoeuvre_tau_s: float
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
    mag_check: int
    mag_check_strength: float
    mag_check_inclination: float
    rest_height: float
    boot_std: float
    range_ctrl: int
    range_noise: float
    range_noise_fraction: float
    range_gate: float
    terrain_walk: float
    terrain_gradient: float
    drag_ctrl: int
    drag_noise: float
    drag_linear: float
    drag_ballistic_x: float
    drag_ballistic_y: float
    wind_walk: float
    external_ctrl: int
    external_pos_gate: float
    external_vel_gate: float
    airspeed_checks: int
    airspeed_innov: float  # [m/s]
    airspeed_stop_s: float
    airspeed_start_s: float
    wheel_ctrl: int
    wheel_noise: float
    wheel_scale_std: float
    wheel_slip: float
    wheel_side_noise: float
    wheel_gate: float
    wheel_x: float
    wheel_track: float
    wheel_valid_s: float
    external_vel_valid_s: float


_BMI088 = "BMI088 data sheet and vibration of a 10-inch quadcopter (guess)"
_TUNED = "tuned on simulated flights: innovations inside their 95 % band"
_RECEIVER = "receiver model: 0.3 m white, 0.6 m over 60 s, 0.1 m/s"
_PX4 = "PX4 default"


ESTIMATOR_PARAMETERS: list[Parameter] = [
    *CALIBRATION_PARAMETERS,
    Parameter(
        "EKF2_DELAY_MAX",
        140.0,
        0.0,
        220.0,
        "ms",
        "age of the fusion horizon",
        "GNSS 120 ms late, and 5 samples",
        "delay_s",
    ),
    Parameter("EKF2_PREDICT_US", 8000, 4000, 20000, "us", "interval of the covariance prediction", _PX4, "predict_s"),
    Parameter("EKF2_GYR_NOISE", 0.006, 0.0001, 0.1, "rad/s", "gyro noise of one 4 ms sample", _BMI088, "gyro_noise"),
    Parameter(
        "EKF2_ACC_NOISE", 0.35, 0.01, 1.0, "m/s^2", "accelerometer noise of one 4 ms sample", _PX4, "accel_noise"
    ),
    Parameter(
        "EKF2_GYR_B_NOISE",
        1.0e-5,
        0.0,
        0.01,
        "rad/s/sqrt(s)",
        "random walk of the gyro bias",
        "guess",
        "gyro_bias_walk",
    ),
    Parameter(
        "EKF2_ACC_B_NOISE",
        5.0e-4,
        0.0,
        0.1,
        "m/s^2/sqrt(s)",
        "random walk of the accelerometer bias",
        "guess",
        "accel_bias_walk",
    ),
    Parameter(
        "EKF2_GBIAS_INIT",
        0.02,
        0.0,
        0.2,
        "rad/s",
        "turn-on gyro bias if never averaged at rest",
        "BMI088 data sheet",
        "gyro_bias_init",
    ),
    Parameter(
        "EKF2_ABIAS_INIT",
        0.05,
        0.0,
        0.5,
        "m/s^2",
        "turn-on accelerometer bias",
        "guess: 5 mg after calibration",
        "accel_bias_init",
    ),
    Parameter("EKF2_ABL_LIM", 0.4, 0.0, 0.8, "m/s^2", "limit of the accelerometer bias", _PX4, "accel_bias_limit"),
    Parameter(
        "EKF2_ABL_ACCLIM",
        25.0,
        20.0,
        200.0,
        "m/s^2",
        "specific force above which the accelerometer bias is not learned",
        _PX4,
        "manoeuvre_accel",
    ),
    Parameter(
        "EKF2_ABL_GYRLIM",
        3.0,
        2.0,
        20.0,
        "rad/s",
        "angular rate above which the accelerometer bias is not learned",
        _PX4,
        "manoeuvre_rate",
    ),
    Parameter(
        "EKF2_ABL_TAU", 0.5, 0.1, 1.0, "s", "time constant with which their maxima decay", _PX4, "manoeuvre_tau_s"
    ),
    Parameter("EKF2_GYR_B_LIM", 0.15, 0.0, 0.4, "rad/s", "limit of the gyro bias", _PX4, "gyro_bias_limit"),
    Parameter("EKF2_ANGERR_INIT", 0.1, 0.0, 0.5, "rad", "tilt error after alignment", _PX4, "tilt_init"),
    Parameter(
        "EKF2_TAU_VEL", 0.25, 0.05, 1.0, "s", "time constant of the output predictor's velocity", _PX4, "tau_vel_s"
    ),
    Parameter(
        "EKF2_TAU_POS", 0.25, 0.05, 1.0, "s", "time constant of the output predictor's position", _PX4, "tau_pos_s"
    ),
    Parameter(
        "EKF2_NOAID_TOUT", 5000.0, 500.0, 10000.0, "ms", "dead reckoning until position is invalid", _PX4, "no_aid_s"
    ),
    Parameter("EKF2_HGT_REF", 0, 0, 1, "", "height reference: 0 barometer, 1 GNSS", "the smaller drift", "height_ref"),
    Parameter("EKF2_GPS_CTRL", 7, 0, 7, "", "GNSS use: 1 horizontal position, 2 height, 4 velocity", _PX4, "gnss_ctrl"),
    Parameter(
        "EKF2_GPS_P_NOISE",
        0.3,
        0.01,
        10.0,
        "m",
        "GNSS position noise, white; vertical 1.5 times",
        _RECEIVER,
        "gnss_pos_noise",
    ),
    Parameter("EKF2_GPS_V_NOISE", 0.1, 0.01, 5.0, "m/s", "GNSS velocity noise per axis", _RECEIVER, "gnss_vel_noise"),
    Parameter("EKF2_GPS_P_GATE", 5.0, 1.0, 50.0, "SD", "GNSS position gate", _PX4, "gnss_pos_gate"),
    Parameter("EKF2_GPS_V_GATE", 5.0, 1.0, 50.0, "SD", "GNSS velocity gate", _PX4, "gnss_vel_gate"),
    Parameter(
        "EKF2_GPS_CORR", 0.6, 0.0, 10.0, "m", "GNSS position wander; vertical 1.5 times", _RECEIVER, "gnss_wander"
    ),
    Parameter(
        "EKF2_GPS_CORR_T", 60.0, 1.0, 3600.0, "s", "time constant of the GNSS wander", _RECEIVER, "gnss_wander_time"
    ),
    Parameter("EKF2_REQ_FIX", 3, 0, 6, "", "least GNSS fix type", _PX4, "gnss_min_fix"),
    Parameter("EKF2_REQ_NSATS", 6, 4, 12, "", "least number of satellites", _PX4, "gnss_min_satellites"),
    Parameter("EKF2_REQ_EPH", 3.0, 0.5, 100.0, "m", "largest horizontal accuracy figure", _PX4, "gnss_max_pos_h_std"),
    Parameter("EKF2_REQ_EPV", 5.0, 0.5, 100.0, "m", "largest vertical accuracy figure", _PX4, "gnss_max_pos_v_std"),
    Parameter("EKF2_REQ_SACC", 0.5, 0.1, 5.0, "m/s", "largest speed accuracy figure", _PX4, "gnss_max_vel_std"),
    Parameter("EKF2_BARO_CTRL", 1, 0, 1, "", "barometer use: 0 off, 1 on", _PX4, "baro_ctrl"),
    Parameter(
        "EKF2_BARO_NOISE",
        0.11,
        0.01,
        15.0,
        "m",
        "barometer noise, white",
        "MS5611 data sheet: 0.012 mbar",
        "baro_noise",
    ),
    Parameter(
        "EKF2_BARO_WALK",
        0.03,
        0.0,
        1.0,
        "m/sqrt(s)",
        "wander of the barometer",
        "0.35 m sqrt(2 / 300 s), guess",
        "baro_walk",
    ),
    Parameter("EKF2_BARO_GATE", 5.0, 1.0, 50.0, "SD", "barometer gate", _PX4, "baro_gate"),
    *MAG_PARAMETERS,
    Parameter(
        "EKF2_MIN_RNG", 0.2, 0.0, 2.0, "m", "height above ground at boot", "airframe: landing gear", "rest_height"
    ),
    Parameter(
        "EKF2_BOOT_STD",
        100.0,
        0.01,
        1000.0,
        "m",
        "how well the vehicle is known to boot at the origin of ned; large: not at all",
        "a vehicle set down anywhere",
        "boot_std",
    ),
    Parameter("EKF2_RNG_CTRL", 1, 0, 1, "", "range finder use: 0 off, 1 terrain height", _PX4, "range_ctrl"),
    Parameter("EKF2_RNG_NOISE", 0.02, 0.01, 5.0, "m", "range finder noise", "TF02-Pro data sheet: 6 cm", "range_noise"),
    Parameter(
        "EKF2_RNG_SFE",
        0.0033,
        0.0,
        0.2,
        "m/m",
        "range finder noise per distance",
        "TF02-Pro data sheet: 1 %",
        "range_noise_fraction",
    ),
    Parameter("EKF2_RNG_GATE", 5.0, 1.0, 50.0, "SD", "range finder gate", _PX4, "range_gate"),
    Parameter(
        "EKF2_TERR_NOISE", 0.02, 0.0, 10.0, "m/sqrt(s)", "random walk of the terrain height", _TUNED, "terrain_walk"
    ),
    Parameter("EKF2_TERR_GRAD", 0.1, 0.0, 5.0, "m/m", "slope of the terrain", _TUNED, "terrain_gradient"),
    Parameter(
        "EKF2_DRAG_CTRL", 1, 0, 2, "", "drag: 0 off, 1 wind, 2 velocity too if nothing else", _TUNED, "drag_ctrl"
    ),
    Parameter(
        "EKF2_DRAG_NOISE", 0.5, 0.05, 10.0, "m/s^2", "noise of the drag acceleration over 40 ms", _TUNED, "drag_noise"
    ),
    Parameter("EKF2_MCOEF", 0.14, 0.0, 1.0, "1/s", "propeller drag per airspeed", "airframe: drag", "drag_linear"),
    Parameter(
        "EKF2_BCOEF_X",
        75.0,
        0.0,
        200.0,
        "kg/m^2",
        "ballistic coefficient along x, 0: none",
        "airframe: drag area",
        "drag_ballistic_x",
    ),
    Parameter(
        "EKF2_BCOEF_Y",
        75.0,
        0.0,
        200.0,
        "kg/m^2",
        "ballistic coefficient along y, 0: none",
        "airframe: drag area",
        "drag_ballistic_y",
    ),
    Parameter(
        "EKF2_EV_CTRL",
        0,
        0,
        15,
        "",
        "use of positions from outside: 1 horizontal position, 2 height, 4 velocity, 8 heading",
        "15 in PX4: here nothing from outside is believed unasked",
        "external_ctrl",
    ),
    Parameter(
        "EKF2_EVP_GATE", 5.0, 1.0, 50.0, "SD", "gate of position and heading from outside", _PX4, "external_pos_gate"
    ),
    Parameter("EKF2_EVV_GATE", 3.0, 1.0, 50.0, "SD", "gate of velocity from outside", _PX4, "external_vel_gate"),
    Parameter(
        "EKF2_EVV_TOUT",
        30.0,
        0.0,
        3600.0,
        "s",
        "dead reckoning on velocity from outside until position is invalid",
        "flown: 25 to 30 s by visual odometry; PX4 has no such bound",
        "external_vel_valid_s",
    ),
    Parameter("EKF2_WIND_NSD", 0.1, 0.0, 1.0, "m/s/sqrt(s)", "random walk of the wind", "guess: gusts", "wind_walk"),
]


def estimator_fields(table: ParameterTable) -> dict[str, float]:
    """Fields of `EstimatorParams` and their values in SI."""
    fields = table.fields(ESTIMATOR_PARAMETERS) | wheel_fields(table) | airspeed_fields(table)
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
