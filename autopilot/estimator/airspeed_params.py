"""Parameters of the checks of a pitot tube, which a class of vehicles that has one declares beside its own: PX4's."""

import warp as wp

from common.params import Parameter, ParameterTable

# ASPD_DO_CHECKS
CHECK_MISSING = wp.constant(1)
CHECK_STUCK = wp.constant(2)
CHECK_INNOVATION = wp.constant(4)

_PX4 = "PX4 1.16 default"

AIRSPEED_PARAMETERS: list[Parameter] = [
    Parameter("ASPD_DO_CHECKS", 7, 0, 7, "",
              "what a pitot tube is doubted for: 1 silence, 2 a value that does not change, 4 contradicting the motion",
              _PX4, "airspeed_checks"),
    Parameter("ASPD_FS_INNOV", 5.0, 0.5, 10.0, "m/s", "contradiction from which it is doubted", "airframe file",
              "airspeed_innov"),
    Parameter("ASPD_FS_T_STOP", 1.0, 1.0, 10.0, "s", "time of that after which it is not used", _PX4,
              "airspeed_stop_s"),
    Parameter("ASPD_FS_T_START", 10.0, -1.0, 1000.0, "s",
              "time without a doubt after which it is used again; negative: never", "guess: PX4's is -1",
              "airspeed_start_s"),
]  # fmt: skip
_DEFAULTS = ParameterTable(AIRSPEED_PARAMETERS)


def airspeed_fields(table: ParameterTable) -> dict[str, float]:
    """Fields of `EstimatorParams` and their values in SI; the defaults if the table's vehicle has no tube."""
    return (table if AIRSPEED_PARAMETERS[0].name in table else _DEFAULTS).fields(AIRSPEED_PARAMETERS)
