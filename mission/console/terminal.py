"""What a command shows on the terminal: whole lines, and what it is busy with while nothing else can be seen."""

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from common.clock import wall_time_s
from common.files import write_to_nowhere

LINE_PERIOD_S = 5.0  # between lines where there is no terminal
LOADED_MOST = 50_000  # objects made until Python looks for garbage: at its own 700, that is a sixth of a start
Say = Callable[[str], None]


def print_line(console: Console, text: str) -> None:
    """One line however narrow the console is, at once also into a pipe: rich flushes.

    Where it cannot be written, as into a file on a full disk, this and what follows is lost: no flight ends by it.
    """
    try:
        console.print(text, markup=False, highlight=False, soft_wrap=True)
    except OSError as error:
        write_to_nowhere(1)
        with suppress(OSError):
            print(f"honeyguide: nothing more is printed: {error.strerror}", file=sys.stderr)


@contextmanager
def busy(console: Console, text: str) -> Iterator[Say]:
    """Shows what is under way, and for how long, until the block ends; what it yields changes the text.

    On a terminal it is one line that is renewed and goes away. Elsewhere it is a line at once, and one every
    `LINE_PERIOD_S` seconds.
    """
    if console.is_terminal:
        columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task(text, total=None)
            yield lambda new: progress.update(task, description=new)
        return
    print_line(console, f"{text} ...")
    lines = _Lines(console, text)
    try:
        yield lines.say
    finally:
        lines.end()


@contextmanager
def loading(console: Console) -> Iterator[Say]:
    """Shows that the program is loaded until the block ends; meanwhile Python looks for garbage less: modules stay."""
    usual = gc.get_threshold()
    gc.set_threshold(LOADED_MOST)
    try:
        with busy(console, "loading the program") as say:
            yield say
    finally:
        gc.set_threshold(*usual)


class _Lines:
    """Prints what is under way every few seconds, from a thread of its own."""

    def __init__(self, console: Console, text: str) -> None:
        self._console = console
        self._text = text
        self._start_s = wall_time_s()
        self._is_over = Event()
        self._thread = Thread(target=self._print, daemon=True)
        self._thread.start()

    def say(self, text: str) -> None:
        self._text = text

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()

    def _print(self) -> None:
        while not self._is_over.wait(LINE_PERIOD_S):
            print_line(self._console, f"{self._text}: {wall_time_s() - self._start_s:.0f} s so far")
