"""A vehicle that keeps what it is asked, and a client at the other end of a memory link."""

from collections.abc import Sequence
from functools import partial
from math import nan
from types import SimpleNamespace
from typing import Any

import numpy as np

from autopilot.estimator.state import EstimatorState
from autopilot.flight_controller import FlightController, HostPorts
from autopilot.interface.aircraft import Aircraft
from autopilot.interface.client_requests import OffboardSetpoint, Request
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
    Setpoint,
)
from common.airframe import load_airframe
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


def flying() -> dict[str, Any]:
    """Fields of the state of a vehicle in the air over home, everything known."""
    return {
        "nearest_aircraft": Aircraft(1, "HB-ABC", 47.0, 8.0, 900.0, 1.0, 60.0, 0.0),
        "time_us": 5_000_000,
        "orbit": OrbitStatus(20.0, 0, HOME),
        "estimate": record(
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
        "samples": record(
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
        "actuators": record(
            Actuators,
            "Actuators",
            command=(0.5, 0.6, 0.5, 0.6, 0.0, 0.0, 0.0, 0.0),
            traj_pos_ned=(10.0, 20.0, -30.0),
            traj_yaw=0.5,
            traj_yaw_rate=nan,
            q_sp_ned_from_frd=(0.0, 0.0, 0.0, 1.0),
            thrust_sp=0.42,
        ),
        "health": record(EstimatorState, "EstimatorState", gnss_pos__test_ratio_lpf=0.1, stillness__accel_var=0.3),
        "origin": HOME,
        "roll_rad": 0.05,
        "pitch_rad": -0.02,
        "yaw_rad": 1.2,
        "home": HOME,
        "mode": Mode.HOLD,
        "is_armed": True,
        "landed_state": 2,
        "is_ready_to_arm": True,
        "battery_remaining": 0.8,
        "battery_used_mah": 400.0,
        "battery_level": BatteryLevel.OK,
        "goal_ned": (40.0, 20.0, -30.0),
        "mission_count": 2,
        "mission_current": 1,
    }


def flying_state() -> VehicleState:
    return VehicleState(**flying())


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


def record_of_truth() -> Any:
    """The simulator's truth: at rest."""
    return record(Truth, "Truth", q_ned_from_frd=(0.0, 0.0, 0.0, 1.0))


def _ports() -> HostPorts:
    setpoint, external = (np.zeros(1, dtype=struct.numpy_dtype()) for struct in (Setpoint, ExternalSample))
    speeds = [500.0, 510.0, 520.0, 530.0, 0.0, 0.0, 0.0, 0.0]
    nothing = [lambda: None] * 4
    return HostPorts(*nothing, setpoint, read_motor_speeds=lambda: speeds, external=external)


class AskedVehicle(FlightController):
    """A vehicle in the air that keeps a list of what it is asked, and answers `reply` instead of doing it."""

    def __init__(self, host: Host | None = None) -> None:
        ports = _ports()
        host = host or Host(read_truth=record_of_truth)
        super().__init__(ports, parameter_table(), load_airframe("x500"), HOME, host=host)
        self.set(**flying())
        self.external_row = ports.external
        self.sticks.joystick_moved((CLIENT_SYSID, CLIENT_COMPID), 5_000_000, (0.0, 0.0, 0.0, 0.0), 0)
        self.obstacles.sensed(self.state.time_us, [5.0] * 71 + [float("inf")], 0.0)
        self.reply = ACCEPTED
        self.arming_problems: list[str] = []
        self.calls: list[Any] = []
        self.setpoints: list[OffboardSetpoint] = []
        self.stored = {
            ListKind.MISSION: RecordingList(MAX_ITEMS),
            ListKind.FENCE: RecordingList(MAX_FENCE_ITEMS),
            ListKind.RALLY: RecordingList(MAX_RALLY_POINTS),
        }
        self.lists = ItemLists(self.stored)
        self._keep(self, "arm", "disarm", "terminate", "inject_failure", "reboot", "give_corrections")
        self.motor_test.spin = self._spin
        self.guidance = self._keep(SimpleNamespace(), "look_at", "look_ahead", "turn", "pause", "resume",
                                   "fly_landing_sequence", "fly_return_path", "abort_landing")  # fmt: skip
        self.calibration = self._keep(SimpleNamespace(), "start", "cancel", "set_offsets")
        self.fence = self._keep(SimpleNamespace(), "enable", "disable")

    def _keep(self, owner: Any, *names: str) -> Any:
        for name in names:
            setattr(owner, name, partial(self._note, name))
        return owner

    def set(self, **values: Any) -> None:
        """Changes fields of its state."""
        for name, value in values.items():
            setattr(self.state, name, value)

    def _note(self, name: str, *args: Any, **options: Any) -> Reply:
        self.calls.append((name, *args, *options.values()))
        return self.reply

    def request(self, request: Request) -> Reply:
        (self.setpoints if isinstance(request, OffboardSetpoint) else self.calls).append(request)
        return self.reply

    def _spin(self, rotors: Sequence[int], command: float, seconds: float, *, pause_s: float = 0.0) -> Reply:
        return self._note("spin", list(rotors), command, seconds, pause_s)

    def check_arming(self) -> list[str]:
        return self.arming_problems


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
        vehicle: AskedVehicle | None = None,
        **options: bool,
    ) -> None:
        self.vehicle = vehicle or AskedVehicle()
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
        self.vehicle.set(**values)


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
