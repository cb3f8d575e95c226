"""What ArduPilot's clients look for on a Copter: its names of our parameters, and names that can be read only."""

from collections.abc import Mapping

from autopilot.interface.ardupilot_vehicle import CM, INT8, INT16, INT32, REAL32, Alias, ArduPilotVehicle, Constant

MS = 1000.0  # per second

# Failsafe actions. Ours are PX4's: 0 none, 1 hold, 2 return, 3 land.
_THROTTLE_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 3: 3, 7: 4, 1: 7}
_STATION_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 7: 3, 3: 5, 1: 7}
# Estimator failures: nothing, land. Ours has more.
_ESTIMATOR_ACTIONS: Mapping[int, int] = {0: 0, 3: 1}

# Functions of outputs 5 to 8: motors, where the airframe has so many.
_SIX, _EIGHT = 6001, 8001
# Heading on mission legs: towards the next waypoint, along the way.
_YAW_MODES: Mapping[int, int] = {0: 1, 3: 3}

# Gains from position and velocity; ArduPilot's have the same units, under its names up to 4.6 and since.
_POSITION_GAINS: Mapping[str, str] = {
    "POSXY_P": "XY_P", "NE_POS_P": "XY_P", "POSZ_P": "Z_P", "D_POS_P": "Z_P",
    "VELXY_P": "XY_VEL_P_ACC", "VELXY_I": "XY_VEL_I_ACC", "VELXY_D": "XY_VEL_D_ACC",
    "NE_VEL_P": "XY_VEL_P_ACC", "NE_VEL_I": "XY_VEL_I_ACC", "NE_VEL_D": "XY_VEL_D_ACC",
    "VELZ_P": "Z_VEL_P_ACC", "VELZ_I": "Z_VEL_I_ACC", "VELZ_D": "Z_VEL_D_ACC",
    "D_VEL_P": "Z_VEL_P_ACC", "D_VEL_I": "Z_VEL_I_ACC", "D_VEL_D": "Z_VEL_D_ACC",
}  # fmt: skip

_RATE_LOOP = "ArduPilot's default; the rate loop's own gains are MC_RPRATE_*_ACC and MC_YAWRATE_*_ACC"
_CURVE = "ArduPilot's default; the airframe file has the motors' curve"
_ACCEL = "ArduPilot's default; the motors limit the angular acceleration"
_NO_LIMIT = "not limited: the control allocation knows the voltage"

