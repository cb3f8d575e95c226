"""How fast is a flight by an outside autopilot that answers at once, and is anything lost in ten simulated minutes?

Vehicle and stand-in take turns, so both are kept on one core: in a virtual machine, to wake another one can take longer
than all the rest.
"""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from typing import Any

from bench.row import Row, require
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import FRAME_TICKS, FRAME_US
from sim.boards.ardupilot import ArduPilotBoard
from sim.boards.betaflight import BetaflightBoard
from sim.boards.channels import control_channels, pulse_channels
from sim.boards.outside import PeerError, wait_for
from sim.boards.px4 import Px4Board
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import build_world

COMMAND = "python -m bench links"
SIMULATED_S, WARM_UP_S = 600.0, 1.0
PATIENCE_S = 10.0  # of wall clock time; the stand-in takes a second to start
LAG_PPM = 1.0
COPTER_TARGET, ROVER_TARGET, PX4_TARGET, BETAFLIGHT_TARGET = 8.0, 20.0, 5.0, 1.0
Board = ArduPilotBoard | Px4Board | BetaflightBoard


def measure() -> list[Row]:
    rows = []
    for name, airframe, make, target in (
        ("ArduPilot JSON, copter at 1 ms", "x500", _ardupilot, COPTER_TARGET),
        ("ArduPilot JSON, rover at 4 ms", "rover", _ardupilot, ROVER_TARGET),
        ("PX4 HIL, copter at 4 ms", "x500", _px4, PX4_TARGET),
        ("Betaflight, copter at 1 ms, under our flight controller", "x500", _betaflight, BETAFLIGHT_TARGET),
    ):
        _pace(airframe, make, WARM_UP_S, is_checked=False)  # compiles: nobody answers meanwhile
        with _on_one_core():
            speed = _pace(airframe, make, SIMULATED_S)
        rows.append(Row(f"{name}: ten minutes with a peer that answers at once", speed, "x", "higher", target, COMMAND))
    return rows


@contextmanager
def _on_one_core() -> Iterator[None]:
    """This process, and those that it starts."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def _ardupilot(rig: Rig, airframe: Any) -> ArduPilotBoard:
    channels = pulse_channels(class_of(airframe).vehicle, airframe)
    wait = wait_for(PATIENCE_S, "the stand-in")
    return ArduPilotBoard(rig, channels=channels, home=DEFAULT_HOME, on_wait=wait, port=0)


def _px4(rig: Rig, airframe: Any) -> Px4Board:
    channels = control_channels(class_of(airframe).vehicle, airframe)
    wait = wait_for(PATIENCE_S, "the stand-in")
    return Px4Board(rig, channels=channels, home=DEFAULT_HOME, on_wait=wait, port=0)


def _betaflight(rig: Rig, airframe: Any) -> BetaflightBoard:
    ports = (0, _free_port(socket.SOCK_DGRAM), _free_port(socket.SOCK_DGRAM))
    wait = wait_for(PATIENCE_S, "the stand-in")
    return BetaflightBoard(rig, airframe, on_wait=wait, ports=ports, msp_port=_free_port(socket.SOCK_STREAM))


def _free_port(kind: int) -> int:
    with closing(socket.socket(socket.AF_INET, kind)) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def _pace(name: str, make: Callable[[Rig, Any], Board], simulated_s: float, *, is_checked: bool = True) -> float:
    """Simulated over wall clock seconds, with the stand-in in a process of its own."""
    airframe = load_airframe(name)
    simulated = class_of(airframe)
    made: list[Board] = []

    def make_board(rig: Rig) -> Board:
        made.append(make(rig, airframe))
        return made[0]

    rig = SteppedRig(
        airframe,
        build_world(),
        sensor_model(home=DEFAULT_HOME),
        wind_model(0.0),
        home=DEFAULT_HOME,
        body=simulated.body,
        law=simulated.vehicle.law,
        board=make_board,
    )
    board = made[0]
    command = [sys.executable, "-m", *_peer(board), str(simulated_s)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as peer:
        try:
            speed = _fly(rig, simulated_s)
            with suppress(PeerError):
                rig.advance(100_000)  # until it has left
            report = peer.communicate(timeout=PATIENCE_S)[0]
        finally:
            peer.kill()
            board.close()
    if is_checked:
        _check(report, board)
    return speed


def _peer(board: Board) -> list[str]:
    """The stand-in, and where it finds us."""
    if isinstance(board, BetaflightBoard):
        return ["bench.standins.betaflight", *map(str, board.ports)]
    kind = "ardupilot" if isinstance(board, ArduPilotBoard) else "px4"
    return [f"bench.standins.{kind}", str(board.local_port)]


def _fly(rig: SteppedRig, simulated_s: float) -> float:
    rig.advance(FRAME_TICKS)
    frames = int(simulated_s * 1e6) // FRAME_US - 2
    begun_s = time.perf_counter()
    for _ in range(frames):
        rig.advance(FRAME_TICKS)
    return frames * FRAME_US * 1e-6 / (time.perf_counter() - begun_s)


def _check(report: str, board: Board) -> None:
    """Nothing was lost, and the clocks agree."""
    told = dict(part.split("=") for part in report.split())
    require(told["faults"] == "0", f"the stand-in finds fault: {report}")
    require(board.rubbish_count == 0, "rubbish came")
    exchanged_us = int(told["exchanged_us"])
    lag_ppm = abs(exchanged_us - int(told["clock_us"])) / exchanged_us * 1e6
    require(lag_ppm < LAG_PPM, f"its clock is off by {lag_ppm:.2f} ppm")
    if isinstance(board, ArduPilotBoard):
        require(board.lost_count == 0 and board.again_count == 0, "packets were lost")
    elif isinstance(board, BetaflightBoard):
        require(board.extra_count <= board.again_count and board.foreign_count == 0, "motors came unasked")
    else:
        require(board.unanswered_count <= 1, f"{board.unanswered_count} ticks were not answered in time")
