"""What every test process needs."""

import gc
import signal

import pytest

# A shell that starts the tests in the background has them ignore Ctrl-C, and so would the vehicles they start and stop.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish():
    """Lets the garbage collector leave alone what lasts: modules, kernels and tests are millions of objects."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def started_warp():
    """Tests that make arrays themselves need no greeting either; the clients' own environments have no Warp."""
    try:
        from common.warp_start import start_warp
    except ModuleNotFoundError:
        return
    start_warp()
