"""`python -m bench.follow [STAGE…]`: trains the stages of docs/results/follow.md from scratch and writes the page.

Stages that are done (results/follow/STAGE-SEED.json) are kept and stopped ones go on; `--again` trains them anew,
`--page` only writes the page, `--shipped` takes what the shipped page was made of (docs/results/follow.jsonl) as done,
but where another stage needs a policy of a seed that does not ship.
What is not trained here stays on the page as it is recorded there, with the commit that trained it.
Policies stay in results/follow/; `--publish` puts them in the place of those that ship: of at least three seeds of a
stage the one that is best in worlds of validation (`bench.follow.choice`), with the teacher that it had. Whether it is
better than what ships is not asked: look at the page first. Two processes go side by side, each on a core of its own; a
stage waits for those it needs, and one that takes several cores for all others to end.
"""

import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import torch
import typer
from rich.console import Console

from bench.cars.page import DOCS
from bench.follow.choice import EPISODES, best_of
from bench.follow.page import write_page
from bench.follow.result import Result, read, read_all, write, write_all
from bench.follow.run import policy_path, result_path
from bench.follow.stages import STAGES, Stage, in_order
from bench.judged_card import write_judged
from bench.side_by_side import Job, run_side_by_side
from common.files import write_whole
from common.intervals import Interval
from policies.learn.export.policy_file import load_policy

RESULTS = Path("results/follow")
RUNS = DOCS / "follow.jsonl"
PRETRAINED = Path(__file__).parents[2] / "policies" / "pretrained"
SEEDS = 3  # the fewest that what ships is chosen among
console = Console(highlight=False)
Choose = Callable[[Sequence[Path]], tuple[Path, Interval]]


