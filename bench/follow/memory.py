"""`python -m bench.follow.memory [--seeds N]`: what a policy's own memory adds to that of filter and map.

Students of the same teacher, trained alike but for what they remember; who drives is drawn for each decision, of those
with a network's memory for each stretch of 16. Judged in worlds of validation with an x500 on the flight controller's
estimate. In: the teacher that ships. Out: a table of the time in the band and of collisions, of one seed with the
interval over episodes, of several the mean over seeds with Student's; the policies stay in results/memory/.
"""

from pathlib import Path
from typing import Annotated, Any

import torch
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from bench.cars.run import Curve, changed, with_settings
from bench.cars.statistics import over_seeds
from bench.follow.choice import judged
from common.intervals import Interval
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.config.run import RunConfig
from policies.learn.export.policy_file import load_policy, save_policy
from policies.learn.trainer import train
from policies.tasks.follow_me.scorecard import written

FOLDER = Path("results/memory")
RECIPE = "follow-me-tracked-student"
EPISODES = 1000  # of each policy
_LSTM = {"sequence_length": 16, "memory_size": 256}
_TRANSFORMER = {"memory_type": "transformer", "sequence_length": 16, "layers": 2, "heads": 4}
MEMORIES: dict[str, tuple[int, dict[str, Any] | None]] = {  # frames, and the network's memory
    "none": (1, None),
    "frames-3": (3, None),
    "frames-6": (6, None),
    "lstm": (1, _LSTM),
    "transformer": (1, _TRANSFORMER),
}


def main(
    names: Annotated[list[str] | None, typer.Argument(help="Of none, frames-3, frames-6, lstm, transformer.")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Trainings of each.")] = 3,
    episodes: Annotated[int, typer.Option(min=2, help="That each policy is judged on.")] = EPISODES,
) -> None:
    unknown = [name for name in names or () if name not in MEMORIES]
    if unknown:
        raise typer.BadParameter(f"no memory {unknown[0]}; there are {', '.join(MEMORIES)}")
    torch.set_num_threads(1)
    console = Console(highlight=False)
    table = Table("memory", "in band", "hit something", "each seed in band")
    for name in track(names or list(MEMORIES), "memories", console=console, transient=True):
        cards = [judged(trained(name, seed), "x500", episodes) for seed in range(1, seeds + 1)]
        each = ", ".join(f"{100 * card.in_band.value:.1f}" for card in cards)
        table.add_row(name, _over_seeds([c.in_band for c in cards]), _over_seeds([c.collision for c in cards]), each)
    console.print(table)


def configured(name: str, seed: int) -> RunConfig:
    """A student's training: the recipe's, but for what it remembers."""
    frames, memory = MEMORIES[name]
    config = load_config(recipe(RECIPE)).config
    changes = {
        "behavior.network_settings.memory": memory,
        "env_settings.env_args": with_settings(config.env_settings.env_args, {"stack": frames}),
        "env_settings.seed": seed,
        "checkpoint_settings.run_id": f"{name}-{seed}",
        "checkpoint_settings.results_dir": str(FOLDER / "runs"),
        "checkpoint_settings.force": True,
    }
    return changed(config, changes)


def trained(name: str, seed: int) -> Path:
    """A student with a memory; the one that is there, if there is one."""
    path = FOLDER / f"{name}-{seed}.pt"
    if not path.exists():
        config = configured(name, seed)
        result = train(config, Curve(config.behavior.max_steps))
        save_policy(path, *load_policy(result.policy), is_half=True)
    return path


def _over_seeds(found: list[Interval]) -> str:
    return written(found[0] if len(found) == 1 else over_seeds([each.value for each in found]), "%")


if __name__ == "__main__":
    typer.run(main)
