"""The Python part of one vehicle's flight controller: commander, navigator and MAVLink server, one `frame` at 50 Hz.

In: estimate, samples, actuators and estimator health, read from the kernel rows; requests of MAVLink clients.
Out: the setpoint row; telemetry through the attached servers. Time is the simulated time it is given.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from autopilot.commander.battery import BatteryEstimator
from autopilot.commander.commander import Commander
from autopilot.commander.sensor_calibration import Calibrator, Turntable
from autopilot.commander.stick_commands import Pilot
from autopilot.inputs.external_position import ExternalPositions
from autopilot.inputs.obstacle_stop import ObstacleStop
from autopilot.inputs.obstacles import Obstacles
from autopilot.inputs.sticks import Sticks
from autopilot.inputs.traffic import Traffic
from autopilot.interface.client_requests import (
    ChangeMode,
    ChangeSpeed,
    ModeRequest,
    Report,
    Request,
    SetCurrentItem,
    SetHome,
    SetReverse,
    StartMission,
)
from autopilot.interface.failure_requests import Failure, FailureInjector, Unit, failure_request, injection_refusal
from autopilot.interface.item_lists import ItemLists, ListKind
from autopilot.interface.platform import Host
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity, VehicleState, Verdict
from autopilot.motor_test import MotorTest
from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.navigator import Navigator
from autopilot.navigator.setpoint import SetpointPort
from autopilot.payload.aux_outputs import AuxOutputs
from autopilot.payload.camera.camera import Camera
from autopilot.payload.camera.camera_commands import CameraCommands
from autopilot.payload.gimbal.gimbal import Gimbal
from autopilot.payload.gimbal.gimbal_control import GimbalControl
from autopilot.payload.payloads import Payloads
from autopilot.roi_and_pause import Guidance
from autopilot.vehicles.default_class import DEFAULT_CLASS
from autopilot.vehicles.vehicle_class import DriveParts, VehicleClass
from common.airframe import Airframe
from common.attitude import roll_pitch_yaw_of
from common.geodesy import GeoPoint
from common.params import ParameterTable

_HEALTH_PERIOD_US = 200_000


@dataclass(frozen=True, slots=True)
class HostPorts:
    """The kernel rows of one vehicle, as common.records.row_reader reads them."""

    read_estimate: Callable[[], Any]  # Estimate
    read_samples: Callable[[], Any]  # Samples
    read_actuators: Callable[[], Any]  # Actuators
    read_health: Callable[[], Any]  # EstimatorState
    setpoint: np.ndarray[Any, Any]  # live structured view, shape (1,), of the Setpoint row
    read_motor_speeds: Callable[[], Sequence[float]] | None = None  # [rad/s] as the motors' controllers report them
    airframe: np.ndarray[Any, Any] | None = None  # live structured view, shape (1,), of the law's Airframe row
    external: np.ndarray[Any, Any] | None = None  # live structured view, shape (1,), of the ExternalSample row


class Server(Announcer, Protocol):
    """A MAVLink server: hears of events, and has its own part of the frame."""

    def frame(self, time_us: int) -> None: ...


class _Relay:
    """Passes events on to every attached server."""

    def __init__(self, first: Announcer | None) -> None:
        self.targets: list[Announcer] = [] if first is None else [first]

    def statustext(self, severity: Severity, text: str) -> None:
        for target in self.targets:
            target.statustext(severity, text)

    def mission_item_reached(self, seq: int) -> None:
        for target in self.targets:
            target.mission_item_reached(seq)

    def mission_current_changed(self, seq: int) -> None:
        for target in self.targets:
            target.mission_current_changed(seq)

    def home_changed(self) -> None:
        for target in self.targets:
            target.home_changed()

    def heartbeat_now(self) -> None:
        for target in self.targets:
            target.heartbeat_now()


class FlightController:
    """One vehicle as MAVLink handlers and scripts see it (autopilot.interface.vehicle_interface.Vehicle).

    Args:
        ports: its kernel rows.
        params: its parameters.
        airframe: its data.
        origin: the geodetic origin of the ned frame.
        announcer: hears of events besides the attached servers (a log, a test).
        on_corrections: the GNSS receiver's input for RTCM corrections.
        on_reboot: restarts the vehicle; None where there is nothing to restart.
        host: files, logs and storage, as far as there are any.
        injector: breaks parts on request; None where nothing can be broken.
        turntable: turns the vehicle while its sensors are calibrated; None: a pilot does.
        vehicle: the class of vehicles that it is of.
    """

    def __init__(
        self,
        ports: HostPorts,
        params: ParameterTable,
        airframe: Airframe,
        origin: GeoPoint,
        announcer: Announcer | None = None,
        on_reboot: Callable[[], None] | None = None,
        on_corrections: Callable[[bytes], None] | None = None,
        host: Host | None = None,
        injector: FailureInjector | None = None,
        turntable: Turntable | None = None,
        vehicle: VehicleClass = DEFAULT_CLASS,
    ) -> None:
        self.params = params
        self.modes = vehicle.modes
        self.ardupilot = vehicle.ardupilot
        self.leaves_ground = vehicle.ground is not None
        self.host = host or Host()
        self._last_resort = vehicle.last_resort
        self._ports = ports
        self._on_reboot = on_reboot
        self._on_corrections = on_corrections
        self._injector = injector
        self._relay = _Relay(announcer)
        self._servers: list[Server] = []
        self._next_health_us = 0
        self.sticks = Sticks(params)
        self.state = state = VehicleState(
            origin=origin,
            sticks=self.sticks.input,
            outputs=tuple(vehicle.outputs(airframe)),
            motor_count=len(vehicle.motors(airframe)),
            mav_type=vehicle.mav_type(airframe),
        )
        state.read_motor_speeds = ports.read_motor_speeds
        self.obstacles = state.obstacles = Obstacles(params, vehicle.limits.accel_hor)
        self.traffic = Traffic(state, params)
        self.external = ExternalPositions(
            ports.external, params, lambda: state.time_us, lambda: (state.estimate, state.yaw_rad)
        )
        self.payload = Payloads()
        self.gimbal: GimbalControl | None = None
        self.camera = self._mount_camera()
        self._outputs = AuxOutputs(state)
        self.payload.add(self._outputs)
        self._setpoint = SetpointPort(ports.setpoint)
        self.commander = self._make_commander(vehicle, airframe)
        self.station = self.commander.station
        self.navigator = self._make_navigator(vehicle, airframe)
        self.commander.connect(self.navigator)
        self.fence, self.rally = self.navigator.fence, self.navigator.rally
        self.lists = self._item_lists()
        lane = None if vehicle.lane is None else vehicle.lane(airframe)
        stop = None if lane is None else ObstacleStop(state, self.obstacles, self._setpoint, self._relay, lane)
        self._obstacle_stop = stop
        self.guidance = Guidance(self.commander, self.navigator, self.payload)
        self.motor_test = MotorTest(state, self._setpoint, self._relay, vehicle.motors(airframe))
        self.calibration = Calibrator(state, params, self._relay, turntable)
        self._setpoint.write()

    def _make_commander(self, vehicle: VehicleClass, airframe: Airframe) -> Commander:
        state, params, ports = self.state, self.params, self._ports
        parts = DriveParts(state, params, self._relay, airframe, ports.read_motor_speeds, ports.airframe)
        return Commander(
            state,
            params,
            self._relay,
            BatteryEstimator(airframe.battery),
            None if vehicle.ground is None else vehicle.ground.detector(params, airframe),
            Pilot(state, params, self.sticks, vehicle.modes),
            None if vehicle.drive_watch is None else vehicle.drive_watch(parts),
            vehicle.modes,
            vehicle.last_resort,
            vehicle.arming_checks,
        )

    def _make_navigator(self, vehicle: VehicleClass, airframe: Airframe) -> Navigator:
        context = NavContext(self.state, self.params, self._relay, self._setpoint, vehicle.craft(airframe))
        mission = Mission(context, self.payload, self.commander.set_home)
        return Navigator(context, mission, vehicle.modes)

    def _item_lists(self) -> ItemLists:
        """What clients upload; with each change the mission is held against the fence."""
        mission = self.navigator.mission
        lists = ItemLists({ListKind.MISSION: mission, ListKind.FENCE: self.fence, ListKind.RALLY: self.rally})
        lists.on_change(mission.warn_of_fence)
        return lists

    def _mount_camera(self) -> Camera | None:
        """Hangs the camera on its gimbal, if the host has one."""
        frames = self.host.frames
        if frames is None:
            return None
        gimbal = Gimbal(self.state)
        self.gimbal = GimbalControl(gimbal, self.state)
        camera = Camera(self.state, gimbal, frames, self.host.media)
        self.payload.add(self.gimbal)
        self.payload.add(CameraCommands(camera))
        return camera

    def follow_ardupilot(self) -> None:
        """From now on pilots and modes are treated as ArduPilot treats them."""
        self.sticks.follow_ardupilot(rests_in_middle=not self.leaves_ground)
        self.commander.follow_ardupilot()

    def attach(self, server: Server) -> None:
        """Adds a MAVLink server: it hears of events, and its frame is run at the end of each frame."""
        self._relay.targets.append(server)
        self._servers.append(server)

    def frame(self, time_us: int) -> None:
        """Runs one frame of the Python part at `time_us`: reads, decides, writes the setpoint, serves links."""
        dt_s = (time_us - self.state.time_us) * 1e-6
        self._read(time_us)
        self.sticks.frame(time_us)
        self.fence.frame()
        self.commander.frame(dt_s)
        if self.state.is_calibrating:
            self.calibration.frame()
        if self.motor_test.is_running:
            self.motor_test.frame()
        wish = self.navigator.frame()
        if wish is not None:
            self._follow_wish(wish)
        if self._obstacle_stop is not None:
            self._obstacle_stop.frame()
        self._setpoint.write()
        if self.camera is not None and time_us >= self.camera.due_us:
            self.camera.frame()
        if time_us >= self._outputs.due_us:
            self._outputs.frame()
        for server in self._servers:
            server.frame(time_us)
        if self.external.waiting:
            self.external.write()
        self.state.ticks.clear()

    def note_tick(self, time_us: int) -> None:
        """Keeps what the kernels have made of a tick between two frames, to be told in the next."""
        tick = copy(self.state)
        self._read_motion(tick, time_us)
        self.state.ticks.append(tick)

    def _read(self, time_us: int) -> None:
        """Renews the vehicle state from the kernel rows."""
        self._read_motion(self.state, time_us)
        if time_us >= self._next_health_us:
            self._next_health_us = time_us + _HEALTH_PERIOD_US
            self.state.health = self._ports.read_health()

    def _read_motion(self, state: VehicleState, time_us: int) -> None:
        state.time_us = time_us
        estimate = state.estimate = self._ports.read_estimate()
        state.samples = self._ports.read_samples()
        state.actuators = self._ports.read_actuators()
        state.roll_rad, state.pitch_rad, state.yaw_rad = roll_pitch_yaw_of(estimate.q_ned_from_frd)

    def _follow_wish(self, mode: Mode) -> None:
        """A mode is done: goes over to the next, or to the last resort if that cannot be flown."""
        if self.commander.refusal(mode):
            mode = self._last_resort
        self.commander.change_mode(mode)

    # ---- autopilot.interface.vehicle_interface.Vehicle ----

    def arm(self, *, force: bool) -> Reply:
        return self.commander.arm(force=force)

    def disarm(self, *, force: bool) -> Reply:
        self.motor_test.stop()
        return self.commander.disarm(force=force)

    def terminate(self) -> Reply:
        is_testing = self.motor_test.is_running and not self.state.is_armed
        self.motor_test.stop()
        return ACCEPTED if is_testing else self.commander.terminate()

    def inject_failure(self, unit: int, failure: int, instance: int) -> Reply:
        request = failure_request(unit, failure)
        if request is None:
            return Reply(Verdict.DENIED, f"there is no failure {failure} of unit {unit}")
        reply = injection_refusal(self.params, self.state, request[1])
        if reply is not None:
            return reply
        if request[0] is Unit.RC_SIGNAL:
            return self._cut_sticks(request[1])
        if self._injector is None:
            return Reply(Verdict.UNSUPPORTED, "nothing here can be made to fail")
        return self._injector.inject(*request, instance)

    def _cut_sticks(self, failure: Failure) -> Reply:
        """Stops listening to the pilot's sticks, or listens again."""
        if failure not in (Failure.OK, Failure.OFF):
            return Reply(Verdict.UNSUPPORTED, f"the sticks cannot be made {failure.name.lower()}")
        self.sticks.is_cut = failure is Failure.OFF
        return ACCEPTED

    def check_arming(self) -> list[str]:
        return self.commander.check_arming()

    def request(self, request: Request) -> Reply:
        match request:
            case ModeRequest():
                return self._carry_out(request)
            case Report():
                return self.navigator.report(request)
            case ChangeMode():
                return self._change_mode(request.mode)
            case StartMission():
                return self._start_mission(request)
            case SetCurrentItem():
                return self.navigator.mission.set_current(request.seq, is_reset=request.is_reset)
            case ChangeSpeed():
                return self.navigator.change_speed(request.speed_m_s, request.kind)
            case SetReverse():
                return self.navigator.set_reversed(is_reversed=request.is_reversed)
            case SetHome():
                return self.commander.set_home(request.lat_deg, request.lon_deg, request.alt_amsl_m)

    def _carry_out(self, request: ModeRequest) -> Reply:
        """Judges a request, hands it to the mode that carries it out, and enters that."""
        mode = self.navigator.mode_for(request)
        if mode is None:
            return Reply(Verdict.UNSUPPORTED, "no mode of this vehicle does that")
        is_flown = mode is self.state.mode
        if request.in_air and not self.navigator.may_go(mode):
            return Reply(Verdict.TEMPORARILY_REJECTED, "not in the air" if self.leaves_ground else "not armed")
        reason = self.commander.request_refusal(mode)
        if reason:
            return Reply(Verdict.TEMPORARILY_REJECTED, reason)
        reply = self.navigator.take(mode, request)
        if reply.verdict is not Verdict.ACCEPTED:
            return reply
        self.commander.guard.release()  # the client takes over from a failsafe
        self.commander.change_mode(mode)
        if is_flown:
            self.navigator.begin_request(mode)
        return ACCEPTED

    def _change_mode(self, mode: Mode) -> Reply:
        reply = self.commander.request_mode(mode)
        if reply.verdict is Verdict.ACCEPTED and self.navigator.is_underway:
            self.navigator.stay()  # here, not at the position it was sent to
        return reply

    def _start_mission(self, request: StartMission) -> Reply:
        mission = self.navigator.mission
        first, last = request.first, request.last
        if not mission.items:  # without one the numbers mean nothing, and mode Mission says why not
            first = last = -1
        if first >= 0:
            reply = mission.set_current(first)
            if reply.verdict is not Verdict.ACCEPTED:
                return reply
        if last >= 0:
            reply = mission.end_after(last)
            if reply.verdict is not Verdict.ACCEPTED:
                return reply
        return self.commander.request_mode(Mode.MISSION)

    def give_corrections(self, rtcm: bytes) -> None:
        if self._on_corrections is not None:
            self._on_corrections(rtcm)

    def reboot(self) -> Reply:
        if self.state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "armed")
        if self._on_reboot is None:
            return Reply(Verdict.UNSUPPORTED, "there is nothing to restart")
        self.motor_test.stop()
        self._on_reboot()
        self.state.boot_us = self.state.time_us
        self.commander.restart()
        return ACCEPTED
