"""The names under which ArduPilot's users and ground stations look for parameters, on any vehicle.

An alias is one of our parameters under ArduPilot's name, in ArduPilot's unit: setting it sets ours. A constant is there
to be read only. Names that are ArduPilot's and ours alike (RC1_MIN) are in neither list.
"""

from collections.abc import Mapping, Sequence

from autopilot.ardupilot_only_params import STREAM_GROUPS
from autopilot.interface.ardupilot_vehicle import INT8, INT16, INT32, REAL32, Alias, Constant
from autopilot.interface.mode_spec import DialectMode, ModeTable
from autopilot.interface.vehicle_state import Mode

# Failsafe actions. Ours are PX4's: 0 none, 1 hold, 2 return, 3 land; for the fence 1 warn, 2 hold, 3 return, 5 land.
_FENCE_ACTIONS: Mapping[int, int] = {1: 0, 0: 0, 2: 4, 3: 1, 5: 2, 6: 3}
_BATTERY_ACTIONS: Mapping[int, int] = {0: 0, 2: 1, 3: 2}
# Positions from outside: none, by MAVLink; the heading stays the compass's unless EKF2_EV_CTRL itself says otherwise.
_VISION_TYPES: Mapping[int, int] = {0: 0, 7: 1} | dict.fromkeys(range(1, 16), 1)
# Logs: while armed, or always.
_LOG_MODES: Mapping[int, int] = {0: 0, 1: 1, 2: 1, -1: 0}

ALIASES: tuple[Alias, ...] = (
    Alias("BATT_CAPACITY", "BAT1_CAPACITY", INT32),
    Alias("BATT_FS_CRT_ACT", "COM_LOW_BAT_ACT", INT8, numbers=_BATTERY_ACTIONS),
    Alias("DISARM_DELAY", "COM_DISARM_LAND", INT8),
    Alias("FENCE_ACTION", "GF_ACTION", INT8, numbers=_FENCE_ACTIONS),
    Alias("FENCE_ALT_MAX", "GF_MAX_VER_DIST", REAL32),
    Alias("FENCE_ALT_MIN", "GF_MIN_ALT", REAL32),
    Alias("FENCE_ENABLE", "GF_ENABLE", INT8),
    Alias("FENCE_MARGIN", "GF_MARGIN", REAL32),
    Alias("FENCE_RADIUS", "GF_MAX_HOR_DIST", REAL32),
    Alias("FENCE_TYPE", "GF_TYPES", INT8),
    Alias("FS_GCS_TIMEOUT", "COM_DL_LOSS_T", REAL32),
    Alias("LOG_DISARMED", "SDLOG_MODE", INT8, numbers=_LOG_MODES),
    *(Alias(f"RC{i}_REVERSED", f"RC{i}_REV", INT8, numbers={1: 0, -1: 1}) for i in range(1, 9)),
    *(Alias(f"RCMAP_{stick}", f"RC_MAP_{stick}", INT8) for stick in ("ROLL", "PITCH", "THROTTLE", "YAW")),
    Alias("RC_FS_TIMEOUT", "COM_RC_LOSS_T", REAL32),
    Alias("SIM_GPS_DISABLE", "SIM_GPS1_ENABLE", INT8, numbers={1: 0, 0: 1}),
    *(Alias(name.replace("SR0", "SR1"), name, INT16) for name in STREAM_GROUPS),
    Alias("SYSID_THISMAV", "MAV_SYS_ID", INT16),
    Alias("VISO_DELAY_MS", "EKF2_EV_DELAY", INT16),
    Alias("VISO_POS_M_NSE", "EKF2_EVP_NOISE", REAL32),
    Alias("VISO_TYPE", "EKF2_EV_CTRL", INT8, numbers=_VISION_TYPES),
    Alias("VISO_VEL_M_NSE", "EKF2_EVV_NOISE", REAL32),
    Alias("VISO_YAW_M_NSE", "EKF2_EVA_NOISE", REAL32),
)


def switch_aliases(modes: ModeTable, prefix: str) -> Sequence[Alias]:
    """The modes of a switch: PX4's COM_FLTMODE numbers to ArduPilot's mode numbers; none for a vehicle without any."""
    numbers = {
        spec.switch: spec.ardupilot.number
        for spec in modes.values()
        if spec.switch is not None and isinstance(spec.ardupilot, DialectMode)
    }
    offboard, guided = modes.get(Mode.OFFBOARD), modes.get(Mode.GUIDED)
    if offboard and offboard.switch is not None and guided and isinstance(guided.ardupilot, DialectMode):
        numbers[offboard.switch] = guided.ardupilot.number  # no number of a switch means Guided
    if not numbers:
        return []
    numbers = dict(sorted(numbers.items(), key=lambda item: item[1]))
    return [Alias(f"{prefix}{i}", f"COM_FLTMODE{i}", INT8, numbers=numbers) for i in range(1, 7)]


