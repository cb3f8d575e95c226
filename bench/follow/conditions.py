"""`python -m bench.follow.conditions POLICY…`: policies without images in harder conditions, judged in batch.

In: policy files of FollowMe with `observation=tracked`. Out: how long they stay in the band and how often they touch
something, with intervals, in worlds of the test split, under the guard's rules of people alone; sights are drawn from
the model that training has. What a policy comes to in flight only `honeyguide benchmark follow` tells: this takes a
minute a policy, that an hour.
"""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from bench.follow.judge import first_episodes
from mission.follow.benchmark.conditions import AIRFRAME, BY_NAME, Condition
from policies.learn.export.policy_file import load_policy
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_params import FOLLOW_PARAMS, SEEN_BY_TRACKER
from policies.tasks.follow_me.scorecard import scorecard, written
from policies.tasks.follow_me.settings import FollowSettings
from sim.world.people import RUN_SPEED_M_S, WALK_SPEED_M_S

EPISODES = 96
_COSTS = ("_cost", "_reward", "_width_m", "_width_deg")
_USUAL = {n.name: n.default for n in FOLLOW_PARAMS if n.name in SEEN_BY_TRACKER and not n.name.endswith(_COSTS)}
_AIR = {"wind_m_s": 4.0, "wind_gust_m_s": 1.5, "trees_per_ha": 100.0}
_IN_BATCH = [  # what training has: one airframe, and GNSS
    name for name, each in BY_NAME.items() if each.airframe == AIRFRAME and each.gnss_away_s is None
]
_SPEEDS_M_S = {"walk": WALK_SPEED_M_S, "run": RUN_SPEED_M_S}


def main(
    policies: list[Path],
    condition: Annotated[
        list[str] | None, typer.Option(help="Default: all without hiding, by the usual airframe.")
    ] = None,
    *,
    guard: Annotated[bool, typer.Option(help="Under the guard's rules of people; not of trees.")] = True,
) -> None:
    names = condition or [name for name in _IN_BATCH if not name.startswith("gone")]
    unknown = [name for name in names if name not in _IN_BATCH]
    if unknown:
        raise typer.BadParameter(f"{unknown[0]}: in batch there are {', '.join(_IN_BATCH)}")
    table = Table("policy", "condition", "in band", "collided")
    for path in policies:
        policy, _ = load_policy(path)
        stack = policy.layout.stack
        task = FollowMe(FollowSettings(observation="tracked", owner="any", split="test", stack=stack), EPISODES)
        for name in names:
            tracks, _ = first_episodes(policy, task, {**numbers_of(BY_NAME[name]), "guard": guard})
            card = scorecard(tracks)
            table.add_row(str(path), name, written(card.in_band, "%"), written(card.collision, "%"))
    Console().print(table)


def numbers_of(condition: Condition) -> dict[str, Any]:
    """FollowMe's numbers that make a condition in batch."""
    given = {"wind_m_s": condition.wind_m_s} if condition.wind_m_s is not None else {}
    own = {"owner_speed_max": _SPEEDS_M_S[condition.pace], "sensor_roughness": condition.sensor_roughness}
    return {**_USUAL, **_AIR, **own, **given, **condition.numbers}


if __name__ == "__main__":
    typer.run(main)
