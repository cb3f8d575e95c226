"""`python -m bench.cars [NAME…]`: trains every row of docs/results/cars.md from scratch and writes the page.

Runs that are done (results/cars/NAME-SEED.json) are kept; `--again` trains them anew, `--page` only writes the page,
`--shipped` takes the runs that the shipped page was made of (docs/results/cars.jsonl) as done: without it the page is
of what has been run here alone. Policies stay in results/cars/; `--publish` puts the best seeds' in the place of those
that ship. Two runs go side by side, each on a core of its own.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from bench.cars.experiment import Experiment
from bench.cars.experiments import EXPERIMENTS, SECTIONS
from bench.cars.page import DOCS, write_page
from bench.cars.result import Evaluated, Result, read, read_all, write, write_all
from bench.judged_card import write_judged
from bench.side_by_side import Job, run_side_by_side
from common.intervals import rate_of

RESULTS = Path("results/cars")
RUNS = DOCS / "cars.jsonl"
PRETRAINED = Path(__file__).parents[2] / "policies" / "pretrained"
console = Console(highlight=False)


def main(
    names: Annotated[list[str] | None, typer.Argument(help="Experiments; default: all.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Seeds of each, instead of the page's.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side, one core each.")] = 2,
    again: Annotated[bool, typer.Option("--again", help="Train anew what is there.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Train nothing, only write the page.")] = False,
    shipped: Annotated[bool, typer.Option("--shipped", help="Take the shipped page's runs as done.")] = False,
    publish: Annotated[
        bool, typer.Option("--publish", help="Put the best seeds' policies in the place of those that ship.")
    ] = False,
) -> None:
    unknown = [name for name in names or () if name not in EXPERIMENTS]
    if unknown:
        console.print(f"cars: no experiment {unknown[0]}; there are {', '.join(EXPERIMENTS)}", markup=False)
        raise typer.Exit(2)
    if shipped:
        for result in read_all(RUNS):
            path = RESULTS / f"{result.experiment}-{result.seed}.json"
            if not path.exists():
                write(path, result)
    chosen = [EXPERIMENTS[name] for name in names or EXPERIMENTS]
    todo = [] if page else _jobs(chosen, seeds, again=again)
    failed = run_side_by_side(todo, RESULTS, jobs, console)
    there = results()
    path = write_page(there)
    write_all(RUNS, [result for runs in there.values() for result in runs])
    console.print(f"wrote {path}")
    if publish:
        _publish(there)
    for name in failed:
        console.print(f"[red]failed[/red] {name}: see {RESULTS / name}.log")
    raise typer.Exit(1 if failed else 0)


def results() -> dict[str, list[Result]]:
    """Every run there is, by experiment and in order of seed."""
    found: dict[str, list[Result]] = {}
    for experiment in EXPERIMENTS.values():
        runs = [read(path) for path in RESULTS.glob(f"{experiment.name}-*.json") if _is_of(path, experiment.name)]
        found[experiment.name] = sorted(runs, key=lambda result: result.seed)
    return found


def _publish(there: dict[str, list[Result]]) -> None:
    """Puts the best policies of the headline into policies/pretrained/, their cards with how they were judged."""
    for experiment in SECTIONS[0].experiments:
        runs = there.get(experiment.name, ())
        if len(runs) < experiment.seeds or (best := shipped(experiment, runs)) is None:
            continue  # the best of fewer seeds than the page's is none
        seed, judged = best
        if (trained := RESULTS / f"{experiment.name}-{seed}.pt").exists():
            found = rate_of(judged.successes, judged.episodes)
            write_judged(trained, PRETRAINED / f"{experiment.name}.pt", "success", found, judged.episodes)


def shipped(experiment: Experiment, runs: Sequence[Result]) -> tuple[int, Evaluated] | None:
    """The seed whose policy ships, and what it came to where the experiment chooses; none where it does not."""
    for k, judged in enumerate(experiment.judged):
        if judged.chooses and runs:
            best = max(runs, key=lambda result: (result.evaluations[k].successes, -result.seed))
            return best.seed, best.evaluations[k]
    return None


def _is_of(path: Path, name: str) -> bool:
    return path.stem.rsplit("-", 1)[0] == name


def _jobs(chosen: list[Experiment], seeds: int | None, *, again: bool) -> list[Job]:
    """Longest first within a seed would finish sooner; in order, a stopped reproduction has whole rows."""
    jobs: list[Job] = []
    for experiment in chosen:
        for seed in range(1, (seeds or experiment.seeds) + 1):
            path = RESULTS / f"{experiment.name}-{seed}.json"
            if again or not path.exists():
                words = ("bench.cars.run", experiment.name, str(seed), str(path))
                jobs.append(Job(path.stem, words, threads=experiment.threads))
    return jobs


if __name__ == "__main__":
    typer.run(main)
