"""Failsafes: which failure leads to which action, most urgent first, with what the pilot is told.

A new failsafe is a bit, a row of `RULES`, and a condition in `failure_detector.py` that sets the bit.
"""

from collections.abc import Callable
from dataclasses import dataclass

from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import ModeSpec
from autopilot.interface.vehicle_state import Mode, Severity
from common.params import ParameterTable

# What can be wrong at the same time, as bits.
POSITION_LOST = 1  # in a mode that needs it
BATTERY_EMERGENCY = 2
BATTERY_CRITICAL = 4
OFFBOARD_LOST = 8
BATTERY_LOW = 16
BATTERY_SILENT = 32
ATTITUDE_LOST = 64
CRASHED = 128
STATION_LOST = 256
HEIGHT_LOST = 512  # in a mode that needs the height, but no position
WIND_HIGH = 1024
WIND_STRONG = 2048
FLIGHT_TIME_OVER = 4096
FLIGHT_TIME_NEAR = 8192
DEAD_RECKONING = 16384
MOTOR_FAILED = 32768
STICKS_LOST = 1 << 16
ESTIMATOR_FAILED = 1 << 17
FENCE_BREACHED = 1 << 18
TRAFFIC_NEAR = 1 << 20
ACCEL_DOUBTED = 1 << 21
COMPASS_FAULTY = 1 << 22
STUCK = 1 << 23  # it drives, and does not get on

TERMINATION_BREAKER = 121212  # CBRK_FLIGHTTERM: the failure detector may not stop the motors


OUTCOMES = {
    Action.ALTITUDE: ": altitude mode",
    Action.HOLD: ": hold",
    Action.SMART_RETURN: ": smart return",
    Action.RETURN: ": return",
    Action.LAND: ": land",
    Action.TERMINATE: ": flight terminated",
    Action.DISARM: ": motors stopped",
}

# PX4's numbers of actions, parameter by parameter.
LINK_ACTIONS = {
    0: Action.WARN, 1: Action.HOLD, 2: Action.RETURN, 3: Action.LAND, 5: Action.TERMINATE, 6: Action.DISARM,
    7: Action.SMART_RETURN,
}  # fmt: skip
"""NAV_DLL_ACT, NAV_RCL_ACT, COM_EST_FAIL_ACT and COM_FLT_TIME_ACT; PX4 has no 7."""
POSITION_ACTIONS = {3: Action.LAND, 5: Action.TERMINATE, 6: Action.DISARM}
"""COM_POS_LOST_ACT."""
MOTOR_ACTIONS = {0: Action.WARN, 1: Action.HOLD, 2: Action.LAND, 3: Action.RETURN, 4: Action.TERMINATE}
"""COM_ACT_FAIL_ACT."""
LIMIT_ACTIONS = {
    0: Action.WARN, 1: Action.WARN, 2: Action.HOLD, 3: Action.RETURN, 4: Action.TERMINATE, 5: Action.LAND,
}  # fmt: skip
"""COM_WIND_MAX_ACT."""
FENCE_ACTIONS = LIMIT_ACTIONS | {6: Action.SMART_RETURN}
"""GF_ACTION; PX4 has no 6."""
OFFBOARD_ACTIONS = {
    3: Action.RETURN, 4: Action.LAND, 5: Action.HOLD, 6: Action.TERMINATE, 7: Action.DISARM,
}  # fmt: skip
"""COM_OBL_RC_ACT."""
TRAFFIC_ACTIONS = {2: Action.RETURN, 3: Action.LAND, 4: Action.HOLD}
"""NAV_TRAFF_AVOID; with 0 nobody looks."""
LOW_BATTERY_ACTIONS = {
    1: Action.LAND, 2: Action.RETURN, 3: Action.SMART_RETURN, 4: Action.SMART_RETURN, 5: Action.TERMINATE,
}  # fmt: skip
"""BATT_FS_LOW_ACT, in ArduPilot's dialect."""
CRITICAL_BATTERY_ACTIONS = {2: Action.LAND, 3: Action.RETURN}
EMERGENCY_BATTERY_ACTIONS = {2: Action.LAND, 3: Action.LAND}

ActionChoice = Callable[[ParameterTable, ModeSpec], Action]


@dataclass(frozen=True, slots=True)
class Rule:
    """One row of the table."""

    failure: int  # one of the bits
    action: ActionChoice
    severity: Severity
    text: str
    recovery: str = ""  # what is told when the failure is over; the mode stays


def always(action: Action) -> ActionChoice:
    """The same action, whatever the parameters say."""
    return lambda _params, _flown: action


def by(parameter: str, actions: dict[int, Action], otherwise: Action = Action.WARN) -> ActionChoice:
    """The action that a parameter chooses."""
    return lambda params, _flown: actions.get(int(params[parameter]), otherwise)


