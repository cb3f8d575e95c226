"""The numbers of a plane's modes: take-off, circles, landing. PX4's names where the meaning is PX4's."""

from common.params import Parameter

_PX4 = "PX4 1.16 default"

MODE_PARAMETERS = [
    Parameter("NAV_FW_ALT_RAD", 10.0, 0.05, 200.0, "m", "height error at which a waypoint counts as reached", _PX4),
    Parameter("NAV_FW_ALTL_RAD", 5.0, 0.05, 200.0, "m", "the same before a landing", _PX4),
    Parameter("RWTO_MAX_THR", 1.0, 0.0, 1.0, "", "throttle of a runway take-off", _PX4),
    Parameter("RWTO_RAMP_TIME", 2.0, 1.0, 15.0, "s", "time in which the throttle opens", _PX4),
    Parameter("RWTO_ROT_AIRSPD", -1.0, -1.0, 200.0, "m/s", "airspeed of rotation; negative: FW_AIRSPD_MIN",
              "PX4's own is 0.9 of FW_TKO_AIRSPD"),
    Parameter("FW_LAUN_DETCN_ON", 0, 0, 1, "", "1: take-offs begin with a throw", "airframe file"),
    Parameter("FW_LAUN_AC_THLD", 30.0, 0.0, 100.0, "m/s^2", "acceleration along the nose that is a throw",
              "airframe file"),
    Parameter("FW_LAUN_AC_T", 0.05, 0.0, 5.0, "s", "time for which it is felt", _PX4),
    Parameter("FW_LAUN_MOT_DEL", 0.0, 0.0, 10.0, "s", "time from the throw to the start of the motor", _PX4),
    Parameter("FW_TKO_PITCH_MIN", 10.0, -5.0, 80.0, "deg", "pitch after a throw, until the motor starts", _PX4),
    Parameter("FW_LND_ANG", 5.0, 1.0, 45.0, "deg", "angle of the glide slope", _PX4),
    Parameter("FW_LND_AIRSPD", -1.0, -1.0, 200.0, "m/s", "airspeed of a landing; negative: FW_AIRSPD_MIN", _PX4),
    Parameter("FW_LND_FLALT", 0.5, 0.0, 20.0, "m", "height over ground at which a flare begins at the latest", _PX4),
    Parameter("FW_LND_FL_TIME", 2.0, 0.1, 5.0, "s", "time before the touchdown at which it begins",
              "guess: PX4's 1.0 is hardly longer than a path takes to follow the pitch"),
    Parameter("FW_LND_FL_SINK", 0.25, 0.0, 2.0, "m/s", "sink of a flare", _PX4),
    Parameter("MIS_LND_ABRT_ALT", 30.0, 0.0, 10_000.0, "m", "height above the touchdown to which a landing is given up",
              _PX4),
    Parameter("FW_LND_ABORT", 0, 0, 3, "",
              "landings that are given up: 1 where the range finder tells no height, 2 where it tells none any more",
              "guess: it lands by its height; PX4's is 3"),
    Parameter("HG_FW_LND_OFF", 10.0, 0.0, 100.0, "m", "cross-track error with which no flare begins; 0: any",
              "guess"),
    Parameter("LNDFW_VEL_XY_MAX", 5.0, 0.5, 20.0, "m/s", "largest speed over ground of a landed plane", _PX4),
    Parameter("LNDFW_VEL_Z_MAX", 1.0, 0.1, 20.0, "m/s", "largest vertical speed of a landed plane", _PX4),
    Parameter("LNDFW_AIRSPD_MAX", 6.0, 2.0, 30.0, "m/s", "largest airspeed of a landed plane", _PX4),
    Parameter("LNDFW_TRIG_TIME", 2.0, 0.1, 10.0, "s", "time for which a plane must look landed", _PX4),
    Parameter("HG_FW_ACC", 9.0, 1.0, 20.0, "m/s^2", "acceleration across with which ways are planned",
              "guess: a bank of 43 deg"),
    Parameter("HG_FW_JERK", 10.0, 1.0, 100.0, "m/s^3", "its change", "guess"),
    Parameter("HG_FW_ERR", 20.0, 1.0, 500.0, "m", "by which it may lag behind what it tracks", "guess"),
]  # fmt: skip
