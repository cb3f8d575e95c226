"""The modes that ArduPilot has on every kind of vehicle and PX4 on none: what a row says of them.

A class completes each with its builder, its number, and what it takes.
"""

from functools import partial

from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import (
    AUTO_OVERRIDE,
    HOLD_EXCEPTED,
    OFFBOARD_EXCEPTED,
    OFFBOARD_OVERRIDE,
    Disarmed,
    ModeSpec,
)
from autopilot.interface.vehicle_state import Mode

SMART_RETURN = partial(
    ModeSpec,
    mode=Mode.SMART_RETURN,
    needs_position=True,
    needs_home=True,
    px4=Mode.RETURN,
    nav_state=5,
    aux_function=42,
    strength=Action.RETURN,
    carries_out=(Action.SMART_RETURN,),
    exception=HOLD_EXCEPTED,
    override=AUTO_OVERRIDE,
)
GUIDED = partial(
    ModeSpec,
    mode=Mode.GUIDED,
    needs_position=True,
    may_arm=True,
    on_ground=True,
    disarmed=Disarmed.SAME,
    px4=Mode.OFFBOARD,
    is_advanced=True,
    nav_state=14,
    aux_function=55,
    exception=OFFBOARD_EXCEPTED,
    override=OFFBOARD_OVERRIDE,
)
