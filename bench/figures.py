"""`python -m bench.figures`: puts bench/results.json into the table of docs/reference/benchmarks.md."""

import json
from pathlib import Path
from typing import Any

from common.files import write_whole

RESULTS = Path(__file__).parent / "results.json"
PAGE = Path(__file__).parent.parent / "docs" / "reference" / "benchmarks.md"
DETAILS = ("least of 20", "most of 20")  # of each source: in the table that `make bench` prints
BEGIN, END = "<!-- figures:begin -->\n", "<!-- figures:end -->\n"


def with_figures(text: str, rows: list[dict[str, Any]]) -> str:
    """The page's text with the given rows between its markers."""
    head, rest = text.split(BEGIN)
    tail = rest.split(END)[1]
    shown = [row for row in rows if not row["name"].endswith(DETAILS)]
    lines = []
    for machine in dict.fromkeys(row["machine"] for row in shown):
        lines.append(f"On {machine}:\n\n| figure | measured | target |\n|---|---|---|\n")
        lines += [_line(row) for row in shown if row["machine"] == machine] + ["\n"]
    return head + BEGIN + "".join(lines[:-1]) + END + tail


def _line(row: dict[str, Any]) -> str:
    value = f"{row['value']:,.3g}" if abs(row["value"]) < 1000.0 else f"{row['value']:,.0f}"
    sign = "≥" if row["better"] == "higher" else "≤"
    target = "" if row["target"] is None else f"{sign} {row['target']:g}"
    return f"| {row['name']} | {value} {row['unit']} | {target} |\n".replace("  ", " ")


def main() -> None:
    rows = json.loads(RESULTS.read_text(encoding="utf-8"))
    write_whole(PAGE, with_figures(PAGE.read_text(encoding="utf-8"), rows).encode())


if __name__ == "__main__":
    main()
