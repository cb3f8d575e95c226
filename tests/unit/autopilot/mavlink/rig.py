"""A vehicle that records what it is asked, and a client at the other end of a memory link."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np

from autopilot.commander.failure_detector import StationLink
from autopilot.estimator.state import EstimatorState
from autopilot.inputs.external_position import ExternalPositions
from autopilot.inputs.obstacles import Obstacles
from autopilot.inputs.sticks import Sticks
from autopilot.inputs.traffic import Traffic
from autopilot.interface.aircraft import Aircraft
from autopilot.interface.client_requests import CalibrationKind, OffboardSetpoint, OrbitRequest, TargetReport
from autopilot.interface.item_lists import ItemLists, ItemRefusal, ListKind, MissionItem
from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import ACCEPTED, BatteryLevel, Mode, OrbitStatus, Reply, VehicleState
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import Link, LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, Message, decode, encode, message_id
from autopilot.mavlink.wire.message_definitions import DEFINITIONS
from autopilot.navigator.fence.fence_items import MAX_FENCE_ITEMS
from autopilot.navigator.fence.rally_points import MAX_RALLY_POINTS
from autopilot.navigator.mission.item_commands import MAX_ITEMS
from autopilot.params import parameter_table
from autopilot.payload.aux_outputs import AuxOutputs
from autopilot.payload.camera.camera import Camera
from autopilot.payload.gimbal.gimbal_control import GimbalControl
from autopilot.payload.payloads import Payloads
from autopilot.ports import (
    HEIGHT_VALID,
    POSITION_VALID,
    TERRAIN_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    WIND_VALID,
    YAW_ALIGNED,
    Actuators,
    Estimate,
    ExternalSample,
    Samples,
)
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from common.geodesy import GeoPoint
from common.records import row_reader
from sim.truth import Truth

FRAME_US = 20_000
HOME = GeoPoint(47.397742, 8.545594, 488.0)
CLIENT_SYSID, CLIENT_COMPID = 255, 190
ALL_VALID = TILT_ALIGNED | YAW_ALIGNED | VELOCITY_VALID | POSITION_VALID | HEIGHT_VALID | TERRAIN_VALID | WIND_VALID


def record(struct_type: Any, name: str, **values: Any) -> Any:
    """A row of a kernel struct as the vehicle's state carries it; `a__b` names field b of struct a."""
    rows = np.zeros(1, dtype=struct_type.numpy_dtype())
    for path, value in values.items():
        *outer, last = path.split("__")
        target = rows
        for part in outer:
            target = target[part]
        target[last] = value
    return row_reader(rows, 0, name)()


def flying_state() -> VehicleState:
    """In the air over home, everything known."""
    return VehicleState(
        time_us=5_000_000,
        orbit=OrbitStatus(20.0, 0, HOME),
        estimate=record(
            Estimate,
            "Estimate",
            flags=ALL_VALID,
            q_ned_from_frd=(0.0, 0.0, 0.6, 0.8),
            omega_frd=(0.1, 0.2, 0.3),
            vel_ned=(1.0, 2.0, -0.5),
            pos_ned=(10.0, 20.0, -30.0),
            wind_ned=(3.0, -4.0, 0.0),
            terrain_d=-1.0,
            pos_h_std=0.4,
            pos_v_std=0.3,
        ),
        samples=record(
            Samples,
            "Samples",
            imu__time_us=4_996_000,
            imu__accel_frd=(0.0, 0.0, -9.81),
            gnss__time_us=4_880_000,
            gnss__fix_type=3,
            gnss__satellites=14,
            gnss__pos_ned=(10.1, 20.1, -30.2),
            gnss__vel_ned=(1.0, 2.0, -0.5),
            gnss__pos_h_std=0.7,
            gnss__pos_v_std=1.0,
            baro__time_us=4_980_000,
            baro__pressure_pa=95_000.0,
            baro__temperature_c=21.5,
            mag__time_us=4_980_000,
            mag__field_frd_gauss=(0.2, 0.0, 0.4),
            range__time_us=4_960_000,
            range__distance_m=29.0,
            range__is_valid=1,
            battery__time_us=4_990_000,
            battery__voltage_v=15.8,
            battery__current_a=12.5,
        ),
        actuators=record(
            Actuators,
            "Actuators",
            command=(0.5, 0.6, 0.5, 0.6, 0.0, 0.0, 0.0, 0.0),
            traj_pos_ned=(10.0, 20.0, -30.0),
            traj_yaw=0.5,
            traj_yaw_rate=nan,
            q_sp_ned_from_frd=(0.0, 0.0, 0.0, 1.0),
            thrust_sp=0.42,
        ),
        health=record(EstimatorState, "EstimatorState", gnss_pos__test_ratio_lpf=0.1, stillness__accel_var=0.3),
        origin=HOME,
        roll_rad=0.05,
        pitch_rad=-0.02,
        yaw_rad=1.2,
        home=HOME,
        mode=Mode.HOLD,
        is_armed=True,
        landed_state=2,
        is_ready_to_arm=True,
        battery_remaining=0.8,
        battery_used_mah=400.0,
        battery_level=BatteryLevel.OK,
        goal_ned=(40.0, 20.0, -30.0),
        mission_count=2,
        mission_current=1,
    )


