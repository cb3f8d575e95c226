"""The vehicle's MAVLink server: reads every link, answers, and sends telemetry, once per frame (50 Hz).

In: bytes from the links, events from the vehicle (`Announcer`). Out: bytes to the links. Time is the simulated time
that `frame` is given. Nothing that arrives on a link can stop it: what is no frame is skipped, what is not known is
refused or ignored.
"""

from collections.abc import Callable, Mapping, Sequence

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_interface import Vehicle
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import AUTOPILOT_COMPONENT, Channel, Endpoint, Sender
from autopilot.mavlink.commands import CommandService
from autopilot.mavlink.components.camera.camera_component import AttachedCamera, CameraComponent
from autopilot.mavlink.components.component import Component
from autopilot.mavlink.components.gimbal_manager import GimbalDevice, GimbalManager
from autopilot.mavlink.components.winch_component import WinchComponent
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.service import CommandHandler, Handler, Service
from autopilot.mavlink.services.actions.aux_functions import AuxFunctions
from autopilot.mavlink.services.actions.calibration_commands import CalibrationService
from autopilot.mavlink.services.actions.compass_calibration import CompassService
from autopilot.mavlink.services.actions.device_commands import DeviceService
from autopilot.mavlink.services.actions.drive_commands import DriveCommands
from autopilot.mavlink.services.actions.fence_switch import FenceService
from autopilot.mavlink.services.actions.flight_commands import FlightCommands
from autopilot.mavlink.services.actions.goto_commands import GotoService
from autopilot.mavlink.services.actions.mission_commands import MissionCommands
from autopilot.mavlink.services.actions.motor_test_commands import MotorTestService
from autopilot.mavlink.services.actions.safety_commands import SafetyService
from autopilot.mavlink.services.available_modes import ModeService
from autopilot.mavlink.services.events import EventService
from autopilot.mavlink.services.files.component_metadata import MetadataService
from autopilot.mavlink.services.files.ftp import FtpService
from autopilot.mavlink.services.files.ftp_virtual import virtual_folders
from autopilot.mavlink.services.files.log_streaming import LogStreamingService
from autopilot.mavlink.services.files.log_transfer import LogTransferService
from autopilot.mavlink.services.files.shell import ShellService
from autopilot.mavlink.services.inputs.external_position_messages import ExternalService
from autopilot.mavlink.services.inputs.local_origin import OriginService
from autopilot.mavlink.services.inputs.manual_control import ManualService
from autopilot.mavlink.services.inputs.obstacle_distances import ObstacleService
from autopilot.mavlink.services.inputs.offboard_setpoints import OffboardService
from autopilot.mavlink.services.inputs.target_reports import TargetService
from autopilot.mavlink.services.inputs.traffic_reports import TrafficService
from autopilot.mavlink.services.link_upkeep import LinkService
from autopilot.mavlink.services.message_requests import MessageRequests
from autopilot.mavlink.services.mission_protocol import MissionService
from autopilot.mavlink.services.parameter_protocol import ParameterService
from autopilot.mavlink.services.signing_setup import SigningService
from autopilot.mavlink.telemetry.status import mission_progress
from autopilot.mavlink.telemetry.stream_rate_params import StreamRateService
from autopilot.mavlink.telemetry.telemetry_rates import Stream
from autopilot.mavlink.transport.frame_log import OnFrame
from autopilot.mavlink.transport.links import Link, LinkSource
from autopilot.mavlink.transport.receive_queue import fraction
from autopilot.mavlink.transport.routing import Router
from autopilot.mavlink.wire.codec import Frame, known_type
from autopilot.mavlink.wire.signing import Judgement, Signer, SigningConfig

