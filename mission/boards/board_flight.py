"""A flight whose flight controller is another program: our world, body, sensors and camera, its estimator and control.

Each frame is 20 ms of simulated time, as of every flight; the autopilot takes its steps within them, and while it is
silent simulated time stands still. Its MAVLink and everybody else's are joined by a hub: the flight's own script, the
owner's phone, and the ground stations, unless it has ports of its own for those.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import hypot
from pathlib import Path
from typing import cast

from autopilot.interface.outputs import OutputKind
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.hub import Hub
from autopilot.mavlink.transport.links import Link, LinkError, LinkRole, LinkSource, memory_pair
from autopilot.mavlink.wire.codec import Frame, known_type
from common.airframe import load_airframe
from common.kernels import FRAME_US
from common.logs.tlog import TlogWriter
from mission.boards.outside_controller import OutsideController
from mission.boards.peers import OutsideBoard, Peer
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig
from mission.log.flight_recorder import History, Recorder
from mission.script import Drone
from mission.simulator.failure_injection import RigInjector
from mission.simulator.flight_rig import flight_rig, flight_world
from mission.simulator.rig_choice import engine_named
from sim.boards.outside import LosableBoard, OnWait
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.stepped import SteppedRig
from sim.world.world import WorldMap

_SETPOINT_ID = known_type("SET_POSITION_TARGET_LOCAL_NED").msg_id
_MOVES_M_S = 0.1  # guess: a companion that waits asks for no speed
_FOLLOWS_US = 1_000_000  # and one that has asked for none for so long does not follow


class BoardFlight(FlightBase):
    """A vehicle that an outside autopilot flies.

    Args:
        config: what it is made from; its parameters are the autopilot's.
        peer: which autopilot.
        on_wait: what is done while it is silent, besides passing messages on.
        instance: its number, from which its ports follow.
        links: of who is joined with the flight: ground stations, where the autopilot has no ports of its own for them.
        has_companion: one of them is a companion on board.
        folder: where `flight.ulg` and `flight.tlog` are written; None writes nothing.
        world: the ground; None: as the configuration says.

    Raises:
        PeerError, LinkError: a port is taken.
    """

    rig: SteppedRig

    def __init__(
        self,
        config: FlightConfig,
        peer: Peer,
        on_wait: OnWait,
        *,
        instance: int = 0,
        links: Sequence[Link | LinkSource] = (),
        has_companion: bool = False,
        folder: Path | None = None,
        world: WorldMap | None = None,
    ) -> None:
        super().__init__(config, load_airframe(config.airframe))
        self.peer, self._on_wait = peer, on_wait
        self.on_close: Callable[[], None] = lambda: None
        """Ends the autopilot's program."""
        simulated = class_of(self.airframe)
        vehicle, self.drives = simulated.vehicle, simulated.drives
        self.world = flight_world(config) if world is None else world
        self.board, self._plug, self.rig = self._make_rig(instance)
        motors = [output for output in vehicle.outputs(self.airframe) if output.kind is OutputKind.MOTOR]
        self.injector = RigInjector(self.rig, self.airframe, config.noise, len(motors))
        script_end, client_end = memory_pair(LinkRole.ONBOARD)
        links = [self._open_link(instance, has_companion=has_companion), script_end, *links]
        if config.owner is not None:
            links = [*links, self._carry_camera(config.owner)]
        self._tlog = None if folder is None else TlogWriter(folder / "flight.tlog", self.troubles.note)
        self._hub = Hub(links, self._heard)
        self._script_end = script_end
        self._is_companion_elsewhere = peer.has_station_ports and not has_companion
        self._setpoint_us = -_FOLLOWS_US
        drone = peer.drone(client_end, system_id=instance + 1)
        drone.frame_origin = config.home  # the autopilot's own local frame begins where it boots
        self.drone: Drone = drone
        self.controller = OutsideController(
            self.rig, vehicle, self.airframe, self.drone, peer.dialect, config.home, self.texts
        )
        log = None if folder is None else folder / "flight.ulg"
        self.recorder = Recorder(log, self.rig, self.controller, self.airframe, self.troubles.note)

    def _make_rig(self, instance: int) -> tuple[OutsideBoard, LosableBoard, SteppedRig]:
        made: list[tuple[OutsideBoard, LosableBoard]] = []

        def make_board(rig: Rig) -> LosableBoard:
            board = self.peer.make_board(rig, self.airframe, self.config, instance, self._wait)
            made.append((board, LosableBoard(board)))
            return made[0][1]

        make_rig: Callable[..., SteppedRig] = partial(
            SteppedRig, engine=engine_named(self.config.engine, self.airframe), board=make_board
        )
        rig = flight_rig(self.config, self.airframe, self.world, make_rig)
        return *made[0], cast(SteppedRig, rig)

    def _open_link(self, instance: int, *, has_companion: bool) -> Link:
        try:
            return self.peer.open_companion_link(instance) if has_companion else self.peer.open_link(instance)
        except LinkError:
            self.board.close()
            raise

    def _wait(self, silent_s: float) -> None:
        """The autopilot is silent; what it says otherwise, and what is said to it, goes on."""
        self._hub.frame(self.time_us)
        self.drone.frame(self.time_us)
        self._on_wait(silent_s)

    def _heard(self, time_us: int, frame: Frame, link: Link) -> None:
        if frame.kind.msg_id == _SETPOINT_ID and link is not self._script_end:
            setpoint = frame.kind.unpack(frame.payload)
            if hypot(setpoint.vx, setpoint.vy) > _MOVES_M_S:
                self._setpoint_us = time_us
        if self._tlog is not None:
            self._tlog.frame(time_us, frame.raw)

    def begin_frame(self) -> None:
        self.injector.frame(self.time_us)
        self._plug.unless_lost(lambda: self._on_wait(0.0))

    def advancing(self, ticks: range) -> Iterator[None]:
        return self.rig.advancing(len(ticks))

    def end_frame(self) -> None:
        self.time_us += FRAME_US
        if self._plug.loss and not self.end_reason:
            self._end(self._plug.loss)
        if self.board.restart_count != self.restart_count:
            self._stand_up_again()
        if self.owner is not None:
            is_offboard = self.controller.modes[self.controller.state.mode].is_offboard
            has_setpoints = self.time_us - self._setpoint_us < _FOLLOWS_US or self._is_companion_elsewhere
            self.owner.frame(self.time_us, is_followed=is_offboard and has_setpoints)
        self._hub.frame(self.time_us)
        self.drone.frame(self.time_us)
        self.controller.frame(self.time_us)
        if self.onboard is not None:
            self.onboard.frame(self.time_us)
        for computer in self.computers:
            computer.frame(self.time_us)
        self.recorder.frame(self.time_us)
        self.troubles.tell(self.texts)
        self._note_ready()

    def _end(self, reason: str) -> None:
        """The autopilot is lost: its script ends, and what it has flown falls, or rolls on."""
        self.end_reason = self.drone.lost = reason
        self.texts.statustext(Severity.EMERGENCY, reason)
        self.on_close()
        self.board.close()

    def _stand_up_again(self) -> None:
        """The autopilot has restarted: so does what it flies."""
        self.restart_count = self.board.restart_count
        self.injector.repair()
        self.rig.boot()
        self.troubles.note(f"{self.peer.name} has restarted; the vehicle is back on its pad")

    def restart(self) -> None:
        """Is up to who has started the autopilot: under one that goes on, the vehicle is not put elsewhere."""
        self.troubles.note(f"restart {self.peer.name} itself: its vehicle then stands on its pad again")

    def close(self) -> History:
        self.on_close()
        self.board.close()
        self._hub.close()
        if self._tlog is not None:
            self._tlog.close()
        return self.recorder.close()
