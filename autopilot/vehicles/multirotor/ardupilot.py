"""What ArduPilot's clients look for on a Copter: names of parameters that have no meaning here and can be read only."""

from autopilot.interface.ardupilot_vehicle import ArduPilotVehicle, Constant

INT8, INT16, REAL32 = 2, 4, 9  # MAV_PARAM_TYPE

_RATE_LOOP = "ArduPilot's default; the rate loop's own gains are MC_RPRATE_*_ACC and MC_YAWRATE_*_ACC"
_CURVE = "ArduPilot's default; the airframe file has the motors' curve"
_ACCEL = "ArduPilot's default; the motors limit the angular acceleration"
_NO_LIMIT = "not limited: the control allocation knows the voltage"

COPTER = ArduPilotVehicle(
    name="Copter",
    version=(4, 7, 0),  # newer than any release: no station asks for an update
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
        Constant("SIMPLE", 0, INT8, "no simple mode"),
        Constant("SUPER_SIMPLE", 0, INT8, "no simple mode"),
    ),
)
