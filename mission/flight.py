"""One flight: world, vehicle, flight controller, links, client and recorder, advanced frame by frame.

Each frame is 20 ms of simulated time: five ticks of the kernels, then the Python part of the flight controller, then
the scripting client, then the recorder. With the memory link alone it is a pure function of its configuration.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Self

from autopilot.flight_controller import FlightController
from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.server import SYSID_PARAMETER, MavlinkServer
from autopilot.mavlink.transport.links import Link, LinkRole, LinkSource, memory_pair
from autopilot.mavlink.wire.signing import SigningConfig
from autopilot.payload.camera.storage import MediaFolder
from autopilot.persistence import Persistence
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import load_airframe
from common.airframes.plane import PlaneAirframe
from common.clock import wall_unix_us
from common.folder import ConfinedFolder
from common.kernels import FRAME_TICKS, FRAME_US, TICK_US
from common.logs.tlog import TlogWriter
from common.params import Parameter
from common.state_folder import StateFolder
from mission.flight_base import Computer, FlightBase
from mission.flight_config import FlightConfig, as_launched, flight_parameters
from mission.log.flight_recorder import History, Recorder
from mission.log.stored_logs import FlightLogs, RunLog
from mission.script import Drone
from mission.simulator.base_station import BaseStation
from mission.simulator.failure_injection import RigInjector
from mission.simulator.flight_cameras import FlightCameras
from mission.simulator.flight_rig import flight_rig, flight_world
from mission.simulator.host_ports import host_ports
from mission.simulator.onboard_devices import Surroundings, ring_of
from mission.simulator.scanner_device import ScannerDevice
from mission.simulator.simulator_params import PREFIX as SIMULATOR_PREFIX
from mission.simulator.simulator_params import TURBULENCE_FRACTION, SimulatorParameters
from mission.video.mjpeg_server import StreamServer
from mission.video.rtp_video import RtpVideo
from sim.bodies.vehicles import class_of
from sim.hand import Hand
from sim.rig import Rig
from sim.rtk import RtkReceiver
from sim.sensors.scanner import Scanner
from sim.turntable import Turntable
from sim.world.world import WorldMap

__all__ = ["Computer", "Flight", "FlightConfig", "flight_parameters"]

DIALECTS: dict[str, Dialect] = {dialect.name: dialect for dialect in (PX4, ARDUPILOT)}


class Flight(FlightBase):
    """A vehicle in the air, or about to be.

    Args:
        config: what it is made from.
        links: besides the memory link to `drone`, for ground stations.
        signing: where the key of MAVLink's signatures is kept, and whether they are required.
        folder: where `flight.ulg` and `flight.tlog` are written; None writes nothing.
        stream: serves the camera's live picture.
        video: sends it to ground stations.
        has_camera_thread: photos are rendered while the flight goes on, which is then no longer the same each time.
        state: what outlives the flight; None: it begins with defaults and nothing is kept.
        make_rig: takes the arguments of `Rig`, as `sim.stepped.SteppedRig`; None: as the configuration says.
        world: the ground; None: as the configuration says.
    """

    def __init__(
        self,
        config: FlightConfig,
        *,
        links: Sequence[Link | LinkSource] = (),
        folder: Path | None = None,
        state: StateFolder | None = None,
        signing: SigningConfig | None = None,
        stream: StreamServer | None = None,
        video: RtpVideo | None = None,
        has_camera_thread: bool = False,
        make_rig: Callable[..., Rig] | None = None,
        world: WorldMap | None = None,
    ) -> None:
        super().__init__(config, as_launched(config, load_airframe(config.airframe)))
        simulated = class_of(self.airframe)
        vehicle, self.drives = simulated.vehicle, simulated.drives
        self.world = flight_world(config) if world is None else world
        self.rig = flight_rig(config, self.airframe, self.world, make_rig)
        self.hand = self._hold_in_hand()
        self.params = flight_parameters(config, self.airframe)
        self.persistence = None if state is None else self._restore_parameters(state)
        self._has_new_parameters = True
        self._load_parameters()
        self.params.on_change(self._parameter_changed)
        self.injector = RigInjector(self.rig, self.airframe, config.noise, len(vehicle.motors(self.airframe)))
        self._cameras = FlightCameras(self.rig, self.world, stream, video, has_thread=has_camera_thread)
        self.host = self._make_host(folder, state, stream, video)
        receiver = RtkReceiver(self.rig)
        self.controller = self._make_controller(vehicle, receiver)
        self._surroundings = self._surround(receiver)
        if config.owner is not None:
            links = [*links, self._carry_camera(config.owner)]
        self._components = self._carry_components()
        links = [*links, *(component.vehicle_end for component in self._components)]
        self._tlog = None if folder is None else TlogWriter(folder / "flight.tlog", self.troubles.note)
        script_end, client_end = memory_pair(LinkRole.ONBOARD)
        self._servers = self._make_servers(script_end, links, signing)
        self.server = self._servers[0]
        self.drone = Drone(client_end, system_id=int(self.params[SYSID_PARAMETER]))
        log = None if folder is None else folder / "flight.ulg"
        self.recorder = Recorder(log, self.rig, self.controller, self.airframe, self.troubles.note)
        self.controller.attach(self.recorder)
        self.simulator_params = SimulatorParameters(self)
        self._start_cameras()
        self._flight_logs: FlightLogs | None = None
        if state is not None:
            self._flight_logs = FlightLogs(state.folder / "logs", self.recorder, self.params, self.troubles.note)
        self._lend_logs(log)

    def _hold_in_hand(self) -> Hand | None:
        """Puts a plane that is thrown into the hand that does."""
        throw = self.airframe.throw if isinstance(self.airframe, PlaneAirframe) else None
        if throw is None:
            return None
        hand = Hand(self.rig.rows["body"], throw)
        hand.take()
        return hand

    def _restore_parameters(self, state: StateFolder) -> Persistence:
        """What an earlier flight has set, but the simulator's and what this flight was given."""
        passing = {name for name in self.params if name.startswith(SIMULATOR_PREFIX)}
        return Persistence(state, self.params, self.config.parameters, passing)

    def _make_host(
        self, folder: Path | None, state: StateFolder | None, stream: StreamServer | None, video: RtpVideo | None
    ) -> Host:
        root = folder if state is None else state.folder
        return Host(
            files=None if root is None else ConfinedFolder(root / "files"),
            storage=state,
            frames=self._cameras.photos,
            media=None if folder is None else MediaFolder(folder / "media"),
            stream=stream,
            video=video,
            boot_unix_us=self.config.boot_unix_us,
        )

    def _make_controller(self, vehicle: VehicleClass, receiver: RtkReceiver) -> FlightController:
        body = self.rig.rows["body"]
        return FlightController(
            host_ports(self.rig),
            self.params,
            self.airframe,
            self.config.home,
            self.texts,
            on_reboot=self._reboot,
            on_corrections=lambda _: receiver.correct(self.time_us),
            host=self.host,
            injector=self.injector,
            turntable=Turntable(body) if "is_held" in body.dtype.names else None,
            vehicle=vehicle,
        )

    def _surround(self, receiver: RtkReceiver) -> Surroundings:
        config = self.config
        make_ring = ring_of(drives=self.drives)
        ring = make_ring(self.rig, self.world, config.noise, config.seed) if config.has_lidar else None
        traffic, lag_us = config.traffic_count, round(config.scan_lag_s * 1e6)
        return Surroundings(self.controller, self.rig, receiver, traffic, ring, config.home, config.seed, lag_us)

    def _make_servers(
        self, script_end: Link, links: Sequence[Link | LinkSource], signing: SigningConfig | None
    ) -> list[MavlinkServer]:
        """What serves the links, and what serves the script, which is not asked to know two languages."""
        config, controller, dialect = self.config, self.controller, DIALECTS[self.config.dialect]
        on_frame = None if self._tlog is None else self._tlog.frame
        if dialect is PX4:
            servers = [MavlinkServer(controller, [script_end, *links], on_frame=on_frame, signing=signing)]
        else:
            announces = config.announces_components
            servers = [
                MavlinkServer(controller, links, dialect, on_frame, signing, announces_components=announces),
                MavlinkServer(controller, [script_end]),
            ]
        servers[0].prepare()
        for server in servers:
            server.signer.on_trouble = self.troubles.note
            controller.attach(server)
        return servers

    def _lend_logs(self, log: Path | None) -> None:
        """Gives the flight controller the logs, and what it remembers of earlier flights."""
        self.host.log_stream = self.recorder
        if self._flight_logs is not None:
            self.host.logs = self._flight_logs
        elif log is not None:
            self.host.logs = RunLog(self.recorder)
        if self.persistence is not None:
            self.persistence.keep_lists(self.controller.lists)
            self.persistence.keep_home(self.controller.commander.home)
            self.persistence.on_trouble = self.troubles.note

    def _carry_components(self) -> Sequence[ScannerDevice | BaseStation]:
        """Brings in what has a link of its own to the vehicle."""
        config, system_id = self.config, int(self.params[SYSID_PARAMETER])
        base = [BaseStation(system_id)] if config.has_base else []
        if not config.is_forest:
            return base
        scanner = Scanner(self.rig, self.world, config.noise, config.seed)
        return [ScannerDevice(scanner, system_id, round(config.scan_lag_s * 1e6)), *base]

    def _start_cameras(self) -> None:
        cast = None if self.owner is None else self.owner.cast.rows
        self._cameras.start(self.controller.camera, cast, self.troubles.note)

    def _parameter_changed(self, _: Parameter) -> None:
        self._has_new_parameters = True

    def _load_parameters(self) -> None:
        """Gives the kernels what has changed: once per frame, however many parameters clients set in it."""
        if self._has_new_parameters:
            self._has_new_parameters = False
            self.rig.load_parameters(self.params)

    def _reboot(self) -> None:
        self._load_parameters()
        self.rig.reboot()

    def begin_frame(self) -> None:
        self._load_parameters()
        self.injector.frame(self.time_us)
        if self.hand is not None:
            state = self.controller.state
            self.hand.frame(is_awaited=state.awaits_launch, is_armed=state.is_armed)

    def end_frame(self) -> None:
        self.time_us += FRAME_US
        self._surroundings.frame(self.time_us)
        if self.owner is not None:
            is_followed = self.controller.modes[self.controller.state.mode].is_offboard
            self.owner.frame(self.time_us, is_followed=is_followed)
        for component in self._components:
            component.frame(self.time_us)
        self.controller.frame(self.time_us)
        self.drone.frame(self.time_us)
        if self.onboard is not None:
            self.onboard.frame(self.time_us, self.controller.state.boot_us)
        for computer in self.computers:
            computer.frame(self.time_us)
        self._cameras.frame()
        if self._flight_logs is not None:
            self._flight_logs.frame(is_armed=self.controller.state.is_armed)
        if self.persistence is not None:
            self.persistence.frame(self.time_us)
        self.troubles.tell(self.controller.commander.announcer)
        self._note_ready()

    def _needs_ticks(self) -> bool:
        for server in self._servers:  # noqa: SIM110  (any() would make a generator in each frame)
            if server.needs_ticks:
                return True
        return False

    def advancing(self, ticks: range) -> Iterator[None]:
        if len(ticks) < FRAME_TICKS or self._needs_ticks():
            for tick in ticks:
                self._advance_tick(tick)
        else:
            self.rig.advance(FRAME_TICKS)
        return iter(())

    def _advance_tick(self, tick: int) -> None:
        """One tick of a frame; it is shown to the flight controller's servers if a client wants it."""
        self.rig.advance(1)
        if tick + 1 < FRAME_TICKS and self._needs_ticks():
            self.controller.note_tick(self.time_us + (tick + 1) * TICK_US)

    def run(
        self,
        is_over: Callable[[Self], bool],
        *,
        speed: float | None = None,
        on_frame: Callable[[Self], None] | None = None,
    ) -> None:
        if speed is not None and self.time_us == 0:
            self.host.boot_unix_us = wall_unix_us()
        super().run(is_over, speed=speed, on_frame=on_frame)

    def change_speed(self, speed: float | None) -> None:
        super().change_speed(speed)
        self.simulator_params.tell(SIM_SPEEDUP=speed or 0.0)

    def set_wind(self, speed_m_s: float, from_deg: float) -> None:
        super().set_wind(speed_m_s, from_deg)
        self.simulator_params.tell(
            SIM_WIND_SPD=speed_m_s, SIM_WIND_DIR=from_deg, SIM_WIND_TURB=TURBULENCE_FRACTION * speed_m_s
        )

    def cut_sticks(self, *, is_cut: bool) -> None:
        """The radio link of the sticks is lost, or is back."""
        self.controller.sticks.is_cut = is_cut

    def restart(self) -> None:
        """Puts the vehicle back on its pad, whole and with a full battery, and restarts its flight controller.

        Time, logs, world, parameters and mission go on.
        """
        self.controller.commander.disarm(force=True)
        self.injector.repair()
        self.rig.boot()
        if self.hand is not None:
            self.hand.take()
        self.controller.reboot()
        self.restart_count += 1
        self.texts.statustext(Severity.NOTICE, "Simulator: the vehicle is back on its pad, restarted")

    def close(self) -> History:
        """As of every flight; a state folder stays the caller's to close."""
        self._cameras.close(self.controller.camera)
        if self.persistence is not None:
            self.persistence.write()
        if self._flight_logs is not None:
            self._flight_logs.end()
        for server in self._servers:
            server.close()
        if self._tlog is not None:
            self._tlog.close()
        return self.recorder.close()
