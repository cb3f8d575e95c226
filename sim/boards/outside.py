"""What boards have in common whose autopilot is another program: how it is waited for, and what ends the waiting."""

from collections.abc import Callable
from typing import Any

from sim.boards.board import Board

POLL_S = 0.1  # of wall clock time, after which whoever waits looks round

OnWait = Callable[[float], None]
"""Called while the autopilot is silent, with the seconds of wall clock time since it was heard, or was begun to be
waited for; raises PeerError to end it. Meanwhile simulated time stands still."""


class PeerError(Exception):
    """There is no flying on with the autopilot; the text is one sentence for the user."""


class LosableBoard:
    """The board of another program as a rig may lose it: from then on what it flies is commanded nothing.

    Args:
        board: of one vehicle.
    """

    def __init__(self, board: Board) -> None:
        self.is_fast = board.is_fast
        self.loss = ""
        """Why it was lost."""
        self._board = board

    def boot(self, is_chosen: Any) -> None:
        self._board.boot(is_chosen)

    def give(self, samples: Any, truth: Any) -> None:
        self.unless_lost(lambda: self._board.give(samples, truth))

    def take(self, commands: Any) -> None:
        self.unless_lost(lambda: self._board.take(commands))
        if self.loss:
            commands.numpy()[0][:] = 0.0

    def unless_lost(self, act: Callable[[], None]) -> None:
        """Does something that raises PeerError if the board is lost by it."""
        if self.loss:
            return
        try:
            act()
        except PeerError as error:
            self.loss = str(error)


def wait_for(patience_s: float, name: str) -> OnWait:
    """Waits so long and no longer."""

    def on_wait(silent_s: float) -> None:
        if silent_s > patience_s:
            raise PeerError(f"{name} has been silent for {patience_s:g} s")

    return on_wait
