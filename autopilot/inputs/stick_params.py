"""Parameters of the pilot's sticks: who may send them, how channels are read."""

from autopilot.inputs.sticks import CALIBRATED, CHANNELS
from common.params import Parameter

_PX4 = "PX4 1.15 default"
_SIMULATOR = "PX4's simulator"
_USUAL = "what transmitters send"


def _switched_mode(i: int) -> Parameter:
    meaning = (
        f"mode at position {i} of the mode switch: -1 none, 0 manual, 1 altitude, 2 position, 3 mission, 4 hold, "
        "5 return, 6 acro, 7 offboard, 8 stabilized, 10 take-off, 11 land, 12 follow, 13 precision landing"
    )
    return Parameter(f"COM_FLTMODE{i}", -1, -1, 13, "", meaning, _PX4)


def _calibration(i: int) -> list[Parameter]:
    return [
        Parameter(f"RC{i}_MIN", 1000.0, 800.0, 1500.0, "us", f"shortest pulse of channel {i}", _PX4),
        Parameter(f"RC{i}_TRIM", 1500.0, 800.0, 2200.0, "us", f"pulse of channel {i} at its middle", _PX4),
        Parameter(f"RC{i}_MAX", 2000.0, 1500.0, 2200.0, "us", f"longest pulse of channel {i}", _PX4),
        Parameter(f"RC{i}_REV", 1.0, -1.0, 1.0, "", f"-1: channel {i} is reversed", _PX4),
        Parameter(f"RC{i}_DZ", 10.0, 0.0, 100.0, "us", f"dead zone around the middle of channel {i}", _PX4),
    ]


STICK_PARAMETERS: list[Parameter] = [
    Parameter("COM_RC_IN_MODE", 1, 0, 4, "",
              "whose sticks count: 0 radio channels, 1 joystick, 2 either, 3 the kind that came first, 4 nobody's",
              _SIMULATOR),
    Parameter("COM_RC_LOSS_T", 0.5, 0.0, 35.0, "s", "time without joystick messages until the sticks are lost", _PX4),
    Parameter("RC_OVERRIDE_TIME", 3.0, 0.1, 120.0, "s",
              "time without overridden channels until the sticks are lost", "ArduPilot default"),
    Parameter("COM_RC_OVERRIDE", 1, 0, 3, "", "moving the sticks takes over: bit 0 in auto modes, bit 1 in offboard",
              _PX4),
    Parameter("COM_RC_STICK_OV", 30.0, 5.0, 80.0, "%", "movement of a stick per second that takes over", _PX4),
    Parameter("NAV_RCL_ACT", 2, 0, 7, "",
              "lost sticks: 0 nothing (if flown by them: return), 1 hold, 2 return, 3 land, 5 and 6 stop the motors, "
              "7 smart return", f"{_PX4}; it has no 7"),
    Parameter("COM_FAIL_ACT_T", 5.0, 0.0, 25.0, "s",
              "lost sticks: time in Hold before they lead to a return or a landing, 0: at once", _PX4),
    Parameter("COM_RCL_EXCEPT", 0, 0, 7, "",
              "where lost sticks change nothing: bit 0 mission, bit 1 other auto modes, bit 2 offboard", _PX4),
    Parameter("MAN_ARM_GESTURE", 1, 0, 1, "",
              "1: throttle down and yaw right for COM_RC_ARM_HYST arms, yaw left disarms", _PX4),
    Parameter("COM_RC_ARM_HYST", 1000, 100, 1500, "ms", "time for which the arming gesture is held", _PX4),
    Parameter("MAN_DEADZONE", 0.1, 0.0, 1.0, "", "dead zone around the middle of each stick", _PX4),
    Parameter("RC_MAP_ROLL", 1, 0, CHANNELS, "", "channel of the roll stick, 0: none", _USUAL),
    Parameter("RC_MAP_PITCH", 2, 0, CHANNELS, "", "channel of the pitch stick, 0: none", _USUAL),
    Parameter("RC_MAP_THROTTLE", 3, 0, CHANNELS, "", "channel of the throttle stick, 0: none", _USUAL),
    Parameter("RC_MAP_YAW", 4, 0, CHANNELS, "", "channel of the yaw stick, 0: none", _USUAL),
    Parameter("RC_MAP_FLTMODE", 0, 0, CHANNELS, "", "channel of the mode switch, 0: none", _PX4),
    *(_switched_mode(i) for i in range(1, 7)),
    *(parameter for i in range(1, CALIBRATED + 1) for parameter in _calibration(i)),
]  # fmt: skip
