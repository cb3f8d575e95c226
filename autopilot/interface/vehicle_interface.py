"""What may be asked of the vehicle, and whom its parts tell what happens.

`Vehicle` is what a MAVLink handler works with; autopilot.flight_controller.FlightController is one. What belongs
together is an ability of its own.
"""

from collections.abc import Sequence
from typing import Protocol

from autopilot.inputs.external_position import ExternalPositions
from autopilot.inputs.obstacles import Obstacles
from autopilot.inputs.sticks import Sticks
from autopilot.inputs.traffic import Traffic
from autopilot.interface.ardupilot_vehicle import ArduPilotVehicle
from autopilot.interface.client_requests import CalibrationKind, Request
from autopilot.interface.item_lists import ItemLists
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import Reply, Severity, VehicleState
from autopilot.payload.camera.camera import Camera
from autopilot.payload.gimbal.gimbal_control import GimbalControl
from autopilot.payload.payloads import Payloads
from common.params import ParameterTable


class Announcer(Protocol):
    """Where the vehicle's parts report events; the MAVLink server sends them to every link."""

    def statustext(self, severity: Severity, text: str) -> None: ...

    def mission_item_reached(self, seq: int) -> None: ...

    def mission_current_changed(self, seq: int) -> None: ...

    def home_changed(self) -> None: ...

    def heartbeat_now(self) -> None:
        """Mode or arming changed: send a heartbeat in this frame."""
        ...


class Station(Protocol):
    """Whether a ground station is there."""

    def heard(self, time_us: int) -> None:
        """A heartbeat of a ground station has come in."""
        ...


class Calibration(Protocol):
    """The calibration of the sensors of a disarmed vehicle."""

    def start(self, kind: CalibrationKind) -> Reply: ...

    def cancel(self) -> Reply: ...

    def set_offsets(self, sensor: str, offsets: tuple[float, float, float]) -> None:
        """Writes the offsets of a sensor: GYRO, ACC or MAG."""
        ...


class MotorTests(Protocol):
    """Motors that are turned on the ground (autopilot.motor_test)."""

    motor_count: int
    clockwise: Sequence[int]  # motors from 0, from the nose on

    def spin(self, motors: Sequence[int], command: float, seconds: float, *, pause_s: float = 0.0) -> Reply:
        """Turns motors one after the other, each so long."""
        ...


class FenceSwitch(Protocol):
    """What may be asked of the fence besides loading it; `limits` are bits of FenceLimit."""

    def enable(self, limits: int) -> Reply: ...

    def disable(self, limits: int) -> Reply: ...


class Guidance(Protocol):
    """What may be asked of the flight besides a mode, a position or a mission (autopilot.roi_and_pause)."""

    def look_at(self, command: int, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        """Nose and gimbal towards a position from now on; `command` is handed to the payload."""
        ...

    def look_ahead(self, command: int, offset_deg: float) -> Reply:
        """Nose and gimbal as the mode has them, on mission legs turned by an offset."""
        ...

    def turn(self, angle_deg: float, rate_deg_s: float, direction: float, *, is_relative: bool) -> Reply: ...

    def pause(self) -> Reply:
        """Stops a mission or a client's setpoints, and holds."""
        ...

    def resume(self) -> Reply:
        """Goes on with what was paused; with the mission if nothing was."""
        ...

    def fly_landing_sequence(self) -> Reply: ...

    def fly_return_path(self) -> Reply: ...

    def abort_landing(self, height_m: float) -> Reply:
        """Climbs away from a landing, to a height above home at least, and holds."""
        ...


class Vehicle(Protocol):
    """What may be asked of the vehicle."""

    state: VehicleState
    params: ParameterTable
    host: Host
    camera: Camera | None
    gimbal: GimbalControl | None
    modes: ModeTable
    ardupilot: ArduPilotVehicle
    leaves_ground: bool

    @property
    def lists(self) -> ItemLists:
        """Mission, fence and rally points."""
        ...

    @property
    def station(self) -> Station: ...

    @property
    def calibration(self) -> Calibration: ...

    sticks: Sticks

    @property
    def motor_test(self) -> MotorTests: ...

    @property
    def fence(self) -> FenceSwitch: ...

    @property
    def guidance(self) -> Guidance: ...
    @property
    def payload(self) -> Payloads: ...

    @property
    def traffic(self) -> Traffic: ...

    @property
    def obstacles(self) -> Obstacles: ...

    @property
    def external(self) -> ExternalPositions: ...

    def follow_ardupilot(self) -> None:
        """From now on pilots and modes are treated as ArduPilot treats them."""
        ...

    def arm(self, *, force: bool) -> Reply: ...

    def disarm(self, *, force: bool) -> Reply: ...

    def terminate(self) -> Reply:
        """Stops the motors for good, wherever the vehicle is."""
        ...

    def inject_failure(self, unit: int, failure: int, instance: int) -> Reply:
        """Breaks or repairs a part; numbers as FAILURE_UNIT and FAILURE_TYPE, instances from 1, 0: all."""
        ...

    def check_arming(self) -> list[str]:
        """Reasons why the vehicle may not be armed now; empty when ready."""
        ...

    def request(self, request: Request) -> Reply:
        """Everything else that clients ask and report (autopilot.interface.client_requests)."""
        ...

    def give_corrections(self, rtcm: bytes) -> None:
        """Passes corrections on to the GNSS receiver."""
        ...

    def reboot(self) -> Reply: ...
