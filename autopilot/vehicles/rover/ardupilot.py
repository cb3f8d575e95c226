"""What ArduPilot's clients look for on a Rover: its names of our parameters, and names that can be read only."""

from collections.abc import Mapping

from autopilot.interface.ardupilot_vehicle import INT8, INT16, REAL32, Alias, ArduPilotVehicle, Constant

_THROTTLE, _THROTTLE_LEFT, _THROTTLE_RIGHT, _STEERING = 70, 73, 74, 26
_CAR, _SIDES = 5, 6  # CA_AIRFRAME
# Failsafe actions. Ours are PX4's: 0 none, 1 hold, 2 return, 5 terminate, 7 smart return. FS_ACTION is one for all, and
# goes by NAV_RCL_ACT; the others say whether there is any: switched off and on again, FS_THR_ENABLE makes it Hold.
_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 1: 2, 7: 3, 5: 5}
_IS_ACTIVE: Mapping[int, int] = {0: 0, 1: 1, 2: 1, 5: 1, 6: 1, 7: 1}
_CRASH_ACTIONS: Mapping[int, int] = {0: 0, 1: 1, 6: 2}
_ESTIMATOR_ACTIONS: Mapping[int, int] = {0: 0, 1: 1}
_LAW = "ArduPilot's default; see RO_SPEED_P, RO_SPEED_I"

APM_ROVER = ArduPilotVehicle(
    name="Rover",
    switch_prefix="MODE",
    version=(4, 7, 0),  # newer than any release: no station asks for an update
    aliases=(
        Alias("ATC_ACCEL_MAX", "RO_ACCEL_LIM", REAL32),
        Alias("ATC_DECEL_MAX", "RO_DECEL_LIM", REAL32),
        Alias("ATC_STOP_SPEED", "RO_SPEED_TH", REAL32),
        Alias("ATC_STR_ACC_MAX", "RO_YAW_ACCEL_LIM", REAL32),
        Alias("ATC_STR_ANG_P", "RO_YAW_P", REAL32),
        Alias("ATC_STR_RAT_MAX", "RO_YAW_RATE_LIM", REAL32),
        Alias("ATC_TURN_MAX_G", "HG_RO_LAT_ACC", REAL32, 1.0 / 9.80665),
        Alias("CIRC_DIR", "HG_RO_CIRC_DIR", INT8),
        Alias("CIRC_RADIUS", "HG_RO_CIRC_RAD", REAL32),
        Alias("CIRC_SPEED", "HG_RO_CIRC_SPD", REAL32),
        Alias("CRUISE_SPEED", "RO_SPEED_LIM", REAL32),
        Alias("DOCK_SPEED", "HG_RO_DOCK_SPD", REAL32),
        Alias("DOCK_STOP_DIST", "HG_RO_DOCK_STP", REAL32),
        Alias("FS_ACTION", "NAV_RCL_ACT", INT8, numbers=_ACTIONS),
        Alias("FS_CRASH_CHECK", "HG_RO_CRASH_ACT", INT8, numbers=_CRASH_ACTIONS),
        Alias("FS_EKF_ACTION", "COM_EST_FAIL_ACT", INT8, numbers=_ESTIMATOR_ACTIONS),
        Alias("FS_GCS_ENABLE", "NAV_DLL_ACT", INT8, numbers=_IS_ACTIVE),
        Alias("FS_THR_ENABLE", "NAV_RCL_ACT", INT8, numbers=_IS_ACTIVE),
        Alias("FS_TIMEOUT", "COM_RC_LOSS_T", REAL32),
        Alias("LOIT_RADIUS", "HG_RO_HOLD_RAD", REAL32),
        Alias("MODE_CH", "RC_MAP_FLTMODE", INT8),
        Alias("RTL_SPEED", "RTL_RETURN_SPD", REAL32),
        Alias("SIMPLE_TYPE", "HG_RO_SIMPLE", INT8),
        *(
            Alias(f"SERVO{i}_FUNCTION", "CA_AIRFRAME", INT16, numbers={_CAR: car, _SIDES: sides})
            for i, car, sides in ((1, _STEERING, _THROTTLE_LEFT), (3, _THROTTLE, _THROTTLE_RIGHT))
        ),
        Alias("WP_RADIUS", "NAV_ACC_RAD", REAL32),
        Alias("WP_SPEED", "RO_SPEED_LIM", REAL32),
    ),
    constants=(
        Constant("ATC_BRAKE", 1, INT8, "it brakes"),
        Constant("ATC_SPEED_P", 0.2, REAL32, _LAW),
        Constant("ATC_SPEED_I", 0.2, REAL32, _LAW),
        Constant("ATC_SPEED_D", 0.0, REAL32, _LAW),
        Constant("CRUISE_THROTTLE", 50, INT8, "see RO_MAX_THR_SPEED"),
        Constant("FRAME_CLASS", 1, INT8, "a rover"),
        Constant("FRAME_TYPE", 0, INT8, "no omnidirectional frame"),
        Constant("MIS_DONE_BEHAVE", 0, INT8, "holds where a mission ends"),
        Constant("MOT_PWM_TYPE", 0, INT8, "as a servo"),
        Constant("SERVO2_FUNCTION", 0, INT16, "nothing"),
        Constant("SERVO4_FUNCTION", 0, INT16, "nothing"),
        Constant("WENC_TYPE", 1, INT8, "an encoder on the left side; see EKF2_WHL_CTRL"),
        Constant("WENC2_TYPE", 1, INT8, "an encoder on the right side"),
    ),
)
