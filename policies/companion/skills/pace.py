"""Ten decisions a second, as in training, however often images or scans come."""

DECISION_US = 100_000
EARLY_US = 50_000  # something new may come so much earlier,
LATE_US = 50_000  # and is waited for so much longer
_FOLLOWS = 0.05  # of how early or late it was the next are: those of 10 Hz fall on what they are made on


class Pace:
    """Of one skill."""

    def __init__(self) -> None:
        self._due_us = -DECISION_US  # when the last decision was due,
        self._made_us = -DECISION_US  # and when it was made

    def is_due(self, time_us: int, *, is_new: bool) -> bool:
        """Whether to decide now.

        Args:
            time_us: the companion's own clock.
            is_new: there is something that was not decided on.
        """
        wait_us = DECISION_US + (-EARLY_US if is_new else LATE_US)
        return time_us - self._due_us >= wait_us and time_us - self._made_us >= EARLY_US

    def decided(self, time_us: int) -> None:
        """A decision is made: the next is due a period after this one was, or after now if this one was too late."""
        due_us = self._due_us + DECISION_US
        off_us = time_us - due_us
        self._made_us = time_us
        self._due_us = due_us + round(_FOLLOWS * off_us) if off_us <= 2 * LATE_US else time_us