HEARTBEAT_US = 1_000_000
AFTER_AUTOPILOT_US = 40_000
_HEARTBEAT = known_type("HEARTBEAT")
_EXTENDED_SYS_STATE = known_type("EXTENDED_SYS_STATE")
_HOME_POSITION = known_type("HOME_POSITION")
_MISSION_CURRENT = known_type("MISSION_CURRENT")
_MISSION_ITEM_REACHED = known_type("MISSION_ITEM_REACHED")
_SETUP_SIGNING_ID = known_type("SETUP_SIGNING").msg_id

_COMMAND_IDS = (known_type("COMMAND_LONG").msg_id, known_type("COMMAND_INT").msg_id)  # handed on to components

SYSID_PARAMETER = "MAV_SYS_ID"


class MavlinkServer:
    """Everything the vehicle says and answers over MAVLink."""

    def __init__(
        self,
        vehicle: Vehicle,
        links: Sequence[Link | LinkSource],
        dialect: Dialect = PX4,
        on_frame: OnFrame | None = None,
        signing: SigningConfig | None = None,
        *,
        announces_components: bool = False,
    ) -> None:
        """Connects the services.

        Args:
            vehicle: what is asked and reported; its parameter MAV_SYS_ID becomes the system id.
            links: where clients are, and where they come and go.
            dialect: which autopilot's numbers to use.
            on_frame: gets the time and the bytes of each frame received, and of each frame sent on the first link
                or in answer to somebody, counted as one stream.
            signing: where the key is kept, and whether unsigned frames are refused; None: in memory, and they are not.
            announces_components: camera, gimbal and winch send heartbeats in a dialect, too, in which they do not.
        """
        sysid = int(vehicle.params[SYSID_PARAMETER])
        if dialect.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
            vehicle.follow_ardupilot()
        self._endpoint = Endpoint(vehicle, links, dialect, sysid, on_frame, signing)
        self._router = Router(self._endpoint)
        self._turn = 0
        self._is_heartbeat_due = False
        self._landed_state = vehicle.state.landed_state  # as told
        self._next_component_heartbeat_us = -1  # not planned yet
        self._commands = CommandService(self._endpoint)
        self._requests = MessageRequests(self._endpoint)
        self._messages: dict[str, Handler] = {}
        self._handlers: dict[int, Handler] = {}  # the same, by id
        self._frames: list[Callable[[], None]] = []  # of the services that have something to do each frame
        for service in self._services():
            self._add(service)
        self._components = self._make_components()
        self._has_component_heartbeats = bool(self._components) and (
            dialect.announces_components or announces_components
        )
        endpoint = self._endpoint
        for component in self._components:
            endpoint.compids.add(component.compid)
            self._frames.append(component.frame)
        self._commands.components = self._components

    def _services(self) -> list[Service]:
        endpoint = self._endpoint
        parameters, goto = ParameterService(endpoint), GotoService(endpoint)
        self._metadata, missions = MetadataService(endpoint), MissionService(endpoint, goto)
        self._events = EventService(endpoint)
        self._compass = CompassService(endpoint)
        return [
            LinkService(endpoint),
            self._commands,
            self._requests,
            FlightCommands(endpoint, self._events),
            parameters,
            MissionCommands(endpoint),
            DriveCommands(endpoint),
            ModeService(endpoint),
            self._events,
            goto,
            missions,
            OffboardService(endpoint),
            FenceService(endpoint),
            SafetyService(endpoint),
            MotorTestService(endpoint),
            AuxFunctions(endpoint),
            StreamRateService(endpoint),
            CalibrationService(endpoint),
            self._compass,
            self._metadata,
            FtpService(endpoint, parameters, self._metadata, virtual_folders(endpoint, missions)),
            TargetService(endpoint),
            ManualService(endpoint),
            LogTransferService(endpoint),
            LogStreamingService(endpoint),
            ShellService(endpoint),
            OriginService(endpoint),
            SigningService(endpoint),
            DeviceService(endpoint),
            TrafficService(endpoint),
            ObstacleService(endpoint),
            ExternalService(endpoint),
        ]

    def _make_components(self) -> list[Component]:
        """The vehicle's components besides the autopilot, and what the autopilot itself does for them."""
        endpoint, vehicle = self._endpoint, self._endpoint.vehicle
        components: list[Component] = []
        if vehicle.gimbal is not None:
            device = GimbalDevice(endpoint, vehicle.gimbal)
            components.append(device)
            self._add(GimbalManager(endpoint, vehicle.gimbal, device))
        if vehicle.camera is not None:
            camera = CameraComponent(endpoint, vehicle.camera)
            components.append(camera)
            self._add(AttachedCamera(camera))
            self._commands.delegated.update(AttachedCamera(camera).commands())
        if vehicle.state.read_winch is not None:
            components.append(WinchComponent(self._endpoint))
        return components

    def _add(self, service: Service) -> None:
        for name, handler in service.messages().items():
            if name in self._messages:
                raise ValueError(f"message {name} has two handlers")
            self._messages[name] = handler
            self._handlers[known_type(name).msg_id] = handler
        self._commands.add(service.commands())
        self._requests.add(service.requests())
        if type(service).frame is not Service.frame:
            self._frames.append(service.frame)

    # What the documentation is made from

    @property
    def streams(self) -> Sequence[Stream]:
        """Every message that can be streamed or asked for, with its default rates."""
        return self._endpoint.telemetry.streams

    def message_handlers(self) -> Mapping[str, Handler]:
        """Every message that is understood."""
        return self._messages

    def command_handlers(self) -> Mapping[int, CommandHandler]:
        """Every command that is understood."""
        return self._commands.handlers

    @property
    def components(self) -> Sequence[Component]:
        """The vehicle's components besides the autopilot."""
        return self._components

    @property
    def needs_ticks(self) -> bool:
        """Whether a client gets messages more often than once per frame."""
        return self._endpoint.needs_ticks

    def prepare(self) -> None:
        """Makes what takes longer than a frame may, before somebody asks for it in flight."""
        self._metadata.prepare()

    def frame(self, time_us: int) -> None:
        """Receives, answers, and sends what is due.

        Args:
            time_us: simulated time; never goes back.
        """
        endpoint = self._endpoint
        endpoint.time_us = time_us
        endpoint.clock.boot_us = endpoint.vehicle.state.boot_us
        endpoint.poll()
        busy = [channel for channel in endpoint.channels if channel.intake.fill()]
        if busy:
            self._serve(busy)
        for run in self._frames:
            run()
        if self._has_component_heartbeats and time_us >= self._next_component_heartbeat_us:
            self._send_component_heartbeats(time_us)
        if endpoint.vehicle.state.landed_state is not self._landed_state:
            self._tell_landed_state()
        if self._is_heartbeat_due:
            self._is_heartbeat_due = False
            self._broadcast_telemetry(_HEARTBEAT.msg_id)
        endpoint.send_streams()

    def _serve(self, busy: list[Channel]) -> None:
        """Handles what has come in, of each channel as much as its share allows; another is first each time."""
        endpoint = self._endpoint
        work_max = fraction(len(busy))
        self._turn += 1
        first = self._turn % len(busy)
        for channel in busy[first:] + busy[:first]:
            endpoint.asker, intake = channel, channel.intake
            while (frame := intake.next(work_max)) is not None:
                sent_before = endpoint.sent_count
                self._handle(channel, frame)
                intake.work += endpoint.sent_count - sent_before
        endpoint.asker = None

    def _handle(self, channel: Channel, frame: Frame) -> None:
        """Passes a frame on to whom else it concerns; hands it to its service, or to the component it is for."""
        endpoint = self._endpoint
        if frame.kind.msg_id != _SETUP_SIGNING_ID:  # its key belongs into no log
            endpoint.received(channel, frame)
        if endpoint.signer.is_watching and not self._is_let_in(channel, frame):
            return
        if frame.sysid == endpoint.sysid and frame.compid in endpoint.compids:
            return  # our own, come back
        target_system, target = frame.target()
        self._router.route(channel, frame, target_system, target)
        msg_id = frame.kind.msg_id
        handler = self._handlers.get(msg_id)
        listeners = [component for component in self._components if msg_id in component.handlers]
        if (handler is None and not listeners) or not endpoint.is_for_us(target_system, target):
            return
        fields, sender = frame.kind.unpack(frame.payload), Sender(channel, frame.sysid, frame.compid)
        if handler is not None and (target in (0, AUTOPILOT_COMPONENT) or msg_id in _COMMAND_IDS):
            handler(sender, fields)
        for component in listeners:
            if target in (0, component.compid):
                component.handlers[msg_id](sender, fields)

    def _is_let_in(self, channel: Channel, frame: Frame) -> bool:
        judgement = self._endpoint.signer.judge(frame, channel.link)
        if judgement is Judgement.UNSIGNED:
            self._endpoint.text_once(Severity.WARNING, "Signing: unsigned messages are refused")
        elif judgement is Judgement.FORGED:
            self._endpoint.text_once(Severity.WARNING, "Signing: messages with a wrong signature are refused")
        return judgement is Judgement.TAKEN

    def close(self) -> None:
        """Closes the links."""
        if self._endpoint.signer.has_key:
            self._endpoint.signer.save(is_last=True)
        for source in self._endpoint.sources:
            source.close()

    # Announcer

    @property
    def signer(self) -> Signer:
        """Signs what is sent, and judges what comes in."""
        return self._endpoint.signer

    def statustext(self, severity: Severity, text: str) -> None:
        self._endpoint.text(severity, text)
        self._events.reported_text(severity, text)
        self._compass.reported_text(text)

    def mission_item_reached(self, seq: int) -> None:
        payload = _MISSION_ITEM_REACHED.pack(seq + self._endpoint.dialect.first_seq)
        self._endpoint.broadcast(_MISSION_ITEM_REACHED, payload)

    def mission_current_changed(self, seq: int) -> None:
        endpoint = self._endpoint
        state = endpoint.vehicle.state
        first_seq = endpoint.dialect.first_seq if state.mission_count else 0
        payload = mission_progress(state, seq + first_seq)
        endpoint.broadcast(_MISSION_CURRENT, payload)

    def home_changed(self) -> None:
        self._broadcast_telemetry(_HOME_POSITION.msg_id)

    def _send_component_heartbeats(self, time_us: int) -> None:
        """Once a second, between two of the vehicle's.

        Some clients (pymavlink's wait_heartbeat) take the first heartbeat they ever hear for the vehicle's; others
        (MAVSDK's FollowMe) read the flight mode from whichever of the system came last.
        """
        if self._next_component_heartbeat_us < 0:
            self._next_component_heartbeat_us = time_us + AFTER_AUTOPILOT_US
            return
        self._next_component_heartbeat_us = time_us + HEARTBEAT_US
        self._broadcast_telemetry(_HEARTBEAT.msg_id)
        for component in self._components:
            component.send_heartbeat()
        self._is_heartbeat_due = True
        for channel in self._endpoint.channels:
            channel.schedule.postpone(_HEARTBEAT.msg_id, time_us + HEARTBEAT_US)

    def _tell_landed_state(self) -> None:
        """At once, and a heartbeat with it: stations take either of them for flying or not."""
        self._landed_state = self._endpoint.vehicle.state.landed_state
        self._broadcast_telemetry(_EXTENDED_SYS_STATE.msg_id)
        self._is_heartbeat_due = True

    def heartbeat_now(self) -> None:
        """Sends a heartbeat in this frame, after the mode or arming has changed."""
        self._is_heartbeat_due = True
        self._events.state_changed()

    def _broadcast_telemetry(self, msg_id: int) -> None:
        telemetry = self._endpoint.telemetry
        payload = telemetry.builders[msg_id](self._endpoint.vehicle.state)
        if payload is not None:
            self._endpoint.broadcast(telemetry.types[msg_id], payload)
