"""A flight whose body a Betaflight stabilises: ours in everything else, our flight controller holding its sticks."""

from collections.abc import Callable
from functools import partial
from typing import Any, cast

from autopilot.interface.vehicle_state import Severity
from common.airframe import load_airframe
from common.airframes.multirotor import MultirotorAirframe
from mission.flight import Flight
from mission.flight_config import FlightConfig
from mission.log.flight_recorder import History
from sim.boards.betaflight import BetaflightBoard
from sim.boards.outside import LosableBoard, OnWait
from sim.rig import Rig
from sim.stepped import SteppedRig


class BetaflightFlight(Flight):
    """See `Flight`.

    Args:
        config: what it is made from.
        on_wait: what is done while Betaflight is silent.
        parts: further arguments of `Flight`.

    Raises:
        PeerError: a port is taken.
        ValueError: Betaflight does not fly such a vehicle.
    """

    def __init__(self, config: FlightConfig, on_wait: OnWait, **parts: Any) -> None:
        airframe = cast(MultirotorAirframe, load_airframe(config.airframe))
        made: list[tuple[BetaflightBoard, LosableBoard]] = []

        def make_board(rig: Rig) -> LosableBoard:
            board = BetaflightBoard(rig, airframe, on_wait=on_wait)
            made.append((board, LosableBoard(board)))
            return made[0][1]

        self.on_close: Callable[[], None] = lambda: None
        """Ends Betaflight's program."""
        super().__init__(config, make_rig=partial(SteppedRig, board=make_board), **parts)
        (self.board, self._plug), self._on_wait = made[0], on_wait
        self._board_restart_count = 0

    def begin_frame(self) -> None:
        super().begin_frame()
        self._plug.unless_lost(lambda: self._on_wait(0.0))

    def end_frame(self) -> None:
        super().end_frame()
        if self._plug.loss and not self.end_reason:
            self.end_reason = self.drone.lost = self._plug.loss
            self.texts.statustext(Severity.EMERGENCY, self.end_reason)
            self.controller.commander.disarm(force=True)
            self.on_close()
            self.board.close()
        if self.board.restart_count != self._board_restart_count:
            self._board_restart_count = self.board.restart_count
            self.restart()
            self.troubles.note("Betaflight has restarted; the vehicle is back on its pad")

    def close(self) -> History:
        self.on_close()
        self.board.close()
        return super().close()
