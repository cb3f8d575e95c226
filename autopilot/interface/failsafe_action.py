"""What failsafes do."""

from enum import IntEnum


class Action(IntEnum):
    """What to do, in rising order: a failsafe never replaces a stronger one."""

    WARN = 0
    ALTITUDE = 1  # the pilot flies on without a position
    HOLD = 2
    SMART_RETURN = 3  # back along its own track; directly where that is not known
    RETURN = 4
    LAND = 5  # blind if the position is lost
    TERMINATE = 6  # motors stopped, wherever the vehicle is; disarmed once it lies on the ground
    DISARM = 7  # at once
