"""`honeyguide review`: logs in, one HTML file out; of a folder of runs an index and one file each."""

import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from common.files import write_whole
from mission.console.terminal import busy, print_line
from mission.review.flight_review import FlightReview, review_flight
from mission.review.found_logs import FoundLog, found_logs
from mission.review.index_page import IndexRow, index_page, index_row, unreadable_row
from mission.review.logged_flight import ReviewError
from mission.review.review_page import review_page

PAGE = "review.html"
COMPARED_MAX = 2


@dataclass(frozen=True, slots=True)
class ReviewOptions:
    """The options of `honeyguide review`, as given."""

    logs: Sequence[Path]
    output: Path | None
    opens: bool


def review(options: ReviewOptions, console: Console) -> Path:
    """Writes the review and returns its file.

    Raises:
        ReviewError: a log cannot be read, or the page cannot be written.
    """
    if len(options.logs) > COMPARED_MAX:
        raise ReviewError(f"{len(options.logs)} logs were given: two are compared; of more, name their folder")
    found = [found_logs(path) for path in options.logs]
    if len(found) == 1 and len(found[0]) > 1:
        target = _review_many(options.logs[0], found[0], options.output, console)
    else:
        for path, logs in zip(options.logs, found, strict=True):
            if len(logs) > 1:
                raise ReviewError(f"{path}: holds {len(logs)} logs: name one of them to compare it")
        target = _review_one([logs[0] for logs in found], options, console)
    print_line(console, f"review: {target}")
    if options.opens:
        webbrowser.open(target.resolve().as_uri())
    return target


def _review_one(found: Sequence[FoundLog], options: ReviewOptions, console: Console) -> Path:
    """The page of one flight, or of two laid over each other."""
    target = options.output or _beside(options.logs[0], found)
    reviews: list[FlightReview] = []
    for log in found:
        with busy(console, f"reading {log.parts[0]}"):
            first = reviews[0].track if reviews else None
            reviews.append(review_flight(log.parts, log.name, log.folder, first.origin if first else None))
    _tell_faults(reviews, console)
    with busy(console, "drawing"):
        _write(target, review_page(reviews, " and ".join(log.name for log in found)))
    return target


def _beside(path: Path, found: Sequence[FoundLog]) -> Path:
    name = PAGE if len(found) == 1 else "compare.html"
    if found[0].folder is not None:
        return found[0].folder / name
    return path.with_name(f"{path.stem}-{name}")


def _review_many(folder: Path, found: Sequence[FoundLog], output: Path | None, console: Console) -> Path:
    """An index, and the page of each flight beside its log; all in one folder where one is named."""
    rows: list[IndexRow] = []
    with busy(console, f"reviewing {len(found)} flights") as say:
        for number, log in enumerate(found):
            say(f"reviewing {log.name} ({number + 1} of {len(found)})")
            page = _page_of(log, number, output)
            try:
                reviewed = review_flight(log.parts, log.name, log.folder, None)
            except ReviewError as error:
                rows.append(unreadable_row(log.name, str(error)))
                continue
            _tell_faults([reviewed], console)
            _write(page, review_page([reviewed], log.name))
            start = output if output is not None else folder
            rows.append(index_row(reviewed, page.relative_to(start).as_posix()))
    target = (output or folder) / ("index.html" if output is not None else PAGE)
    _write(target, index_page(rows, folder.resolve().name))
    return target


def _page_of(log: FoundLog, number: int, output: Path | None) -> Path:
    if output is not None:
        return output / f"{number + 1:03}-{log.name.replace('/', '-')}.html"
    if log.folder is not None:
        return log.folder / PAGE
    return log.parts[0].with_name(f"{log.parts[0].stem}-{PAGE}")


def _tell_faults(reviews: Sequence[FlightReview], console: Console) -> None:
    for reviewed in reviews:
        if reviewed.result_fault:
            print_line(console, reviewed.result_fault)


def _write(target: Path, page: bytes) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, page)
    except OSError as error:
        raise ReviewError(f"{target}: cannot be written: {error.strerror or error}; name another --output") from error
