"""What boards have in common whose autopilot is another program: how it is waited for, and what ends the waiting."""

from collections.abc import Callable

POLL_S = 0.1  # of wall clock time, after which whoever waits looks round

OnWait = Callable[[float], None]
"""Called while the autopilot is silent, with the seconds of wall clock time since it was heard, or was begun to be
waited for; raises PeerError to end it. Meanwhile simulated time stands still."""


class PeerError(Exception):
    """There is no flying on with the autopilot; the text is one sentence for the user."""


def wait_for(patience_s: float, name: str) -> OnWait:
    """Waits so long and no longer."""

    def on_wait(silent_s: float) -> None:
        if silent_s > patience_s:
            raise PeerError(f"{name} has been silent for {patience_s:g} s")

    return on_wait
