"""The names under which ArduPilot's users and ground stations look for parameters.

An alias is one of our parameters under ArduPilot's name, in ArduPilot's unit: setting it sets ours. A constant is there
to be read only. Names that are ArduPilot's and ours alike (RC1_MIN) are in neither list.
"""

from collections.abc import Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.dialects import Alias, Constant

INT8 = mavlink.MAV_PARAM_TYPE_INT8
INT16 = mavlink.MAV_PARAM_TYPE_INT16
INT32 = mavlink.MAV_PARAM_TYPE_INT32
REAL32 = mavlink.MAV_PARAM_TYPE_REAL32
CM = 100.0  # per metre
MS = 1000.0  # per second

# Failsafe actions. Ours are PX4's: 0 none, 1 hold, 2 return, 3 land; for the fence 1 warn, 2 hold, 3 return, 5 land.
_THROTTLE_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 3: 3, 7: 4, 1: 7}
_STATION_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 7: 3, 3: 5, 1: 7}
_FENCE_ACTIONS: Mapping[int, int] = {1: 0, 0: 0, 2: 4, 3: 1, 5: 2, 6: 3}
_BATTERY_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 3: 2}
# Modes of a switch: PX4's COM_FLTMODE numbers to mode numbers of a copter.
_SWITCH_MODES: Mapping[int, int] = {8: 0, 6: 1, 1: 2, 3: 3, 7: 4, 4: 5, 5: 6, 11: 9, 2: 16, 12: 23}
# Positions from outside: none, by MAVLink; the heading stays the compass's unless EKF2_EV_CTRL itself says otherwise.
_VISION_TYPES: Mapping[int, int] = {0: 0, 7: 1} | dict.fromkeys(range(1, 16), 1)
# Heading on mission legs: towards the next waypoint, along the way.
_YAW_MODES: Mapping[int, int] = {0: 1, 3: 3}

ALIASES: tuple[Alias, ...] = (
    Alias("ACRO_Y_RATE", "MC_ACRO_Y_MAX", REAL32),
    Alias("ANGLE_MAX", "MPC_TILTMAX_AIR", INT16, 100.0),
    Alias("ATC_RATE_P_MAX", "MC_PITCHRATE_MAX", REAL32),
    Alias("ATC_RATE_R_MAX", "MC_ROLLRATE_MAX", REAL32),
    Alias("ATC_RATE_Y_MAX", "MC_YAWRATE_MAX", REAL32),
    Alias("BATT_CAPACITY", "BAT1_CAPACITY", INT32),
    Alias("BATT_FS_CRT_ACT", "COM_LOW_BAT_ACT", INT8, numbers=_BATTERY_ACTIONS),
    Alias("CIRCLE_RADIUS", "NAV_LOITER_RAD", REAL32, CM),
    Alias("DISARM_DELAY", "COM_DISARM_LAND", INT8),
    Alias("FENCE_ACTION", "GF_ACTION", INT8, numbers=_FENCE_ACTIONS),
    Alias("FENCE_ALT_MAX", "GF_MAX_VER_DIST", REAL32),
    Alias("FENCE_ALT_MIN", "GF_MIN_ALT", REAL32),
    Alias("FENCE_ENABLE", "GF_ENABLE", INT8),
    Alias("FENCE_MARGIN", "GF_MARGIN", REAL32),
    Alias("FENCE_RADIUS", "GF_MAX_HOR_DIST", REAL32),
    Alias("FENCE_TYPE", "GF_TYPES", INT8),
    Alias("FLTMODE_CH", "RC_MAP_FLTMODE", INT8),
    *(Alias(f"FLTMODE{i}", f"COM_FLTMODE{i}", INT8, numbers=_SWITCH_MODES) for i in range(1, 7)),
    Alias("FRAME_CLASS", "SYS_AUTOSTART", INT8, numbers={4001: 1, 6001: 2, 8001: 3}),
    Alias("FS_GCS_ENABLE", "NAV_DLL_ACT", INT8, numbers=_STATION_ACTIONS),
    Alias("FS_GCS_TIMEOUT", "COM_DL_LOSS_T", REAL32),
    Alias("FS_THR_ENABLE", "NAV_RCL_ACT", INT8, numbers=_THROTTLE_ACTIONS),
    Alias("LAND_SPEED", "MPC_LAND_SPEED", INT16, CM),
    Alias("LOIT_SPEED", "MPC_XY_VEL_MAX", REAL32, CM),
    Alias("PILOT_SPEED_DN", "MPC_Z_VEL_MAX_DN", INT16, CM),
    Alias("PILOT_SPEED_UP", "MPC_Z_VEL_MAX_UP", INT16, CM),
    Alias("PILOT_Y_RATE", "MPC_MAN_Y_MAX", REAL32),
    Alias("PILOT_TKOFF_ALT", "MIS_TAKEOFF_ALT", REAL32, CM),
    *(Alias(f"RC{i}_REVERSED", f"RC{i}_REV", INT8, numbers={1: 0, -1: 1}) for i in range(1, 9)),
    *(Alias(f"RCMAP_{stick}", f"RC_MAP_{stick}", INT8) for stick in ("ROLL", "PITCH", "THROTTLE", "YAW")),
    Alias("RC_FS_TIMEOUT", "COM_RC_LOSS_T", REAL32),
    Alias("RTL_ALT", "RTL_RETURN_ALT", INT32, CM),
    Alias("RTL_LOIT_TIME", "RTL_LAND_DELAY", INT32, MS),
    Alias("RTL_SPEED", "RTL_RETURN_SPD", INT16, CM),
    Alias("SYSID_THISMAV", "MAV_SYS_ID", INT16),
    Alias("VISO_DELAY_MS", "EKF2_EV_DELAY", INT16),
    Alias("VISO_POS_M_NSE", "EKF2_EVP_NOISE", REAL32),
    Alias("VISO_TYPE", "EKF2_EV_CTRL", INT8, numbers=_VISION_TYPES),
    Alias("VISO_VEL_M_NSE", "EKF2_EVV_NOISE", REAL32),
    Alias("VISO_YAW_M_NSE", "EKF2_EVA_NOISE", REAL32),
    Alias("WPNAV_ACCEL", "MPC_ACC_HOR", REAL32, CM),
    Alias("WPNAV_RADIUS", "NAV_ACC_RAD", REAL32, CM),
    Alias("WPNAV_SPEED", "MPC_XY_CRUISE", REAL32, CM),
    Alias("WPNAV_SPEED_DN", "MPC_Z_V_AUTO_DN", REAL32, CM),
    Alias("WPNAV_SPEED_UP", "MPC_Z_V_AUTO_UP", REAL32, CM),
    Alias("WP_YAW_BEHAVIOR", "MPC_YAW_MODE", INT8, numbers=_YAW_MODES),
)

