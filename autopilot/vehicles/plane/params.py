"""Parameters of a plane's control law, their defaults, and the kernel struct they fill: PX4's names and units."""

from collections.abc import Mapping

import warp as wp

from common.params import Parameter, ParameterTable

wp.set_module_options({"enable_backward": False})


@wp.struct
class PlaneParams:
    airspeed_min: float  # [m/s] indicated, as all airspeeds
    airspeed_trim: float
    airspeed_max: float
    roll_time: float  # [s]
    pitch_time: float
    roll_rate_max: float  # [rad/s]
    pitch_up_rate_max: float
    pitch_down_rate_max: float
    yaw_rate_max: float
    roll_ff: float  # [s/rad] command per rate at trim airspeed
    roll_p: float
    roll_i: float  # [1/rad]
    roll_imax: float
    pitch_ff: float
    pitch_p: float
    pitch_i: float
    pitch_imax: float
    pitch_trim: float
    yaw_ff: float
    yaw_p: float
    yaw_i: float
    yaw_imax: float
    roll_limit: float  # [rad]
    pitch_min: float
    pitch_max: float
    pitch_offset: float  # [rad] of level flight at trim airspeed
    pitch_lift: float  # [rad] the part of it that lifts
    airspeed_stall: float  # [m/s]
    throttle_min: float
    throttle_max: float
    throttle_trim: float
    throttle_idle: float
    throttle_slew: float  # [1/s] 0: any
    climb_max: float  # [m/s] at full throttle and trim airspeed
    sink_min: float  # [m/s] at least throttle
    sink_max: float
    climb_rate: float  # [m/s] that a climb of a mission asks for
    sink_rate: float
    height_time: float  # [s]
    airspeed_time: float
    pitch_damping: float
    pitch_integral: float
    throttle_damping: float
    throttle_integral: float
    speed_weight: float
    roll_throttle: float
    vertical_accel: float  # [m/s²]
    guidance_period: float  # [s]
    guidance_damping: float
    loiter_radius: float  # [m] positive clockwise
    wheel_p: float  # of the heading on the runway: command per error [1/rad]
    wheel_d: float  # [s/rad]
    runway_pitch: float  # [rad]
    flare_pitch_min: float  # [rad]
    flare_pitch_max: float


_PX4 = "PX4 1.16 default"
_AIRFRAME = "airframe file"

