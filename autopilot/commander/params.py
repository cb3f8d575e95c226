"""Parameters of arming, landing detection and failsafes."""

from common.params import Parameter

_PX4 = "PX4 1.15 default"

COMMANDER_PARAMETERS: list[Parameter] = [
    Parameter("COM_DISARM_LAND", 2.0, -1.0, 20.0, "s", "time from landing to disarming, negative: never", _PX4),
    Parameter("COM_DISARM_PRFLT", 10.0, -1.0, 60.0, "s", "time from arming to disarming without take-off", _PX4),
    Parameter("COM_SPOOLUP_TIME", 1.0, 0.0, 30.0, "s", "time at idle from arming to take-off", _PX4),
    Parameter("COM_POS_FS_EPH", 5.0, 0.5, 100.0, "m", "horizontal accuracy (1 sigma) needed for position modes", _PX4),
    Parameter("COM_VEL_FS_EVH", 1.0, 0.1, 20.0, "m/s",
              "velocity accuracy (1 sigma) up to which a vehicle without position still brakes over ground", _PX4),
    Parameter("COM_ARM_EPV", 5.0, 0.5, 100.0, "m", "vertical accuracy (1 sigma) needed for arming", "guess"),
    Parameter("COM_ARM_GYR_BIAS", 3.0, 0.1, 20.0, "deg/s", "largest gyro bias for arming", "guess"),
    Parameter("COM_ARM_ACC_BIAS", 1.0, 0.1, 5.0, "m/s^2", "largest accelerometer bias for arming", "guess"),
    Parameter("COM_POS_FS_DELAY", 0.5, 0.0, 30.0, "s", "time until an invalid position counts as lost", "guess"),
    Parameter("COM_OF_LOSS_T", 1.0, 0.0, 60.0, "s", "time without setpoints until Offboard is lost", _PX4),
    Parameter("COM_OBL_RC_ACT", 5, 3, 5, "", "offboard loss: 3 return, 4 land, 5 hold",
              "PX4's numbers; hold because there are no sticks"),
    Parameter("COM_LOW_BAT_ACT", 3, 0, 3, "",
              "0 warn, 2 land when critical, 3 return when critical and land in an emergency",
              "PX4's numbers; its default is 0"),
    Parameter("BAT_LOW_THR", 0.15, 0.12, 0.5, "norm", "charge left at which to warn, and below which not to arm", _PX4),
    Parameter("BAT_CRIT_THR", 0.07, 0.05, 0.5, "norm", "charge left that is critical", _PX4),
    Parameter("BAT_EMERGEN_THR", 0.05, 0.03, 0.5, "norm", "charge left that is an emergency", _PX4),
    Parameter("FD_FAIL_R", 60.0, 60.0, 180.0, "deg", "roll above which the vehicle has crashed, unless asked for",
              _PX4),
    Parameter("FD_FAIL_P", 60.0, 60.0, 180.0, "deg", "pitch above which the vehicle has crashed, unless asked for",
              _PX4),
    Parameter("FD_FAIL_R_TTRI", 0.3, 0.02, 5.0, "s", "time for which the roll must be that large", _PX4),
    Parameter("FD_FAIL_P_TTRI", 0.3, 0.02, 5.0, "s", "time for which the pitch must be that large", _PX4),
    Parameter("LNDMC_Z_VEL_MAX", 0.25, 0.1, 1.0, "m/s", "largest vertical speed of a landed vehicle", _PX4),
    Parameter("LNDMC_XY_VEL_MAX", 1.5, 0.5, 5.0, "m/s", "largest horizontal speed of a landed vehicle", _PX4),
    Parameter("LNDMC_ROT_MAX", 20.0, 5.0, 100.0, "deg/s", "largest body rate of a landed vehicle", _PX4),
    Parameter("LNDMC_TRIG_TIME", 1.0, 0.1, 10.0, "s", "time for which a vehicle must look landed", _PX4),
]  # fmt: skip
