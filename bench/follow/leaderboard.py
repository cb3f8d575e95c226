"""`python -m bench.follow.leaderboard [FOLDER]`: the tables of docs/results/leaderboard.md, from its rows.

With FOLDER, its flights.json is entered first: a row in place of that of the same name.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from bench.cars.page import DOCS
from bench.follow.leaderboard_rows import (
    CONDITIONS,
    Entry,
    EntryError,
    entry_from,
    ranked,
    read_rows,
    score_interval,
    write_rows,
)
from common.files import write_whole
from mission.benchmark.session import markdown
from mission.follow.benchmark.conditions import BY_NAME
from policies.learn.export.provenance import short_commit
from policies.tasks.follow_me.scorecard import written

PAGE = DOCS / "leaderboard.md"
BEGIN, END = "<!-- entries:begin -->\n", "<!-- entries:end -->\n"
TITLES = tuple(BY_NAME[name].title for name in CONDITIONS)


def with_entries(text: str, entries: Sequence[Entry]) -> str:
    """The page's text with the tables of these entries between its markers."""
    head, rest = text.split(BEGIN)
    return head + BEGIN + _tables(ranked(entries)) + END + rest.split(END)[1]


def _tables(order: Sequence[Entry]) -> str:
    ranks = [_rank(place, entry, order[0]) for place, entry in enumerate(order, 1)]
    who = [(e.name, f"`{e.policy}`", e.sees, e.made, short_commit(e.commit)) for e in order]
    return "\n".join(
        [
            markdown(("", "policy", "in band, mean", "behind the first", "no collision", *TITLES), ranks),
            "Who they are:\n",
            markdown(("policy", "`--policy`", "sees", "how it came to be", "flown at"), who),
            "Flights that ended in a collision, those with people in brackets, and decisions that the guard changed:\n",
            markdown(("policy", *TITLES, "changed / min"), [_hits(entry) for entry in order]),
        ]
    )


def _rank(place: int, entry: Entry, first: Entry) -> tuple[str, ...]:
    return (
        str(place),
        entry.name,
        written(score_interval(entry), "%"),
        "-" if entry is first else written(score_interval(entry, first), "%"),
        written(entry.clear, "%"),
        *(f"{100.0 * value:.1f} %" for value in entry.figure("in_band").mean(axis=1)),
    )


def _hits(entry: Entry) -> tuple[str, ...]:
    hits, people = entry.figure("is_collided").sum(axis=1), entry.figure("is_somebody_hit").sum(axis=1)
    cells = [f"{hit:.0f} ({hurt:.0f})" for hit, hurt in zip(hits, people, strict=True)]
    return entry.name, *cells, f"{entry.figure('interventions_per_min').mean():.0f}"


app = typer.Typer(add_completion=False)


@app.command()
def main(
    folder: Annotated[Path | None, typer.Argument(help="--out of the benchmark. None: only writes the page.")] = None,
    name: Annotated[str, typer.Option(help="Of the entry; takes the place of one of the same name.")] = "",
    sees: Annotated[str, typer.Option(help="What the policy is shown.")] = "",
    made: Annotated[str, typer.Option(help="How it came to be: learner, decisions, time.")] = "",
) -> None:
    entries = read_rows()
    if folder is not None:
        if not (name and sees and made):
            raise typer.BadParameter("an entry has --name, --sees and --made")
        if any(sign in text for text in (name, sees, made) for sign in "|\n"):
            raise typer.BadParameter("--name, --sees and --made are cells of a table: no | and one line each")
        try:
            record = json.loads((folder / "flights.json").read_text(encoding="utf-8"))
            entry = entry_from(record, name, sees, made)
        except (OSError, EntryError) as error:
            raise typer.BadParameter(str(error)) from error
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise typer.BadParameter(f"{folder}/flights.json: not as the benchmark writes it: {error!r}") from error
        entries = [*(other for other in entries if other.name != name), entry]
    page = with_entries(PAGE.read_text(encoding="utf-8"), entries)
    if folder is not None:
        write_rows(entries)
    write_whole(PAGE, page.encode())


if __name__ == "__main__":
    app()
