"""A rig whose board is an outside autopilot's, and a thread in which a stand-in of that autopilot runs."""

from collections.abc import Callable
from contextlib import contextmanager
from threading import Thread

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from mission.flight_config import AIRFIELD
from sim.boards.ardupilot import ArduPilotBoard
from sim.boards.betaflight import BetaflightBoard
from sim.boards.channels import control_channels, pulse_channels
from sim.boards.outside import wait_for
from sim.boards.px4 import Px4Board
from sim.bodies.vehicles import class_of
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import build_world

PATIENCE_S = 5.0


@contextmanager
def rig_of(board_type, name="x500", noise=1.0, patience_s=PATIENCE_S, peer=None):
    """A rig, and its board at a free port, for a Betaflight the peer that is there; closed in the end."""
    airframe = load_airframe(name)
    simulated = class_of(airframe)
    made = []

    def make_board(rig):
        on_wait = wait_for(patience_s, "the autopilot")
        if board_type is ArduPilotBoard:
            channels = pulse_channels(simulated.vehicle, airframe)
            made.append(ArduPilotBoard(rig, channels=channels, home=DEFAULT_HOME, on_wait=on_wait, port=0))
        elif board_type is BetaflightBoard:
            made.append(
                BetaflightBoard(rig, airframe, on_wait=on_wait, ports=peer.ports, msp_port=peer.msp_port),
            )
            peer.motors_port = made[0].local_port
        else:
            channels = control_channels(simulated.vehicle, airframe)
            made.append(Px4Board(rig, channels=channels, home=DEFAULT_HOME, on_wait=on_wait, port=0))
        return made[0]

    rig = SteppedRig(
        airframe,
        build_world(AIRFIELD if simulated.vehicle.name == "plane" else None),
        sensor_model(noise_scale=noise, home=DEFAULT_HOME),
        wind_model(0.0, 270.0, 1.0, 0.0),
        home=DEFAULT_HOME,
        body=simulated.body,
        law=simulated.vehicle.law,
        board=make_board,
    )
    try:
        yield rig, made[0]
    finally:
        made[0].close()


@contextmanager
def running(work: Callable[[], None]):
    """Does something in a thread meanwhile, which must end by itself."""
    thread = Thread(target=work, daemon=True)
    thread.start()
    yield
    thread.join(timeout=20.0)
    assert not thread.is_alive()
