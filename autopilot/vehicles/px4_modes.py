"""The modes that PX4 has on every kind of vehicle: what a row says of them, whoever flies or drives them.

A class completes each with its builder, its ArduPilot mode, and what else is its own.
"""

from functools import partial

from autopilot.interface.client_requests import GoTo, OffboardSetpoint, OrbitRequest, TargetReport
from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import (
    AUTO_OVERRIDE,
    HOLD_EXCEPTED,
    MISSION_EXCEPTED,
    OFFBOARD_EXCEPTED,
    OFFBOARD_OVERRIDE,
    Disarmed,
    ModeSpec,
    Px4Main,
    StandardMode,
    px4_mode,
)
from autopilot.interface.vehicle_state import Mode

_by_sticks = partial(ModeSpec, needs_sticks=True, may_arm=True, on_ground=True, disarmed=Disarmed.SAME)

POSITION = partial(
    _by_sticks,
    mode=Mode.POSITION,
    needs_position=True,
    px4=px4_mode(Px4Main.POSCTL, 0, "Position"),
    standard=StandardMode.POSITION_HOLD,
    nav_state=2,
    shell_name="posctl",
    switch=2,
    rests_in_middle=True,
)
STABILIZED = partial(
    _by_sticks,
    mode=Mode.STABILIZED,
    px4=px4_mode(Px4Main.STABILIZED, 0, "Stabilized"),
    is_advanced=True,
    nav_state=15,
    switch=8,
)
MANUAL = partial(
    _by_sticks,
    mode=Mode.MANUAL,
    px4=px4_mode(Px4Main.MANUAL, 0, "Manual"),
    is_advanced=True,
    nav_state=0,
    shell_name="manual",
    switch=0,
)
ACRO = partial(
    _by_sticks,
    mode=Mode.ACRO,
    px4=px4_mode(Px4Main.ACRO, 0, "Acro"),
    is_advanced=True,
    nav_state=10,
    switch=6,
    aux_function=52,
)
HOLD = partial(
    ModeSpec,
    mode=Mode.HOLD,
    may_arm=True,
    on_ground=True,
    takes=(GoTo,),
    px4=px4_mode(Px4Main.AUTO, 3, "Hold"),
    nav_state=4,
    shell_name="auto:loiter",
    switch=4,
    carries_out=(Action.HOLD,),
    exception=HOLD_EXCEPTED,
    override=AUTO_OVERRIDE,
    rests_in_middle=True,
)
MISSION = partial(
    ModeSpec,
    mode=Mode.MISSION,
    needs_position=True,
    needs_home=True,
    may_arm=True,
    on_ground=True,
    px4=px4_mode(Px4Main.AUTO, 4, "Mission"),
    standard=StandardMode.MISSION,
    nav_state=3,
    shell_name="auto:mission",
    switch=3,
    aux_function=16,
    exception=MISSION_EXCEPTED,
    override=AUTO_OVERRIDE,
)
RETURN = partial(
    ModeSpec,
    mode=Mode.RETURN,
    needs_position=True,
    needs_home=True,
    px4=px4_mode(Px4Main.AUTO, 5, "Return"),
    standard=StandardMode.SAFE_RECOVERY,
    nav_state=5,
    shell_name="auto:rtl",
    switch=5,
    aux_function=4,
    strength=Action.RETURN,
    carries_out=(Action.RETURN,),
    exception=HOLD_EXCEPTED,
    override=AUTO_OVERRIDE,
)
OFFBOARD = partial(
    ModeSpec,
    mode=Mode.OFFBOARD,
    needs_position=True,
    may_arm=True,
    on_ground=True,
    disarmed=Disarmed.HOLD,
    takes=(OffboardSetpoint,),
    px4=px4_mode(Px4Main.OFFBOARD, 0, "Offboard"),
    is_advanced=True,
    nav_state=14,
    switch=7,
    exception=OFFBOARD_EXCEPTED,
    override=OFFBOARD_OVERRIDE,
)
FOLLOW = partial(
    ModeSpec,
    mode=Mode.FOLLOW,
    needs_position=True,
    takes=(TargetReport,),
    px4=px4_mode(Px4Main.AUTO, 8, "Follow Me"),
    nav_state=19,
    shell_name="auto:follow",
    switch=12,
    aux_function=57,
    exception=HOLD_EXCEPTED,
)
ORBIT = partial(
    ModeSpec,
    mode=Mode.ORBIT,
    needs_position=True,
    takes=(OrbitRequest,),
    px4=px4_mode(Px4Main.POSCTL, 1, "Orbit", is_selectable=False),
    standard=StandardMode.ORBIT,
    nav_state=21,
    aux_function=72,
    exception=HOLD_EXCEPTED,
)
