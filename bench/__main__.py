"""`python -m bench [NAME…]`: runs the benchmarks, prints a table and writes bench/results.json.

Each script has a function `measure` that checks its result before it times it, and returns rows. Rows of scripts that
are not run this time stay in the file. Exit code 1: a result was wrong; a missed target is only shown.
"""

import json
import sys
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from bench.row import Row, WrongResult, machine
from common.files import write_whole

SCRIPTS = {
    "flights": "bench.flying.flights",
    "drives": "bench.flying.drives",
    "flight": "bench.flying.flight",
    "vehicles": "bench.flying.vehicles",
    "python_share": "bench.flying.python_share",
    "batch": "bench.flying.batch",
    "threads": "bench.flying.threads",
    "engines": "bench.flying.engines",
    "missions": "bench.flying.engine_missions",
    "links": "bench.flying.links",
    "scaling": "bench.flying.scaling",
    "worlds": "bench.flying.worlds",
    "scenarios": "bench.flying.scenarios",
    "hover": "bench.learning.hover",
    "environments": "bench.learning.environments",
    "training": "bench.learning.training",
    "roofline": "bench.learning.roofline",
    "sac": "bench.learning.sac",
    "offline": "bench.learning.offline",
    "dataset": "bench.learning.dataset_build",
    "companion": "bench.learning.companion",
    "tracker": "bench.learning.tracker",
    "camera": "bench.flying.camera",
    "film": "bench.flying.film",
    "startup": "bench.flying.startup",
    "gpu": "bench.flying.gpu",
}
"""Modules of the benchmarks by name, in the order of the table."""
RESULTS = Path(__file__).parent / "results.json"


def main(names: list[str]) -> int:
    console = Console(highlight=False)
    unknown = [name for name in names if name not in SCRIPTS]
    if unknown:
        Console(stderr=True).print(f"bench: no benchmark {unknown[0]}; there are {', '.join(SCRIPTS)}", markup=False)
        return 2
    rows: list[Row] = []
    wrong: list[str] = []
    for name in names or SCRIPTS:
        console.print(f"[dim]{name} …[/dim]")
        try:
            rows += import_module(SCRIPTS[name]).measure()
        except WrongResult as error:
            wrong.append(f"{name}: {error}")
    console.print(_table(rows))
    for sentence in wrong:
        console.print(f"[red]wrong result[/red]  {sentence}")
    _write(rows, kept=_earlier(names) if names else [])
    return 1 if wrong else 0


def _table(rows: list[Row]) -> Table:
    table = Table(title=machine(), title_justify="left")
    for heading, side in (("", "left"), ("measured", "right"), ("", "left"), ("target", "right"), ("", "left")):
        table.add_column(heading, justify=side)  # type: ignore[arg-type]
    for row in rows:
        sign = "≥" if row.better == "higher" else "≤"
        target = "" if row.target is None else f"{sign} {row.target:g}"
        verdict = "" if row.target is None else "[green]ok[/green]" if row.is_met else "[red]miss[/red]"
        table.add_row(
            row.name, f"{row.value:,.4g}" if row.value < 1e4 else f"{row.value:,.0f}", row.unit, target, verdict
        )
    return table


def _earlier(names: list[str]) -> list[dict[str, Any]]:
    """The rows in the file that are not of the named scripts."""
    rows = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    return [row for row in rows if row["command"].split()[-1] not in names]


def _write(rows: list[Row], kept: list[dict[str, Any]]) -> None:
    """Writes the rows measured now and those kept, in the order of the scripts."""
    here = machine()
    listed = kept + [asdict(row) | {"machine": here} for row in rows]
    order = list(SCRIPTS)
    listed.sort(key=lambda row: order.index(row["command"].split()[-1]))
    write_whole(RESULTS, (json.dumps(listed, indent=1, ensure_ascii=False) + "\n").encode())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