COPTER = ArduPilotVehicle(
    name="Copter",
    version=(4, 7, 0),  # newer than any release: no station asks for an update
    aliases=(
        Alias("ACRO_Y_RATE", "MC_ACRO_Y_MAX", REAL32),
        Alias("ANGLE_MAX", "MPC_TILTMAX_AIR", INT16, 100.0),
        Alias("ATC_ANG_PIT_P", "MC_PITCH_P", REAL32),
        Alias("ATC_ANG_RLL_P", "MC_ROLL_P", REAL32),
        Alias("ATC_ANG_YAW_P", "MC_YAW_P", REAL32),
        Alias("ATC_RATE_P_MAX", "MC_PITCHRATE_MAX", REAL32),
        Alias("ATC_RATE_R_MAX", "MC_ROLLRATE_MAX", REAL32),
        Alias("ATC_RATE_Y_MAX", "MC_YAWRATE_MAX", REAL32),
        Alias("ATC_SLEW_YAW", "MPC_YAWRAUTO_MAX", REAL32, 100.0),
        Alias("CIRCLE_RADIUS", "NAV_LOITER_RAD", REAL32, CM),
        Alias("FLTMODE_CH", "RC_MAP_FLTMODE", INT8),
        Alias("FRAME_CLASS", "SYS_AUTOSTART", INT8, numbers={4001: 1, 6001: 2, 8001: 3}),
        Alias("FS_CRASH_CHECK", "CBRK_FLIGHTTERM", INT8, numbers={0: 1, 121212: 0}),
        Alias("FS_EKF_ACTION", "COM_EST_FAIL_ACT", INT8, numbers=_ESTIMATOR_ACTIONS),
        Alias("FS_GCS_ENABLE", "NAV_DLL_ACT", INT8, numbers=_STATION_ACTIONS),
        Alias("FS_THR_ENABLE", "NAV_RCL_ACT", INT8, numbers=_THROTTLE_ACTIONS),
        Alias("LAND_SPEED", "MPC_LAND_SPEED", INT16, CM),
        Alias("LOIT_SPEED", "MPC_XY_VEL_MAX", REAL32, CM),
        Alias("MOT_THST_HOVER", "MPC_THR_HOVER", REAL32),
        Alias("PILOT_SPEED_DN", "MPC_Z_VEL_MAX_DN", INT16, CM),
        Alias("PILOT_SPEED_UP", "MPC_Z_VEL_MAX_UP", INT16, CM),
        Alias("PILOT_TKOFF_ALT", "MIS_TAKEOFF_ALT", REAL32, CM),
        Alias("PILOT_Y_RATE", "MPC_MAN_Y_MAX", REAL32),
        Alias("PSC_JERK_XY", "MPC_JERK_AUTO", REAL32),
        *(Alias(f"PSC_{theirs}", f"MPC_{ours}", REAL32) for theirs, ours in _POSITION_GAINS.items()),
        Alias("RTL_ALT", "RTL_RETURN_ALT", INT32, CM),
        Alias("RTL_ALT_FINAL", "RTL_DESCEND_ALT", INT16, CM),
        Alias("RTL_LOIT_TIME", "RTL_LAND_DELAY", INT32, MS),
        Alias("RTL_SPEED", "RTL_RETURN_SPD", INT16, CM),
        *(
            Alias(f"SERVO{i}_FUNCTION", "SYS_AUTOSTART", INT16, numbers={4001: 0, _SIX: 32 + i, _EIGHT: 32 + i})
            for i in (5, 6)
        ),
        *(
            Alias(f"SERVO{i}_FUNCTION", "SYS_AUTOSTART", INT16, numbers={4001: 0, _SIX: 0, _EIGHT: 32 + i})
            for i in (7, 8)
        ),
        Alias("WPNAV_ACCEL", "MPC_ACC_HOR", REAL32, CM),
        Alias("WPNAV_RADIUS", "NAV_ACC_RAD", REAL32, CM),
        Alias("WPNAV_SPEED", "MPC_XY_CRUISE", REAL32, CM),
        Alias("WPNAV_SPEED_DN", "MPC_Z_V_AUTO_DN", REAL32, CM),
        Alias("WPNAV_SPEED_UP", "MPC_Z_V_AUTO_UP", REAL32, CM),
        Alias("WP_YAW_BEHAVIOR", "MPC_YAW_MODE", INT8, numbers=_YAW_MODES),
    ),
    constants=(
        Constant("ATC_ACCEL_P_MAX", 110_000.0, REAL32, _ACCEL),
        Constant("ATC_ACCEL_R_MAX", 110_000.0, REAL32, _ACCEL),
        Constant("ATC_ACCEL_Y_MAX", 27_000.0, REAL32, _ACCEL),
        Constant("ATC_INPUT_TC", 0.15, REAL32, "ArduPilot's default; see MPC_MAN_Y_TAU"),
        *(
            Constant(f"ATC_RAT_{axis}_{gain}", value, REAL32, _RATE_LOOP)
            for axis, values in (
                ("RLL", (0.135, 0.135, 0.0036)),
                ("PIT", (0.135, 0.135, 0.0036)),
                ("YAW", (0.18, 0.018, 0.0)),
            )
            for gain, value in zip("PID", values, strict=True)
        ),
        Constant("FRAME_TYPE", 1, INT8, "as an X"),
        Constant("LAND_SPEED_HIGH", 0, INT16, "as WPNAV_SPEED_DN"),
        Constant("MOT_BAT_VOLT_MAX", 0.0, REAL32, _NO_LIMIT),
        Constant("MOT_BAT_VOLT_MIN", 0.0, REAL32, _NO_LIMIT),
        Constant("MOT_PWM_MAX", 2000, INT16, "pulse of a motor at full command"),
        Constant("MOT_PWM_MIN", 1000, INT16, "pulse of a motor that stands"),
        Constant("MOT_SPIN_ARM", 0.1, REAL32, _CURVE),
        Constant("MOT_SPIN_MAX", 0.95, REAL32, _CURVE),
        Constant("MOT_SPIN_MIN", 0.15, REAL32, _CURVE),
        Constant("MOT_THST_EXPO", 0.65, REAL32, _CURVE),
        Constant("MOT_HOVER_LEARN", 0, INT8, "the hover thrust is not learned"),
        *(Constant(f"SERVO{i}_FUNCTION", 32 + i, INT16, f"motor {i}") for i in range(1, 5)),
        Constant("SIMPLE", 0, INT8, "no simple mode"),
        Constant("SUPER_SIMPLE", 0, INT8, "no simple mode"),
    ),
)
