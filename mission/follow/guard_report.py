"""What a guard has changed of a companion's decisions, as a line of the terminal and as figures of `summary.json`."""

from collections import Counter
from typing import Any

from policies.companion.companion import Companion

DECISIONS_PER_MIN = 600.0  # ten a second
SHOWN = 3  # reasons on the scorecard, the most frequent


def guard_text(companion: Companion) -> str:
    """How many decisions there were, and what a guard has changed of them, most frequent first."""
    interventions = companion.skill.interventions
    reasons = ", ".join(f"{count} {reason}" for reason, count in (interventions or Counter()).most_common())
    changed = "no guard" if interventions is None else f"the guard changed {reasons or 'none'}"
    return f"{companion.decision_count} decisions; {changed}"


def guard_figures(companion: Companion) -> dict[str, Any]:
    """The same under the key `guard`: how many decisions, by the reason, and each per minute of decisions; null: none.

    A decision may be changed for several reasons.
    """
    interventions, decisions = companion.skill.interventions, companion.decision_count
    if interventions is None:
        return {"guard": None}
    changed = dict(interventions.most_common())
    per_min = {why: round(count * DECISIONS_PER_MIN / max(decisions, 1), 2) for why, count in changed.items()}
    return {"guard": {"decisions": decisions, "changed": changed, "changed_per_min": per_min}}


def guard_row(companion: Companion) -> tuple[str, str]:
    """A row of the scorecard: what a guard has changed per minute of decisions, the most frequent reasons."""
    guard = guard_figures(companion)["guard"]
    if guard is None:
        return "changed by the guard", "no guard"
    often = list(guard["changed_per_min"].items())[:SHOWN]
    return "changed by the guard, per minute", ", ".join(f"{per_min:.0f} {why}" for why, per_min in often) or "none"
