"""The mode machine's rules: the reasons for which a mode is refused by what its row says."""

from autopilot.interface.mode_spec import ModeSpec
from autopilot.interface.vehicle_state import Mode

NO_STICKS = "needs a pilot's sticks"


def mode_refusal(
    spec: ModeSpec, *, has_position: bool, has_home: bool, is_on_ground: bool, needs_position: bool, has_sticks: bool
) -> str:
    """Why the mode cannot be entered now; empty if it can.

    Args:
        spec: the mode asked for.
        has_position: horizontal position, velocity and height are valid.
        has_home: home is known.
        is_on_ground: the vehicle stands on the ground.
        needs_position: as its row and what it would fly now say.
        has_sticks: a pilot's sticks are heard.
    """
    if is_on_ground and not spec.on_ground:
        return "on the ground already"
    if spec.needs_sticks and not has_sticks:
        return NO_STICKS
    # Hold is where every vehicle boots: it may be chosen before there is a position, and flown only with one.
    if needs_position and not has_position and not (spec.mode is Mode.HOLD and is_on_ground):
        return "no valid position"
    if spec.needs_home and not has_home:
        return "no home position"
    return ""
