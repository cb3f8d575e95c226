"""What a user has written wrong, as one sentence of pytest's report."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from mission.console.option_checks import UserError


@contextmanager
def refused(place: str = "") -> Iterator[None]:
    """Turns a `UserError` into a failure without a traceback.

    Args:
        place: where it was written, if the error does not say it.
    """
    try:
        yield
    except UserError as error:
        text = str(error)
        raise pytest.fail.Exception(text if place in text else f"{place}: {text}", pytrace=False) from None
