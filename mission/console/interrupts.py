"""Signals that end a command as Ctrl-C does: what it has begun is completed or taken away, and no half of it stays."""

import signal
import sys
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer
from typing import TYPE_CHECKING, NoReturn

from common.files import write_to_nowhere

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

_AGAIN_S = 0.01  # after Python has swallowed an interrupt


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Inside, SIGTERM is what Ctrl-C is, and so is SIGHUP: a terminal that was closed takes no more lines.

    An interrupt in the midst of a finalizer or of a weak reference's end is lost in Python; it comes again.
    """
    hook = sys.unraisablehook

    def interrupt(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    def hang_up(*_: object) -> NoReturn:
        write_to_nowhere(1, 2)
        raise KeyboardInterrupt

    def swallowed(lost: "UnraisableHookArgs") -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            Timer(_AGAIN_S, interrupt_main, [signal.SIGTERM]).start()  # SIGINT may be ignored
        else:
            hook(lost)

    before = {
        number: signal.signal(number, handler)
        for number, handler in ((signal.SIGTERM, interrupt), (signal.SIGHUP, hang_up))
    }
    sys.unraisablehook = swallowed
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)
