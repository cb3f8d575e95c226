"""How a command refuses: one sentence on standard error, exit code 2."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer
from rich.console import Console

LEARN_PACKAGES = {
    *("av", "filterpy", "gymnasium", "h5py", "minari", "onnx", "onnxruntime", "pygame", "tensorboard", "torch"),
}
_ERRORS = Console(stderr=True, soft_wrap=True, highlight=False)


def refuse(sentence: str) -> NoReturn:
    """Ends the command.

    Raises:
        typer.Exit: always.
    """
    _ERRORS.print(f"honeyguide: {sentence}", markup=False)
    raise typer.Exit(2)


@contextmanager
def learn_extra() -> Iterator[None]:
    """Refuses, instead of showing a traceback, if a package of the extra `learn` is missing in what it encloses."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name not in LEARN_PACKAGES:
            raise
        refuse(f"this needs {error.name}, which comes with the extra 'learn' (docs/start/installing.md)")
