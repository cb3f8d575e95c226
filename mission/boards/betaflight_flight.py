"""A flight whose body a Betaflight stabilises: ours in everything else, our flight controller holding its sticks."""

from functools import partial
from typing import Any, cast

from common.airframe import load_airframe
from common.airframes.multirotor import MultirotorAirframe
from mission.flight import Flight
from mission.flight_config import FlightConfig
from mission.log.flight_recorder import History
from sim.boards.betaflight import BetaflightBoard
from sim.boards.outside import OnWait, PeerError
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
        made: list[BetaflightBoard] = []

        def make_board(rig: Rig) -> BetaflightBoard:
            made.append(BetaflightBoard(rig, airframe, on_wait=on_wait))
            return made[0]

        super().__init__(config, make_rig=partial(SteppedRig, board=make_board), **parts)
        self.board, self._on_wait = made[0], on_wait
        self._board_restart_count = 0

    def frame(self) -> None:
        try:
            self._on_wait(0.0)
            super().frame()
        except PeerError as error:
            self.end_reason = str(error)
            return
        if self.board.restart_count != self._board_restart_count:
            self._board_restart_count = self.board.restart_count
            self.restart()
            self.troubles.note("Betaflight has restarted; the vehicle is back on its pad")

    def close(self) -> History:
        self.board.close()
        return super().close()