class RecordingList:
    """Takes every list, unless it is told to refuse."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.items: Sequence[MissionItem] = []
        self.refusal: ItemRefusal | None = None

    def load(self, items: Sequence[MissionItem]) -> ItemRefusal | None:
        if self.refusal is None:
            self.items = list(items)
        return self.refusal


class RecordingGuidance:
    """Passes what is asked on to its vehicle's list."""

    def __init__(self, record: Callable[..., Reply]) -> None:
        self._record = record

    def look_at(self, command: int, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        return self._record("look_at", command, lat_deg, lon_deg, alt_amsl_m)

    def look_ahead(self, command: int, offset_deg: float) -> Reply:
        return self._record("look_ahead", command, offset_deg)

    def turn(self, angle_deg: float, rate_deg_s: float, direction: float, *, is_relative: bool) -> Reply:
        return self._record("turn", angle_deg, rate_deg_s, direction, is_relative)

    def pause(self) -> Reply:
        return self._record("pause")

    def resume(self) -> Reply:
        return self._record("resume")

    def fly_landing_sequence(self) -> Reply:
        return self._record("fly_landing_sequence")

    def fly_return_path(self) -> Reply:
        return self._record("fly_return_path")

    def abort_landing(self, height_m: float) -> Reply:
        return self._record("abort_landing", height_m)


class RecordingGuided:
    """Mode Guided of a recording vehicle; its requests are in the vehicle's list."""

    def __init__(self, record: Callable[..., Reply]) -> None:
        self._record = record

    def takeoff(self, alt_amsl_m: float, yaw_rad: float) -> Reply:
        return self._record("guided.takeoff", alt_amsl_m, yaw_rad)

    def goto(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, yaw_rad: float, speed_m_s: float) -> Reply:
        return self._record("guided.goto", lat_deg, lon_deg, alt_amsl_m, yaw_rad, speed_m_s)

    def forget_goto(self) -> None:
        self._record("guided.forget_goto")


class RecordedMotorTest:
    """The motor test of a recording vehicle with four rotors, numbered as those of an X are."""

    rotor_count = 4
    clockwise = (0, 3, 1, 2)

    def __init__(self, record: Callable[..., Reply]) -> None:
        self._record = record

    def spin(self, rotors: Sequence[int], command: float, seconds: float, *, pause_s: float = 0.0) -> Reply:
        return self._record("spin", list(rotors), command, seconds, pause_s)


class RecordedCalibration:
    """The calibration of a recording vehicle."""

    def __init__(self, vehicle: Any) -> None:
        self._vehicle = vehicle

    def start(self, kind: CalibrationKind) -> Reply:
        return self._vehicle._record("calibrate", kind)

    def cancel(self) -> Reply:
        return self._vehicle._record("cancel_calibration")

    def set_offsets(self, sensor: str, offsets: tuple[float, float, float]) -> None:
        self._vehicle._record("set_offsets", sensor, offsets)


def record_of_truth() -> Any:
    """The simulator's truth: at rest."""
    return record(Truth, "Truth", q_ned_from_frd=(0.0, 0.0, 0.0, 1.0))


class RecordingVehicle:
    """Answers every request with `reply` and keeps a list of them."""

    def __init__(self) -> None:
        self.state = flying_state()
        self.params = parameter_table()
        self.station = StationLink()
        self.calibration = RecordedCalibration(self)
        self.host = Host(read_truth=record_of_truth)
        self.camera: Camera | None = None
        self.gimbal: GimbalControl | None = None
        self.sticks = Sticks(self.params)
        self.state.sticks = self.sticks.input
        self.sticks.joystick_moved((CLIENT_SYSID, CLIENT_COMPID), 5_000_000, (0.0, 0.0, 0.0, 0.0), 0)
        self.modes = MULTIROTOR_MODES
        self.reply = ACCEPTED
        self.arming_problems: list[str] = []
        self.calls: list[tuple[Any, ...]] = []
        self.setpoints: list[OffboardSetpoint] = []
        self.stored = {
            ListKind.MISSION: RecordingList(MAX_ITEMS),
            ListKind.FENCE: RecordingList(MAX_FENCE_ITEMS),
            ListKind.RALLY: RecordingList(MAX_RALLY_POINTS),
        }
        self.lists = ItemLists(self.stored)
        self.guided = RecordingGuided(self._record)
        self.guidance = RecordingGuidance(self._record)
        self.motor_test = RecordedMotorTest(self._record)
        self.payload = Payloads()
        self.payload.add(AuxOutputs(self.state))
        self.traffic = Traffic(self.state, self.params)
        self.obstacles = Obstacles(self.params)
        self.external_row = np.zeros(1, dtype=ExternalSample.numpy_dtype())
        self.external = ExternalPositions(
            self.external_row,
            self.params,
            lambda: self.state.time_us,
            lambda: (self.state.estimate, self.state.yaw_rad),
        )
        self.obstacles.sensed(self.state.time_us, [5.0] * 71 + [float("inf")], 0.0)
        self.state.obstacles = self.obstacles
        self.state.read_rotor_speeds = lambda: [500.0, 510.0, 520.0, 530.0, 0.0, 0.0, 0.0, 0.0]
        self.state.nearest_aircraft = Aircraft(1, "HB-ABC", 47.0, 8.0, 900.0, 1.0, 60.0, 0.0)

    @property
    def fence(self) -> "RecordingVehicle":
        return self

    def enable(self, limits: int) -> Reply:
        return self._record("fence.enable", limits)

    def disable(self, limits: int) -> Reply:
        return self._record("fence.disable", limits)

    def give_corrections(self, rtcm: bytes) -> None:
        self._record("give_corrections", rtcm)

    def _record(self, *call: Any) -> Reply:
        self.calls.append(call)
        return self.reply

    def follow_ardupilot(self) -> None:
        self.sticks.follow_ardupilot()

    def arm(self, *, force: bool) -> Reply:
        return self._record("arm", force)

    def disarm(self, *, force: bool) -> Reply:
        return self._record("disarm", force)

    def terminate(self) -> Reply:
        return self._record("terminate")

    def inject_failure(self, unit: int, failure: int, instance: int) -> Reply:
        return self._record("inject_failure", unit, failure, instance)

    def check_arming(self) -> list[str]:
        return self.arming_problems

    def set_mode(self, mode: Mode) -> Reply:
        return self._record("set_mode", mode)

    def takeoff(self, alt_amsl_m: float, yaw_rad: float) -> Reply:
        return self._record("takeoff", alt_amsl_m, yaw_rad)

    def land(self, lat_deg: float, lon_deg: float, yaw_rad: float) -> Reply:
        return self._record("land", lat_deg, lon_deg, yaw_rad)

    def reposition(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, yaw_rad: float, speed_m_s: float) -> Reply:
        return self._record("reposition", lat_deg, lon_deg, alt_amsl_m, yaw_rad, speed_m_s)

    def change_speed(self, speed_m_s: float, kind: int) -> Reply:
        return self._record("change_speed", speed_m_s, kind)

    def set_home(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        return self._record("set_home", lat_deg, lon_deg, alt_amsl_m)

    def set_offboard(self, setpoint: OffboardSetpoint) -> None:
        self.setpoints.append(setpoint)

    def orbit(self, request: OrbitRequest) -> Reply:
        return self._record("orbit", request)

    def report_target(self, report: TargetReport) -> None:
        self._record("report_target", report)

    def report_landing_target(self, pos_ned: tuple[float, float, float]) -> None:
        self._record("report_landing_target", pos_ned)

    def start_mission(self, first: int, last: int) -> Reply:
        return self._record("start_mission", first, last)

    def set_current_item(self, seq: int, *, is_reset: bool = False) -> Reply:
        return self._record("set_current_item", seq, *([is_reset] if is_reset else []))

    def reboot(self) -> Reply:
        return self._record("reboot")


class Client:
    """A client's end of a link."""

    def __init__(self, link: Link, sysid: int = CLIENT_SYSID, compid: int = CLIENT_COMPID) -> None:
        self.link = link
        self.sysid = sysid
        self.compid = compid
        self._reader = FrameReader()
        self._seq = 0

    def send(self, name: str, **fields: Any) -> None:
        fieldnames = DEFINITIONS[message_id(name)].fieldnames
        if "target_system" in fieldnames and name not in ("PING", "TIMESYNC"):
            fields = {"target_system": 1} | fields
        self.link.send(encode(name, self.sysid, self.compid, self._seq, **fields))
        self._seq += 1

    def command(self, command: int, *params: float) -> None:
        """COMMAND_LONG; parameters left out are NaN."""
        values = (*params, *(nan,) * (7 - len(params)))
        self.send("COMMAND_LONG", command=command, **{f"param{i + 1}": value for i, value in enumerate(values)})

    def received(self) -> list[Message]:
        return [decode(frame) for data in self.link.receive() for frame in self._reader.feed(data)]


class Rig:
    """Server and client in simulated time."""

    def __init__(
        self,
        role: LinkRole = LinkRole.GROUND,
        dialect: Dialect = PX4,
        vehicle: RecordingVehicle | None = None,
        **options: bool,
    ) -> None:
        self.vehicle = vehicle or RecordingVehicle()
        vehicle_end, client_end = memory_pair(role)
        second_vehicle_end, second_client_end = memory_pair(LinkRole.ONBOARD)
        self.client = Client(client_end)
        self.second_client = Client(second_client_end, 245, 191)
        self.log: list[tuple[int, bytes]] = []
        self.server = MavlinkServer(
            self.vehicle,
            [vehicle_end, second_vehicle_end],
            dialect,
            on_frame=lambda time_us, data: self.log.append((time_us, data)),
            **options,
        )
        self.time_us = 5_000_000

    def frame(self, count: int = 1) -> list[Message]:
        """What the first client received in the next frames."""
        messages: list[Message] = []
        for _ in range(count):
            self.time_us += FRAME_US
            self.vehicle.state.time_us = self.time_us
            self.server.frame(self.time_us)
            messages += self.client.received()
        return messages

    def only(self, name: str, count: int = 1) -> Any:
        """The fields of the only message of this name in the next frames."""
        (fields,) = self.all(name, count)
        return fields

    def all(self, name: str, count: int = 1) -> list[Any]:
        return [message.fields for message in self.frame(count) if message.name == name]

    def ack(self, command: int, *params: float) -> Any:
        """The acknowledgement of a COMMAND_LONG, in the frame after it."""
        self.client.command(command, *params)
        return self.only("COMMAND_ACK")

    def update(self, **values: Any) -> None:
        """Changes fields of the vehicle's state."""
        self.vehicle.state = replace(self.vehicle.state, **values)


def texts(messages: list[Message]) -> list[str]:
    """The texts in order, chunks put together."""
    whole: list[str] = []
    for message in messages:
        if message.name == "STATUSTEXT":
            if message.fields.chunk_seq:
                whole[-1] += message.fields.text
            else:
                whole.append(message.fields.text)
    return whole