def _battery_low(params: ParameterTable, _: ModeSpec) -> Action:
    """A warning, unless ArduPilot's parameter says otherwise."""
    name = "BATT_FS_LOW_ACT"
    return LOW_BATTERY_ACTIONS.get(int(params[name]), Action.WARN) if name in params else Action.WARN


def _position_lost(params: ParameterTable, flown: ModeSpec) -> Action:
    """A pilot at the sticks may fly on without a position; what flies by itself must come down."""
    if flown.mode is Mode.POSITION and int(params["COM_POSCTL_NAVL"]) == 0:
        return Action.ALTITUDE
    return POSITION_ACTIONS.get(int(params["COM_POS_LOST_ACT"]), Action.LAND)


def _control_lost(params: ParameterTable, _: ModeSpec) -> Action:
    return Action.WARN if int(params["CBRK_FLIGHTTERM"]) == TERMINATION_BREAKER else Action.DISARM


def _sticks_lost(params: ParameterTable, flown: ModeSpec) -> Action:
    """A mode flown by sticks cannot go on without them."""
    action = LINK_ACTIONS.get(int(params["NAV_RCL_ACT"]), Action.WARN)
    return Action.RETURN if action is Action.WARN and flown.needs_sticks else action


RULES: tuple[Rule, ...] = (
    Rule(ATTITUDE_LOST, _control_lost, Severity.EMERGENCY, "Attitude lost"),
    Rule(CRASHED, _control_lost, Severity.EMERGENCY, "Crash detected"),
    Rule(STUCK, by("HG_RO_CRASH_ACT", LINK_ACTIONS), Severity.EMERGENCY, "Stuck, it does not move"),
    Rule(MOTOR_FAILED, by("COM_ACT_FAIL_ACT", MOTOR_ACTIONS), Severity.EMERGENCY, "Motor failure"),
    Rule(POSITION_LOST, _position_lost, Severity.CRITICAL, "Position lost", "Position is valid again"),
    Rule(HEIGHT_LOST, always(Action.LAND), Severity.CRITICAL, "Height lost", "Height is valid again"),
    Rule(ESTIMATOR_FAILED, by("COM_EST_FAIL_ACT", LINK_ACTIONS), Severity.CRITICAL, "Estimator failure",
         "Estimator is steady again"),
    Rule(BATTERY_EMERGENCY, by("COM_LOW_BAT_ACT", EMERGENCY_BATTERY_ACTIONS), Severity.EMERGENCY,
         "Battery nearly empty"),
    Rule(BATTERY_CRITICAL, by("COM_LOW_BAT_ACT", CRITICAL_BATTERY_ACTIONS), Severity.CRITICAL, "Battery critical"),
    Rule(FLIGHT_TIME_OVER, by("COM_FLT_TIME_ACT", LINK_ACTIONS), Severity.CRITICAL, "Flight time is over"),
    Rule(WIND_HIGH, by("COM_WIND_MAX_ACT", LIMIT_ACTIONS), Severity.CRITICAL, "Wind above its limit",
         "Wind is below its limit again"),
    Rule(FENCE_BREACHED, by("GF_ACTION", FENCE_ACTIONS), Severity.CRITICAL, "Geofence breached"),
    Rule(TRAFFIC_NEAR, by("NAV_TRAFF_AVOID", TRAFFIC_ACTIONS), Severity.WARNING, "Aircraft near",
         "Aircraft is no longer near"),
    Rule(STATION_LOST, by("NAV_DLL_ACT", LINK_ACTIONS), Severity.WARNING, "Ground station lost",
         "Ground station is back"),
    Rule(STICKS_LOST, _sticks_lost, Severity.CRITICAL, "Sticks lost", "Sticks are back"),
    Rule(OFFBOARD_LOST, by("COM_OBL_RC_ACT", OFFBOARD_ACTIONS, Action.HOLD), Severity.CRITICAL,
         "Offboard setpoints lost"),
    Rule(BATTERY_LOW, _battery_low, Severity.WARNING, "Battery low"),
    Rule(BATTERY_SILENT, always(Action.WARN), Severity.WARNING, "Battery sensor silent: charge is estimated"),
    Rule(FLIGHT_TIME_NEAR, always(Action.WARN), Severity.WARNING, "Flight time is nearly over"),
    Rule(WIND_STRONG, always(Action.WARN), Severity.WARNING, "Strong wind"),
    Rule(ACCEL_DOUBTED, always(Action.WARN), Severity.CRITICAL, "Vibration compensation ON",
         "Vibration compensation OFF"),
    Rule(COMPASS_FAULTY, always(Action.WARN), Severity.CRITICAL, "Emergency yaw reset: compass not used",
         "Compass is used again"),
    Rule(DEAD_RECKONING, always(Action.WARN), Severity.WARNING, "No position source: dead reckoning",
         "Position source is back"),
)  # fmt: skip
