"""A policy file whose card says how good it was found to be in worlds of validation, and what its teacher ships as."""

from collections.abc import Mapping
from pathlib import Path

from common.intervals import Interval
from policies.learn.checkpoint import load, save
from policies.learn.export.policy_file import POLICY


def write_judged(
    source: Path, target: Path, measure: str, found: Interval, episodes: int, teachers: Mapping[str, str] | None = None
) -> None:
    """Writes a policy with a figure of episodes that it did not train on in its card, in place of others of episodes.

    Args:
        source: the policy file.
        target: where it goes, which may be the same.
        measure: "success", or "band" for the time within it.
        found: the figure [1].
        episodes: that it is of.
        teachers: the names that teachers ship under, by where they were trained, which a card knows them by.
    """
    content = load(source, POLICY)
    figures = {f"{measure}_rate": found.value, f"{measure}_low": found.low, f"{measure}_high": found.high}
    of_training = {name: value for name, value in content["card"]["figures"].items() if name.startswith("training_")}
    content["card"]["figures"] = of_training | figures | {"episodes": episodes}
    for leg in (*content["card"].get("parents", ()), content["card"]):
        if name := (teachers or {}).get(leg.get("teacher", {}).get("policy")):
            leg["teacher"]["policy"] = name
    save(target, content, POLICY)