_AXES = "XYZ"
CONSTANTS: tuple[Constant, ...] = (
    Constant("ARMING_CHECK", 1, INT32, "all checks; they cannot be switched off"),
    Constant("ARMING_REQUIRE", 1, INT8, "it must be armed before the rotors turn"),
    Constant("BATT_MONITOR", 4, INT8, "voltage and current"),
    Constant("COMPASS_DEV_ID", 97_539, INT32, "a magnetometer"),
    Constant("COMPASS_DEV_ID2", 0, INT32, "no second magnetometer"),
    Constant("COMPASS_DEV_ID3", 0, INT32, "no third magnetometer"),
    Constant("COMPASS_USE", 1, INT8, "the magnetometer is used"),
    Constant("COMPASS_USE2", 0, INT8, "no second magnetometer"),
    Constant("COMPASS_USE3", 0, INT8, "no third magnetometer"),
    *(Constant(f"COMPASS_OFS_{axis}", 1.0, REAL32, "calibrated") for axis in _AXES),
    *(Constant(f"COMPASS_OFS2_{axis}", 0.0, REAL32, "no second magnetometer") for axis in _AXES),
    *(Constant(f"COMPASS_OFS3_{axis}", 0.0, REAL32, "no third magnetometer") for axis in _AXES),
    Constant("FOLL_ALT_TYPE", 1, INT8, "height above home; see FLW_TGT_ALT_M"),
    Constant("FOLL_DIST_MAX", 0.0, REAL32, "any distance"),
    Constant("FOLL_ENABLE", 1, INT8, "mode Follow may be chosen"),
    *(Constant(f"FOLL_OFS_{axis}", 0.0, REAL32, "see FLW_TGT_DST, _FA, _HT") for axis in _AXES),
    Constant("FOLL_OFS_TYPE", 1, INT8, "relative to the course of the target"),
    Constant("FOLL_POS_P", 0.1, REAL32, "see FLW_TGT_RS"),
    Constant("FOLL_SYSID", 0, INT16, "any target"),
    Constant("FOLL_YAW_BEHAVE", 1, INT8, "faces the target"),
    Constant("FRAME_TYPE", 1, INT8, "as an X"),
    *(Constant(f"INS_ACCOFFS_{axis}", 0.001, REAL32, "calibrated") for axis in _AXES),
    *(Constant(f"INS_ACCSCAL_{axis}", 1.0, REAL32, "calibrated") for axis in _AXES),
    Constant("STAT_FLTTIME", 0, INT32, "flight time is not counted from one start to the next"),
    Constant("SYSID_MYGCS", 255, INT16, "any ground station may fly it"),
)
