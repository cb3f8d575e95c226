"""Failsafes: which failure leads to which action, most urgent first, with what the pilot is told."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from autopilot.vehicle import Mode, Severity
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


class Action(IntEnum):
    """What to do, in rising order: a failsafe never replaces a stronger one."""

    WARN = 0
    HOLD = 1
    RETURN = 2
    LAND = 3  # blind if the position is lost
    TERMINATE = 4  # motors stopped, wherever the vehicle is


ACTION_MODES = {Action.HOLD: Mode.HOLD, Action.RETURN: Mode.RETURN, Action.LAND: Mode.LAND}
OUTCOMES = {
    Action.HOLD: ": hold", Action.RETURN: ": return", Action.LAND: ": land", Action.TERMINATE: ": motors stopped",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Rule:
    """One row of the table."""

    failure: int  # one of the bits
    action: Callable[[ParameterTable], Action]
    severity: Severity
    text: str


def _battery_critical(params: ParameterTable) -> Action:
    return {2: Action.LAND, 3: Action.RETURN}.get(int(params["COM_LOW_BAT_ACT"]), Action.WARN)


def _battery_emergency(params: ParameterTable) -> Action:
    return Action.LAND if int(params["COM_LOW_BAT_ACT"]) >= 2 else Action.WARN


def _offboard_lost(params: ParameterTable) -> Action:
    return {3: Action.RETURN, 4: Action.LAND}.get(int(params["COM_OBL_RC_ACT"]), Action.HOLD)


def _land(_: ParameterTable) -> Action:
    return Action.LAND


def _terminate(_: ParameterTable) -> Action:
    return Action.TERMINATE


def _warn(_: ParameterTable) -> Action:
    return Action.WARN


RULES: tuple[Rule, ...] = (
    Rule(ATTITUDE_LOST, _terminate, Severity.EMERGENCY, "Attitude lost"),
    Rule(CRASHED, _terminate, Severity.EMERGENCY, "Crash detected"),
    Rule(POSITION_LOST, _land, Severity.CRITICAL, "Position lost"),
    Rule(BATTERY_EMERGENCY, _battery_emergency, Severity.EMERGENCY, "Battery nearly empty"),
    Rule(BATTERY_CRITICAL, _battery_critical, Severity.CRITICAL, "Battery critical"),
    Rule(OFFBOARD_LOST, _offboard_lost, Severity.CRITICAL, "Offboard setpoints lost"),
    Rule(BATTERY_LOW, _warn, Severity.WARNING, "Battery low"),
    Rule(BATTERY_SILENT, _warn, Severity.WARNING, "Battery sensor silent: charge is estimated"),
)
