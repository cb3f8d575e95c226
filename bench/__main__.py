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

import warp as wp
from rich.console import Console
from rich.table import Table

from bench.row import Row, WrongResult, machine
from common.files import write_whole

SCRIPTS = ("flight", "python_share", "batch", "threads", "scaling", "hover", "startup")
RESULTS = Path(__file__).parent / "results.json"


def main(names: list[str]) -> int:
    console = Console(highlight=False)
    unknown = [name for name in names if name not in SCRIPTS]
    if unknown:
        Console(stderr=True).print(f"bench: no benchmark {unknown[0]}; there are {', '.join(SCRIPTS)}", markup=False)
        return 2
    wp.config.quiet = True
    rows: list[Row] = []
    wrong: list[str] = []
    for name in names or SCRIPTS:
        console.print(f"[dim]{name} …[/dim]")
        try:
            rows += import_module(f"bench.{name}").measure()
        except WrongResult as error:
            wrong.append(f"{name}: {error}")
    console.print(_table(rows))
    for sentence in wrong:
        console.print(f"[red]wrong result[/red]  {sentence}")
    _write(rows)
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


def _write(rows: list[Row]) -> None:
    """Replaces the rows measured now; the order is that of the scripts."""
    here = machine()
    fresh: dict[str, dict[str, Any]] = {row.name: asdict(row) | {"machine": here} for row in rows}
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    merged = {old["name"]: old for old in kept} | fresh
    order = [f"python -m bench {name}" for name in SCRIPTS]
    listed = sorted(
        merged.values(), key=lambda row: order.index(row["command"]) if row["command"] in order else len(order)
    )
    write_whole(RESULTS, (json.dumps(listed, indent=1, ensure_ascii=False) + "\n").encode())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
