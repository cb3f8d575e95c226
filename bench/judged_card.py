"""A policy file whose card says how good it was found to be in worlds of validation, and is else as it was."""

from pathlib import Path

from common.intervals import Interval
from policies.learn.checkpoint import load, save
from policies.learn.export.policy_file import POLICY


def write_judged(source: Path, target: Path, measure: str, found: Interval, episodes: int) -> None:
    """Writes a policy with a figure of episodes that it did not train on in its card.

    Args:
        source: the policy file.
        target: where it goes, which may be the same.
        measure: "success", or "band" for the time within it.
        found: the figure [1].
        episodes: that it is of.
    """
    content = load(source, POLICY)
    figures = {f"{measure}_rate": found.value, f"{measure}_low": found.low, f"{measure}_high": found.high}
    content["card"]["figures"] |= figures | {"episodes": episodes}
    save(target, content, POLICY)
