"""What a guard changes of a policy's decisions, and why: counted, of the newest decision, and as texts where it begins.

In: a reason for each change, as a guard makes it. Out: counts of a flight, the reasons of now, and a text for the pilot
when one begins. Stances are reasons, too; whoever has the guard says when they change.
"""

from collections import Counter
from collections.abc import Sequence

NEAR_SOMEBODY, NEAR_SOMETHING, NO_DEPTH = "near somebody", "near something", "no depth"
OVER_OWNER, OVER_SOMEBODY = "over the owner", "over somebody near"
TOO_FAST, HEIGHT, TILTED = "too fast", "height", "tilted"
NO_GNSS, OLD_TELEMETRY = "no GNSS", "old telemetry"
REASONS = (
    NEAR_SOMEBODY, NEAR_SOMETHING, NO_DEPTH, OVER_OWNER, OVER_SOMEBODY, TOO_FAST, HEIGHT, TILTED,
    NO_GNSS, OLD_TELEMETRY,
)  # fmt: skip
"""Those that are no stances. A log keeps their places: new ones go to the end."""
BEGINS_US = 5_000_000  # a reason that was not there for so long begins
TEXT_US = 1_000_000  # between two texts about reasons


class Interventions(Counter[str]):
    """How many decisions of a flight were changed, by the reason."""

    def __init__(self) -> None:
        super().__init__()
        self.latest: list[str] = []
        """Why the newest decision was changed."""

    def decide(self) -> None:
        """A new decision is looked at."""
        self.latest.clear()

    def note(self, reason: str) -> None:
        """The decision is changed."""
        self[reason] += 1
        self.latest.append(reason)


class BeginningReasons:
    """Which reasons begin: a text for each that was not there for 5 s, one a second, of what is not over by then."""

    def __init__(self) -> None:
        self._last_us: dict[str, int] = {}  # when each was there, on the vehicle's clock
        self._due: list[str] = []  # have begun and were not said
        self._text_us: int | None = None  # when the last text was; None: never

    def text(self, latest: Sequence[str], boot_us: int) -> str:
        """What the pilot is told after a decision; "": nothing.

        Args:
            latest: the reasons of the decision.
            boot_us: the vehicle's clock.
        """
        reasons = [reason for reason in REASONS if reason in latest]
        if self._text_us is not None and boot_us < self._text_us:  # it has restarted
            self._last_us, self._text_us = {}, None
        new = [reason for reason in reasons if boot_us - self._last_us.get(reason, -BEGINS_US) >= BEGINS_US]
        self._due = [reason for reason in self._due if reason in reasons and reason not in new] + new
        self._last_us |= dict.fromkeys(reasons, boot_us)
        if not self._due or (self._text_us is not None and boot_us - self._text_us < TEXT_US):
            return ""
        self._text_us = boot_us
        return f"guard: {self._due.pop(0)}"
