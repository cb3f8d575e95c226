"""SIGTERM and SIGHUP end what they interrupt as Ctrl-C does, also where Python swallows what is raised."""

import signal
import time

import pytest

from mission.console.interrupts import signals_interrupt


class Raised:
    """Is interrupted while it ends."""

    def __del__(self):
        signal.raise_signal(signal.SIGTERM)


def test_sigterm_interrupts_inside_alone():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), signals_interrupt():
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is before


def test_an_interrupt_that_a_finalizer_swallows_comes_again():
    is_past = False
    with pytest.raises(KeyboardInterrupt), signals_interrupt():
        Raised()
        is_past = True
        time.sleep(10.0)
        pytest.fail("nothing has come")
    assert is_past
