"""What ArduPilot's clients look for on a Plane: its names of our parameters."""

from autopilot.interface.ardupilot_vehicle import INT8, REAL32, Alias, ArduPilotVehicle

APM_PLANE = ArduPilotVehicle(
    name="Plane",
    version=(4, 7, 0),  # newer than any release: no station asks for an update
    aliases=(
        Alias("AIRSPEED_CRUISE", "FW_AIRSPD_TRIM", REAL32),
        Alias("AIRSPEED_MAX", "FW_AIRSPD_MAX", REAL32),
        Alias("AIRSPEED_MIN", "FW_AIRSPD_MIN", REAL32),
        Alias("AIRSPEED_STALL", "FW_AIRSPD_STALL", REAL32),
        Alias("NAVL1_DAMPING", "NPFG_DAMPING", REAL32),
        Alias("NAVL1_PERIOD", "NPFG_PERIOD", REAL32),
        Alias("PTCH_LIM_MAX_DEG", "FW_P_LIM_MAX", REAL32),
        Alias("PTCH_LIM_MIN_DEG", "FW_P_LIM_MIN", REAL32),
        Alias("ROLL_LIMIT_DEG", "FW_R_LIM", REAL32),
        Alias("TECS_CLMB_MAX", "FW_T_CLMB_MAX", REAL32),
        Alias("TECS_SINK_MAX", "FW_T_SINK_MAX", REAL32),
        Alias("TECS_SINK_MIN", "FW_T_SINK_MIN", REAL32),
        Alias("TECS_SPDWEIGHT", "FW_T_SPDWEIGHT", REAL32),
        Alias("TKOFF_THR_DELAY", "FW_LAUN_MOT_DEL", INT8, scale=10.0),  # theirs is in tenths of a second
        Alias("TKOFF_THR_MINACC", "FW_LAUN_AC_THLD", REAL32),
        Alias("WP_LOITER_RAD", "NAV_LOITER_RAD", REAL32),
        Alias("WP_RADIUS", "NAV_ACC_RAD", REAL32),
    ),
)
