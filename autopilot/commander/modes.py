"""The mode machine's table: what each flight mode needs, and the reasons for which it is refused."""

from dataclasses import dataclass

from autopilot.interface.vehicle_state import Mode


@dataclass(frozen=True, slots=True)
class ModeRule:
    """Conditions of one mode."""

    needs_position: bool  # valid horizontal position, velocity and height
    needs_home: bool
    may_arm: bool  # the vehicle may be armed in it
    on_ground: bool  # may be chosen while standing on the ground
    needs_sticks: bool = False  # flown by a pilot
    on_takeoff: bool = False  # may be chosen on the ground once a take-off has begun, which is finished first


NO_STICKS = "needs a pilot's sticks"

MODE_RULES: dict[Mode, ModeRule] = {
    Mode.HOLD: ModeRule(needs_position=True, needs_home=False, may_arm=True, on_ground=True),
    Mode.TAKEOFF: ModeRule(needs_position=True, needs_home=False, may_arm=True, on_ground=True),
    Mode.MISSION: ModeRule(needs_position=True, needs_home=True, may_arm=True, on_ground=True),
    Mode.RETURN: ModeRule(needs_position=True, needs_home=True, may_arm=False, on_ground=False),
    Mode.LAND: ModeRule(needs_position=False, needs_home=False, may_arm=False, on_ground=False),
    Mode.MANUAL: ModeRule(needs_position=False, needs_home=False, may_arm=True, on_ground=True, needs_sticks=True),
    Mode.STABILIZED: ModeRule(needs_position=False, needs_home=False, may_arm=True, on_ground=True, needs_sticks=True),
    Mode.ACRO: ModeRule(needs_position=False, needs_home=False, may_arm=True, on_ground=True, needs_sticks=True),
    Mode.ALTITUDE: ModeRule(needs_position=False, needs_home=False, may_arm=True, on_ground=True, needs_sticks=True),
    Mode.POSITION: ModeRule(needs_position=True, needs_home=False, may_arm=True, on_ground=True, needs_sticks=True),
    Mode.PRECISION_LAND: ModeRule(needs_position=True, needs_home=False, may_arm=False, on_ground=False),
    Mode.FOLLOW: ModeRule(needs_position=True, needs_home=False, may_arm=False, on_ground=False, on_takeoff=True),
    Mode.ORBIT: ModeRule(needs_position=True, needs_home=False, may_arm=False, on_ground=False, on_takeoff=True),
    Mode.BRAKE: ModeRule(needs_position=True, needs_home=False, may_arm=False, on_ground=False),
    Mode.SMART_RETURN: ModeRule(needs_position=True, needs_home=True, may_arm=False, on_ground=False),
    Mode.GUIDED: ModeRule(needs_position=True, needs_home=False, may_arm=True, on_ground=True),
    Mode.TERMINATION: ModeRule(needs_position=False, needs_home=False, may_arm=False, on_ground=True),
    # Offboard setpoints of attitude or rate need no position: the commander asks the navigator.
    Mode.OFFBOARD: ModeRule(needs_position=True, needs_home=False, may_arm=True, on_ground=True),
}


# Modes of which nothing is left once it is disarmed: it goes over to Hold. By ArduPilot's rules it stays in any other.
PASSING_MODES = frozenset({Mode.TAKEOFF, Mode.OFFBOARD, Mode.TERMINATION})


def mode_refusal(
    mode: Mode, *, has_position: bool, has_home: bool, is_on_ground: bool, needs_position: bool, has_sticks: bool
) -> str:
    """Why the mode cannot be entered now; empty if it can.

    Args:
        mode: the mode asked for.
        has_position: horizontal position, velocity and height are valid.
        has_home: home is known.
        is_on_ground: the vehicle stands on the ground.
        needs_position: as the table says, except in Offboard, where the setpoint decides.
        has_sticks: a pilot's sticks are heard.
    """
    rule = MODE_RULES[mode]
    if is_on_ground and not rule.on_ground:
        return "on the ground already"
    if rule.needs_sticks and not has_sticks:
        return NO_STICKS
    # Hold is where every vehicle boots: it may be chosen before there is a position, and flown only with one.
    if needs_position and not has_position and not (mode is Mode.HOLD and is_on_ground):
        return "no valid position"
    if rule.needs_home and not has_home:
        return "no home position"
    return ""