PLANE_PARAMETERS: list[Parameter] = [
    Parameter("FW_AIRSPD_MIN", 10.0, 0.5, 200.0, "m/s", "least airspeed", _AIRFRAME, "airspeed_min"),
    Parameter("FW_AIRSPD_TRIM", 15.0, 0.5, 200.0, "m/s", "airspeed of cruise", _AIRFRAME, "airspeed_trim"),
    Parameter("FW_AIRSPD_MAX", 20.0, 0.5, 200.0, "m/s", "greatest airspeed", _AIRFRAME, "airspeed_max"),
    Parameter("FW_AIRSPD_STALL", 7.0, 0.5, 200.0, "m/s", "airspeed at which it stalls", _AIRFRAME,
              "airspeed_stall"),
    Parameter("FW_R_TC", 0.4, 0.2, 1.0, "s", "time in which a bank error is to go", _PX4, "roll_time"),
    Parameter("FW_P_TC", 0.4, 0.2, 1.0, "s", "time in which a pitch error is to go", _PX4, "pitch_time"),
    Parameter("FW_R_RMAX", 70.0, 0.0, 180.0, "deg/s", "greatest roll rate", _PX4, "roll_rate_max"),
    Parameter("FW_P_RMAX_POS", 60.0, 0.0, 180.0, "deg/s", "greatest pitch rate up", _PX4, "pitch_up_rate_max"),
    Parameter("FW_P_RMAX_NEG", 60.0, 0.0, 180.0, "deg/s", "greatest pitch rate down", _PX4, "pitch_down_rate_max"),
    Parameter("FW_Y_RMAX", 50.0, 0.0, 180.0, "deg/s", "greatest yaw rate", _PX4, "yaw_rate_max"),
    Parameter("FW_RR_FF", 0.5, 0.0, 10.0, "s/rad", "ailerons per roll rate asked for", _AIRFRAME, "roll_ff"),
    Parameter("FW_RR_P", 0.05, 0.0, 10.0, "s/rad", "ailerons per roll rate error", _AIRFRAME, "roll_p"),
    Parameter("FW_RR_I", 0.1, 0.0, 10.0, "1/rad", "its integral", _PX4, "roll_i"),
    Parameter("FW_RR_IMAX", 0.2, 0.0, 1.0, "", "its greatest part", _PX4, "roll_imax"),
    Parameter("FW_PR_FF", 0.5, 0.0, 10.0, "s/rad", "elevator per pitch rate asked for", _AIRFRAME, "pitch_ff"),
    Parameter("FW_PR_P", 0.08, 0.0, 10.0, "s/rad", "elevator per pitch rate error", _AIRFRAME, "pitch_p"),
    Parameter("FW_PR_I", 0.5, 0.0, 10.0, "1/rad", "its integral", "guess: PX4's 0.1 trims in 10 s", "pitch_i"),
    Parameter("FW_PR_IMAX", 0.4, 0.0, 1.0, "", "its greatest part", _PX4, "pitch_imax"),
    Parameter("TRIM_PITCH", 0.0, -1.0, 1.0, "", "elevator of level flight at FW_AIRSPD_TRIM", _AIRFRAME,
              "pitch_trim"),
    Parameter("FW_YR_FF", 0.3, 0.0, 10.0, "s/rad", "rudder per yaw rate asked for", _PX4, "yaw_ff"),
    Parameter("FW_YR_P", 0.05, 0.0, 10.0, "s/rad", "rudder per yaw rate error", _PX4, "yaw_p"),
    Parameter("FW_YR_I", 0.1, 0.0, 10.0, "1/rad", "its integral", _PX4, "yaw_i"),
    Parameter("FW_YR_IMAX", 0.2, 0.0, 1.0, "", "its greatest part", _PX4, "yaw_imax"),
    Parameter("FW_R_LIM", 50.0, 35.0, 65.0, "deg", "greatest bank", _PX4, "roll_limit"),
    Parameter("FW_P_LIM_MIN", -30.0, -60.0, 0.0, "deg", "least pitch", _PX4, "pitch_min"),
    Parameter("FW_P_LIM_MAX", 30.0, 0.0, 60.0, "deg", "greatest pitch", _PX4, "pitch_max"),
    Parameter("FW_PSP_OFF", 0.0, -90.0, 90.0, "deg", "pitch of level flight at FW_AIRSPD_TRIM", _AIRFRAME,
              "pitch_offset"),
    Parameter("HG_FW_PSP_LIFT", 5.0, 0.0, 30.0, "deg", "the part of FW_PSP_OFF that lifts: more when slower; ours",
              _AIRFRAME, "pitch_lift"),
    Parameter("FW_MAN_R_MAX", 45.0, 0.0, 90.0, "deg", "bank at full stick", _PX4),
    Parameter("FW_MAN_P_MAX", 30.0, 0.0, 90.0, "deg", "pitch at full stick", _PX4),
    Parameter("FW_ACRO_X_MAX", 90.0, 10.0, 720.0, "deg/s", "roll rate at full stick in Acro", _PX4),
    Parameter("FW_ACRO_Y_MAX", 90.0, 10.0, 720.0, "deg/s", "pitch rate at full stick in Acro", _PX4),
    Parameter("FW_ACRO_Z_MAX", 45.0, 10.0, 720.0, "deg/s", "yaw rate at full stick in Acro", _PX4),
    Parameter("FW_THR_MIN", 0.0, 0.0, 1.0, "", "least throttle", _PX4, "throttle_min"),
    Parameter("FW_THR_MAX", 1.0, 0.0, 1.0, "", "greatest throttle", _PX4, "throttle_max"),
    Parameter("FW_THR_TRIM", 0.6, 0.0, 1.0, "", "throttle of level flight at FW_AIRSPD_TRIM", _AIRFRAME,
              "throttle_trim"),
    Parameter("FW_THR_IDLE", 0.0, 0.0, 0.4, "", "throttle on the ground, and of a flare", _PX4, "throttle_idle"),
    Parameter("FW_THR_SLEW_MAX", 0.0, 0.0, 10.0, "1/s", "change of throttle; 0: any", _PX4, "throttle_slew"),
    Parameter("FW_T_CLMB_MAX", 5.0, 1.0, 50.0, "m/s", "climb at full throttle and FW_AIRSPD_TRIM", _AIRFRAME,
              "climb_max"),
    Parameter("FW_T_SINK_MIN", 2.0, 0.1, 20.0, "m/s", "sink at least throttle and FW_AIRSPD_TRIM", _AIRFRAME,
              "sink_min"),
    Parameter("FW_T_SINK_MAX", 5.0, 1.0, 50.0, "m/s", "greatest sink", _PX4, "sink_max"),
    Parameter("FW_T_CLMB_R_SP", 3.0, 0.5, 50.0, "m/s", "climb to another height", _PX4, "climb_rate"),
    Parameter("FW_T_SINK_R_SP", 2.0, 0.5, 50.0, "m/s", "sink to another height", _PX4, "sink_rate"),
    Parameter("FW_T_ALT_TC", 5.0, 1.0, 20.0, "s", "time in which a height error is to go", _PX4, "height_time"),
    Parameter("FW_T_TAS_TC", 5.0, 1.0, 20.0, "s", "time in which an airspeed error is to go", _PX4, "airspeed_time"),
    Parameter("FW_T_PTCH_DAMP", 0.3, 0.0, 2.0, "", "pitch per error of the flight path", "guess: PX4's is 0.1",
              "pitch_damping"),
    Parameter("FW_T_I_GAIN_PIT", 0.3, 0.0, 2.0, "1/s", "its integral", "guess: PX4's is 0.1", "pitch_integral"),
    Parameter("FW_T_THR_DAMPING", 0.3, 0.0, 1.0, "", "throttle per error of the rate of all energy",
              "guess: PX4's is 0.05", "throttle_damping"),
    Parameter("FW_T_THR_INTEG", 0.1, 0.0, 1.0, "1/s", "its integral", "guess: PX4's is 0.02", "throttle_integral"),
    Parameter("FW_T_SPDWEIGHT", 1.0, 0.0, 2.0, "", "pitch holds 0 the height, 1 both, 2 the airspeed", _PX4,
              "speed_weight"),
    Parameter("FW_T_RLL2THR", 15.0, 0.0, 20.0, "m^2/s^3", "rate of energy that banking costs", _PX4, "roll_throttle"),
    Parameter("FW_T_VERT_ACC", 7.0, 1.0, 10.0, "m/s^2", "greatest change of the climb rate", _PX4, "vertical_accel"),
    Parameter("NPFG_PERIOD", 10.0, 1.0, 100.0, "s", "period of the way back to a line", _PX4, "guidance_period"),
    Parameter("NPFG_DAMPING", 0.7, 0.1, 1.0, "", "its damping", _PX4, "guidance_damping"),
    Parameter("FW_WR_P", 1.5, 0.0, 10.0, "1/rad", "nose wheel and rudder per heading error on the runway", "guess",
              "wheel_p"),
    Parameter("FW_WR_D", 0.5, 0.0, 10.0, "s/rad", "the same per yaw rate; ours", "guess", "wheel_d"),
    Parameter("FW_LND_FL_PMIN", 2.5, -5.0, 15.0, "deg", "least pitch in a flare", _PX4, "flare_pitch_min"),
    Parameter("FW_LND_FL_PMAX", 15.0, 0.0, 45.0, "deg", "greatest pitch in a flare", _PX4, "flare_pitch_max"),
    Parameter("RWTO_PSP", 0.0, -10.0, 20.0, "deg", "pitch on the runway, before it rotates", _PX4, "runway_pitch"),
]  # fmt: skip


# All vehicles have it; the law of this one reads it.
LOITER_RADIUS = Parameter("NAV_LOITER_RAD", 80.0, 1.0, 1000.0, "m", "radius of circles", _PX4, "loiter_radius")


def plane_params(fields: Mapping[str, float] | None = None) -> PlaneParams:
    """The kernel struct with the given SI fields; the declared defaults for those not given."""
    declared = [*PLANE_PARAMETERS, LOITER_RADIUS]
    defaults = ParameterTable(declared).fields(declared)
    row = PlaneParams()
    for name, value in {**defaults, **(fields or {})}.items():
        setattr(row, name, value)
    return row