def main(
    names: Annotated[list[str] | None, typer.Argument(help="Stages, with those they need; default: all.")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds of each.")] = SEEDS,
    jobs: Annotated[int, typer.Option(min=1, help="Cores: each process has one, or all.")] = 2,
    again: Annotated[bool, typer.Option("--again", help="Train the named stages and those after them anew.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Train nothing, only write the page.")] = False,
    shipped: Annotated[bool, typer.Option("--shipped", help="Take the shipped page's results as done.")] = False,
    publish: Annotated[
        bool, typer.Option("--publish", help="Put the best seeds' policies in the place of those that ship.")
    ] = False,
) -> None:
    unknown = [name for name in names or () if name not in STAGES]
    if unknown:
        console.print(f"follow: no stage {unknown[0]}; there are {', '.join(STAGES)}", markup=False)
        raise typer.Exit(2)
    recorded = read_all(RUNS) if RUNS.exists() else []
    for result in recorded if shipped else []:
        _take(result, RESULTS)
    failed: list[str] = []
    if not page:
        if again:
            _forget(names or list(STAGES), seeds)
        failed = run_side_by_side(_jobs(names or list(STAGES), seeds), RESULTS, jobs, console)
    there = results(recorded)
    path = write_page(there)
    write_all(RUNS, [result for runs in there.values() for result in runs])
    console.print(f"wrote {path}")
    for line in published(RESULTS, PRETRAINED) if publish else unpublished(RESULTS, PRETRAINED):
        console.print(line, markup=False)
    for name in failed:
        console.print(f"[red]failed[/red] {name}: see {RESULTS / name}.log")
    raise typer.Exit(1 if failed else 0)


def results(recorded: Sequence[Result] = ()) -> dict[str, list[Result]]:
    """Every result there is here, else as it is recorded, by stage and in order of seed."""
    found: dict[str, list[Result]] = {}
    for name in STAGES:
        paths = [path for path in RESULTS.glob(f"{name}-*.json") if path.stem.rsplit("-", 1)[0] == name]
        by_seed = {result.seed: result for result in recorded if result.stage == name}
        by_seed |= {result.seed: result for result in map(read, paths)}
        found[name] = [by_seed[seed] for seed in sorted(by_seed)]
    return found


def _take(result: Result, folder: Path) -> None:
    """Takes a result as done, with its policy where that ships; not without, where something still needs the policy."""
    path, stage = result_path(folder, result.stage, result.seed), STAGES[result.stage]
    shipped = PRETRAINED / stage.file_name
    is_there = stage.ships and shipped.exists() and load_policy(shipped)[1].seed == result.seed
    is_needed = any(stage.name in other.before for other in STAGES.values())
    if path.exists() or (not is_there and (is_needed or (stage.flies and not result.cards(is_flown=True)))):
        return
    write(path, result)
    if is_there:
        write_whole(policy_path(folder, result.stage, result.seed), shipped.read_bytes())


def published(results_folder: Path, pretrained: Path, choose: Choose = best_of) -> list[str]:
    """Puts policies among those that ship, under the names of their recipes; says which, and where seeds are missing.

    A teacher that ships is not chosen: it is that of the seed that ships of those whom it taught.

    Args:
        results_folder: where they were trained.
        pretrained: where those that ship are.
        choose: the best of the seeds' of a stage, or of the one that there is.
    """
    lines = []
    for stage, trained in _trained(results_folder):
        if len(trained) < SEEDS:
            lines.append(f"{stage.file_name}: stays: of {stage.name} {len(trained)} of the {SEEDS} seeds are trained")
            continue
        best, found = choose(trained)
        seed = load_policy(best)[1].seed
        along = {
            path: earlier.file_name
            for earlier in in_order([*stage.before])
            if earlier.ships and (path := policy_path(results_folder, earlier.name, seed)).exists()
        }
        teachers = {str(path): Path(name).stem for path, name in along.items()}
        lines += _put(best, found, pretrained / stage.file_name, teachers)
        for path, name in along.items():
            lines += _put(*choose([path]), pretrained / name)
    return lines


def _put(policy: Path, found: Interval, ships: Path, teachers: Mapping[str, str] | None = None) -> list[str]:
    before = ships.read_bytes() if ships.exists() else b""
    write_judged(policy, ships, "band", found, EPISODES, teachers)
    return [f"{ships.name}: ships now what lies in {policy}"] if ships.read_bytes() != before else []


def unpublished(results_folder: Path, pretrained: Path) -> list[str]:
    """A line for each stage of whose policies none is the one that ships, which stays."""
    lines = []
    for stage, trained in _trained(results_folder):
        ships = pretrained / stage.file_name
        if not any(_is_same(path, ships) for path in trained):
            how = "--publish" if len(trained) >= SEEDS else f"--publish asks for {SEEDS} seeds"
            lines.append(f"{', '.join(map(str, trained))}: not {ships.name}, which still ships: {how}")
    return lines


def _trained(results_folder: Path) -> list[tuple[Stage, list[Path]]]:
    """The policies of all seeds of each stage that has been trained and ships by choice: not along with a later one."""
    shipping = [stage for stage in STAGES.values() if stage.ships]
    earlier = {before.name for stage in shipping for before in in_order([*stage.before])}
    stages = [stage for stage in shipping if stage.name not in earlier]
    found = [(stage, sorted(results_folder.glob(f"{stage.name}-[0-9]*.pt"))) for stage in stages]
    return [(stage, trained) for stage, trained in found if trained]


def _is_same(trained: Path, ships: Path) -> bool:
    """Whether two files hold one policy, whatever their cards say."""
    if not ships.exists():
        return False
    own, other = (load_policy(path)[0].state_dict() for path in (trained, ships))
    return own.keys() == other.keys() and all(torch.equal(own[name], other[name]) for name in own)


def _jobs(names: Sequence[str], seeds: int) -> list[Job]:
    """What is left to do, in order."""
    jobs: list[Job] = []
    for seed in range(1, seeds + 1):
        for stage in in_order(list(names)):
            path = result_path(RESULTS, stage.name, seed)
            words = (stage.name, str(seed), str(RESULTS))
            name = f"{stage.name}-{seed}"
            if not path.exists():
                there = partial(_are_done, stage.before, seed)
                jobs.append(Job(name, ("bench.follow.run", *words), takes_all=stage.takes_all, is_ready=there))
            if stage.flies and not (path.exists() and read(path).cards(is_flown=True)):
                is_trained = partial(_are_done, (stage.name,), seed)
                jobs.append(Job(f"{name}-flown", ("bench.follow.flights", *words), is_ready=is_trained))
    return jobs


def _are_done(names: Sequence[str], seed: int) -> bool:
    return all(path(RESULTS, name, seed).exists() for name in names for path in (result_path, policy_path))


def _forget(names: Sequence[str], seeds: int) -> None:
    """Takes away what came of stages, and of those that come after them."""
    for name in STAGES:
        if not {stage.name for stage in in_order([name])} & {*names}:
            continue
        for seed in range(1, seeds + 1):
            result_path(RESULTS, name, seed).unlink(missing_ok=True)
            shutil.rmtree(RESULTS / "runs" / f"{name}-{seed}", ignore_errors=True)


if __name__ == "__main__":
    typer.run(main)
