"""`python -m bench.follow.choice POLICY… [--out FILE]`: which of some policies of following is best, by validation.

In: policy files of FollowMe that all see the same, such as several seeds of a recipe. Out: how long each stays in the
band, with 95 % intervals, best first by where the interval begins, and that one as FILE, whose card says it; those with
`observation=tracked` fly under the guard's rule of people. The episodes, of split `validation`, are not flown in a
test, nor trained on since there is that split.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from bench.follow.judge import first_episodes
from bench.judged_card import write_judged
from common.intervals import Interval
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe as recipe_file
from policies.learn.config.recipes import recipe_names
from policies.learn.curriculum import Curriculum
from policies.learn.export.policy_file import load_policy
from policies.tasks.catalogue import task_settings
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.scorecard import Scorecard, scorecard, written
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.task_params import Sampler

WIDE = "x500+f450+f550"
EPISODES = 1000  # of each policy: two minutes


def main(
    policies: list[Path],
    airframe: Annotated[str, typer.Option(help="Of several with + between them one is drawn per episode.")] = WIDE,
    episodes: Annotated[int, typer.Option(min=2, help="Of each policy.")] = EPISODES,
    recipe: Annotated[str | None, typer.Option(help="Draw episodes as its last lesson; not airframes.")] = None,
    out: Annotated[Path | None, typer.Option(help="The best goes there.")] = None,
) -> None:
    if recipe is not None and out is not None:
        raise typer.BadParameter("--out: a card's figure is of the preset's episodes, without --recipe")
    numbers = {} if recipe is None else numbers_of(recipe)
    found = {path: judged(path, airframe, episodes, numbers) for path in track(policies, "judging", transient=True)}
    table = Table("policy", "in band", "collided")
    ordered = best_first({path: card.in_band for path, card in found.items()})
    for path in ordered:
        table.add_row(str(path), written(found[path].in_band, "%"), written(found[path].collision, "%"))
    Console().print(table)
    if out is not None:
        write_judged(ordered[0], out, "band", found[ordered[0]].in_band, episodes)


def numbers_of(recipe: str) -> dict[str, Sampler]:
    """What a recipe's episodes are drawn from in its last lesson.

    Raises:
        BadParameter: there is no such recipe.
    """
    if recipe not in recipe_names():
        raise typer.BadParameter(f"--recipe {recipe}: none of {', '.join(recipe_names())}")
    return Curriculum(load_config(recipe_file(recipe)).config.environment_parameters).final_params()


def judged(path: Path, airframe: str, episodes: int, numbers: Mapping[str, Sampler] | None = None) -> Scorecard:
    """A policy in worlds of validation, on the flight controller's estimate; other numbers are the preset's."""
    policy, card = load_policy(path)
    changed = {"split": "validation", "airframe": airframe, "has_estimator": "true", "terrain": "fresh"}
    settings = task_settings("FollowMe", {key: str(value) for key, value in card.settings.items()} | changed)
    assert isinstance(settings, FollowSettings)
    task = FollowMe(settings, episodes)
    task.layout.require(policy.layout, str(path))
    tracks, _ = first_episodes(policy, task, numbers or {})
    return scorecard(tracks)


def best_first(found: Mapping[Path, Interval]) -> list[Path]:
    """Policies by where their intervals begin, the highest first."""
    return sorted(found, key=lambda path: -found[path].low)


def best_of(paths: Sequence[Path]) -> tuple[Path, Interval]:
    """The policy whose interval of the time in the band begins highest, and that interval."""
    found = {path: judged(path, WIDE, EPISODES).in_band for path in paths}
    best = best_first(found)[0]
    return best, found[best]


if __name__ == "__main__":
    typer.run(main)
