"""What ArduPilot's clients look for on a Rover: its names of our parameters."""

from autopilot.interface.ardupilot_vehicle import INT8, REAL32, Alias, ArduPilotVehicle

APM_ROVER = ArduPilotVehicle(
    name="Rover",
    version=(4, 7, 0),  # newer than any release: no station asks for an update
    aliases=(
        Alias("WP_SPEED", "RO_SPEED_LIM", REAL32),
        Alias("WP_RADIUS", "NAV_ACC_RAD", REAL32),
        Alias("ATC_ACCEL_MAX", "RO_ACCEL_LIM", REAL32),
        Alias("ATC_DECEL_MAX", "RO_DECEL_LIM", REAL32),
        Alias("ATC_STR_RAT_MAX", "RO_YAW_RATE_LIM", REAL32),
        Alias("ATC_STR_ANG_P", "RO_YAW_P", REAL32),
        Alias("FRAME_TYPE", "CA_AIRFRAME", INT8, numbers={5: 0, 6: 0}),
    ),
)
