"""Parameters that a vehicle has in ArduPilot's dialect only, because PX4 has nothing like them; each works."""

from common.params import Parameter

_ARDUPILOT = "ArduPilot default"
OPTION_CHANNELS = 16  # radio channels with a function of their own

STREAM_GROUPS: dict[str, int] = {
    "SR0_RAW_SENS": 1,
    "SR0_EXT_STAT": 2,
    "SR0_RC_CHAN": 3,
    "SR0_RAW_CTRL": 4,
    "SR0_POSITION": 6,
    "SR0_EXTRA1": 10,
    "SR0_EXTRA2": 11,
    "SR0_EXTRA3": 12,
}
"""Rates of groups of messages; the numbers are MAV_DATA_STREAM's."""

ARDUPILOT_PARAMETERS: list[Parameter] = [
    Parameter("BATT_LOW_VOLT", 0.0, 0.0, 100.0, "V",
              "voltage below which the battery is low, whatever its charge, 0: none", "ArduPilot has 10.5"),
    Parameter("BATT_CRT_VOLT", 0.0, 0.0, 100.0, "V",
              "voltage below which the battery is critical, whatever its charge, 0: none", _ARDUPILOT),
    Parameter("BATT_LOW_TIMER", 10.0, 0.0, 120.0, "s", "for how long the voltage must be that low, 0: no limit",
              _ARDUPILOT),
    Parameter("BATT_FS_LOW_ACT", 0, 0, 5, "",
              "low battery: 0 warn, 1 land, 2 return, 3 and 4 smart return, 5 terminate", _ARDUPILOT),
    *(
        Parameter(f"RC{i}_OPTION", 0, 0, 500, "",
                  f"what a switch on channel {i} does, as DO_AUX_FUNCTION's numbers; 0: nothing", _ARDUPILOT)
        for i in range(1, OPTION_CHANNELS + 1)
    ),
    *(
        Parameter(name, -1, -1, 50, "Hz",
                  f"rate on every link of the messages of group {group} of REQUEST_DATA_STREAM, -1: each its own",
                  "ArduPilot has 0 to 10")
        for name, group in STREAM_GROUPS.items()
    ),
]  # fmt: skip
