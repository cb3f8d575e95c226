"""With which acceleration and jerk a way is planned, under limits that may be a parameter's -1 or 0: none."""

GRIP_M_S2 = 4.0  # what wheels hold on any ground; braking is planned with it where no limit is set; guess
_ANY_JERK_M_S3 = 1000.0


def planned_accel(limit: float) -> float:
    """An acceleration [m/s²] under a limit."""
    return limit if limit > 0.0 else GRIP_M_S2


def planned_jerk(limit: float) -> float:
    """A jerk [m/s³] under a limit."""
    return limit if limit > 0.0 else _ANY_JERK_M_S3
