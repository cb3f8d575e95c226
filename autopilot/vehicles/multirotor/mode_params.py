"""Parameters of the multirotor's modes: take-off, landing, headings, and what a deflection of the sticks asks for."""

from common.params import Parameter

_PX4 = "PX4 1.15 default"

MODE_PARAMETERS: list[Parameter] = [
    Parameter("MPC_YAW_MODE", 0, 0, 3, "",
              "heading on mission legs: 0 towards the waypoint, 1 home, 2 away from home, 3 along the way", _PX4),
    Parameter("MPC_TKO_SPEED", 1.5, 0.5, 5.0, "m/s", "climb speed of a take-off", _PX4),
    Parameter("MPC_LAND_SPEED", 0.7, 0.3, 3.0, "m/s", "descent speed from MPC_LAND_ALT2 down", _PX4),
    Parameter("MPC_LAND_CRWL", 0.3, 0.1, 3.0, "m/s", "descent speed from MPC_LAND_ALT3 down, by range finder", _PX4),
    Parameter("MPC_LAND_ALT1", 10.0, 0.0, 122.0, "m", "height above ground from which a descent slows down", _PX4),
    Parameter("MPC_LAND_ALT2", 5.0, 0.0, 122.0, "m", "height above ground at which MPC_LAND_SPEED is reached", _PX4),
    Parameter("MPC_LAND_ALT3", 1.0, 0.0, 122.0, "m", "height above ground of the slow last part", _PX4),
    Parameter("NAV_MC_ALT_RAD", 0.8, 0.05, 200.0, "m", "height error at which a waypoint counts as reached", _PX4),
    Parameter("MC_ORBIT_RAD", 20.0, 1.0, 1000.0, "m", "radius of an orbit that names none", "guess"),
    Parameter("MC_ORBIT_YAW_MOD", 0, 0, 3, "",
              "heading in an orbit: 0 to the centre, 1 as it was, 2 free, 3 along the circle", _PX4),
    Parameter("MPC_VEL_MANUAL", 10.0, 3.0, 20.0, "m/s", "speed at full stick in Position", _PX4),
    Parameter("MPC_VEL_MAN_BACK", -1.0, -1.0, 20.0, "m/s", "the same backwards, negative: as forward", _PX4),
    Parameter("MPC_VEL_MAN_SIDE", -1.0, -1.0, 20.0, "m/s", "the same sideways, negative: as forward", _PX4),
    Parameter("MPC_MAN_Y_MAX", 150.0, 0.0, 400.0, "deg/s", "yaw rate at full stick", _PX4),
    Parameter("MPC_MAN_TILT_MAX", 35.0, 1.0, 70.0, "deg", "lean at full stick in Altitude and Stabilized", _PX4),
    Parameter("MPC_XY_MAN_EXPO", 0.6, 0.0, 1.0, "", "curve of roll and pitch stick in Position, 0: straight", _PX4),
    Parameter("MPC_Z_MAN_EXPO", 0.6, 0.0, 1.0, "", "curve of the throttle stick to climb rate", _PX4),
    Parameter("MPC_YAW_EXPO", 0.6, 0.0, 1.0, "", "curve of the yaw stick to yaw rate", _PX4),
    Parameter("MPC_THR_CURVE", 0, 0, 1, "",
              "throttle stick in Stabilized and Acro: 0 hover thrust in the middle, 1 straight", _PX4),
    Parameter("MPC_THR_HOVER", 0.5, 0.1, 0.8, "norm", "thrust that carries the vehicle", _PX4),
    Parameter("MPC_MANTHR_MIN", 0.08, 0.0, 1.0, "norm", "thrust at throttle down in Stabilized", _PX4),
    Parameter("MC_ACRO_R_MAX", 100.0, 0.0, 1800.0, "deg/s", "roll rate at full stick in Acro", _PX4),
    Parameter("MC_ACRO_P_MAX", 100.0, 0.0, 1800.0, "deg/s", "pitch rate at full stick in Acro", _PX4),
    Parameter("MC_ACRO_Y_MAX", 100.0, 0.0, 1800.0, "deg/s", "yaw rate at full stick in Acro", _PX4),
    Parameter("MC_ACRO_EXPO", 0.0, 0.0, 1.0, "", "curve of roll and pitch stick in Acro", _PX4),
    Parameter("MC_ACRO_EXPO_Y", 0.0, 0.0, 1.0, "", "curve of the yaw stick in Acro", _PX4),
    Parameter("MC_ACRO_SUPEXPO", 0.0, 0.0, 0.95, "", "steepness at the ends of that curve, roll and pitch", _PX4),
    Parameter("MC_ACRO_SUPEXPOY", 0.0, 0.0, 0.95, "", "steepness at the ends of that curve, yaw", _PX4),
]  # fmt: skip