_AXES = "XYZ"
CONSTANTS: tuple[Constant, ...] = (
    Constant("AHRS_EKF_TYPE", 3, INT8, "the estimator, of which there is one"),
    Constant("ARMING_CHECK", 1, INT32, "all checks; they cannot be switched off"),
    Constant("ARMING_REQUIRE", 1, INT8, "it must be armed before the motors turn"),
    Constant("AVOID_ENABLE", 7, INT8, "fence and distances are kept to; see GF_ACTION and CP_DIST"),
    Constant("BATT_ARM_VOLT", 0.0, REAL32, "no voltage forbids arming; see BAT_LOW_THR"),
    Constant("BATT_CRT_MAH", 0.0, REAL32, "see BAT_CRIT_THR, a share of the capacity"),
    Constant("BATT_LOW_MAH", 0.0, REAL32, "see BAT_LOW_THR, a share of the capacity"),
    Constant("BATT_MONITOR", 4, INT8, "voltage and current"),
    Constant("COMPASS_DEV_ID", 97_539, INT32, "a magnetometer"),
    Constant("COMPASS_DEV_ID2", 0, INT32, "no second magnetometer"),
    Constant("COMPASS_DEV_ID3", 0, INT32, "no third magnetometer"),
    Constant("COMPASS_ENABLE", 1, INT8, "there is a magnetometer"),
    Constant("COMPASS_USE", 1, INT8, "the magnetometer is used"),
    Constant("COMPASS_USE2", 0, INT8, "no second magnetometer"),
    Constant("COMPASS_USE3", 0, INT8, "no third magnetometer"),
    *(Constant(f"COMPASS_OFS_{axis}", 1.0, REAL32, "calibrated") for axis in _AXES),
    *(Constant(f"COMPASS_OFS2_{axis}", 0.0, REAL32, "no second magnetometer") for axis in _AXES),
    *(Constant(f"COMPASS_OFS3_{axis}", 0.0, REAL32, "no third magnetometer") for axis in _AXES),
    Constant("EK3_ENABLE", 1, INT8, "the estimator runs"),
    Constant("EK3_IMU_MASK", 1, INT8, "one IMU"),
    Constant("EK3_SRC1_POSXY", 3, INT8, "GNSS; see EKF2_GPS_CTRL and EKF2_EV_CTRL"),
    Constant("EK3_SRC1_POSZ", 1, INT8, "barometer; see EKF2_HGT_REF"),
    Constant("EK3_SRC1_VELXY", 3, INT8, "GNSS; see EKF2_GPS_CTRL"),
    Constant("EK3_SRC1_VELZ", 3, INT8, "GNSS; see EKF2_GPS_CTRL"),
    Constant("EK3_SRC1_YAW", 1, INT8, "compass; see EKF2_MAG_TYPE"),
    Constant("FOLL_ALT_TYPE", 1, INT8, "height above home; see FLW_TGT_ALT_M"),
    Constant("FOLL_DIST_MAX", 0.0, REAL32, "any distance"),
    Constant("FOLL_ENABLE", 1, INT8, "mode Follow may be chosen"),
    *(Constant(f"FOLL_OFS_{axis}", 0.0, REAL32, "see FLW_TGT_DST, _FA, _HT") for axis in _AXES),
    Constant("FOLL_OFS_TYPE", 1, INT8, "relative to the course of the target"),
    Constant("FOLL_POS_P", 0.1, REAL32, "see FLW_TGT_RS"),
    Constant("FOLL_SYSID", 0, INT16, "any target"),
    Constant("FOLL_YAW_BEHAVE", 1, INT8, "faces the target"),
    Constant("FS_DR_ENABLE", 0, INT8, "dead reckoning is told; see COM_POS_LOST_ACT"),
    Constant("FS_EKF_THRESH", 0.8, REAL32, "ArduPilot's default; the estimator fails by resets, see COM_EST_FAIL_ACT"),
    Constant("FS_OPTIONS", 0, INT32, "no exceptions; see COM_DLL_EXCEPT and COM_RCL_EXCEPT"),
    Constant("FS_VIBE_ENABLE", 1, INT8, "a doubted accelerometer is told, and counts for less"),
    Constant("GPS1_TYPE", 1, INT8, "a GNSS receiver"),
    Constant("GPS_TYPE", 1, INT8, "a GNSS receiver"),
    *(Constant(f"INS_ACCOFFS_{axis}", 0.001, REAL32, "calibrated") for axis in _AXES),
    *(Constant(f"INS_ACCSCAL_{axis}", 1.0, REAL32, "calibrated") for axis in _AXES),
    Constant("LOG_BACKEND_TYPE", 1, INT8, "files, in PX4's format"),
    Constant("LOG_BITMASK", 180_222, INT32, "everything is logged"),
    Constant("LOG_FILE_DSRMROT", 0, INT8, "see SDLOG_MODE"),
    Constant("LOG_REPLAY", 1, INT8, "logs hold what `honeyguide estimate` needs"),
    Constant("RNGFND1_TYPE", 10, INT8, "a range finder that looks down"),
    Constant("SCHED_LOOP_RATE", 250, INT16, "rate of the control loops"),
    Constant("SERIAL0_BAUD", 115, INT32, "links have no baud rate"),
    Constant("SERIAL0_PROTOCOL", 2, INT8, "MAVLink 2"),
    *(Constant(f"SERVO{i}_FUNCTION", 0, INT16, "set by DO_SET_SERVO") for i in range(9, 17)),
    *(
        Constant(f"SERVO{i}_{name}", value, INT16, "pulse [us]; outputs are not calibrated")
        for i in range(1, 17)
        for name, value in (("MIN", 1000), ("MAX", 2000), ("TRIM", 1500))
    ),
    *(Constant(f"SR{i}_ADSB", 1, INT16, "aircraft are told when they are heard") for i in (0, 1)),
    *(Constant(f"SR{i}_PARAMS", 50, INT16, "20 parameters per frame") for i in (0, 1)),
    Constant("STAT_FLTTIME", 0, INT32, "flight time is not counted from one start to the next"),
    Constant("STAT_BOOTCNT", 1, INT16, "starts are not counted"),
    Constant("STAT_RUNTIME", 0, INT32, "running time is not counted from one start to the next"),
    Constant("TERRAIN_ENABLE", 0, INT8, "no terrain tiles: the range finder measures the ground"),
    Constant("SYSID_MYGCS", 255, INT16, "any ground station may fly it"),
)
