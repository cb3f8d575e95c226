"""Whatever clients send, the flight controller goes on: the real commander and navigator behind the server."""

from math import nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot.interface.client_requests import ChangeMode, TakeOff
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import frame_bytes, known_type
from autopilot.params import parameter_table
from tests.unit.autopilot.kinematic import Kinematic, item, position_setpoint
from tests.unit.autopilot.mavlink.rig import Client

COMMANDS = (400, 22, 21, 20, 176, 192, 178, 179, 410, 193, 300, 224, 511, 510, 512, 520, 401, 246)
ITEM_COMMANDS = (16, 17, 19, 20, 21, 22, 93, 112, 115, 177, 178, 179, 206, 5001, 0, 65535)
MESSAGES = (
    "SET_MODE", "MISSION_SET_CURRENT", "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_ATTITUDE_TARGET", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_CLEAR_ALL", "PARAM_SET",
    "FOLLOW_TARGET", "GLOBAL_POSITION_INT", "LANDING_TARGET", "ODOMETRY", "VISION_POSITION_ESTIMATE",
    "OBSTACLE_DISTANCE", "MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "GIMBAL_MANAGER_SET_PITCHYAW", "ADSB_VEHICLE",
)  # fmt: skip
EDGES = st.sampled_from(
    [float("nan"), float("inf"), 0.0, -1.0, 1.0, 2.0, 4.0, 6.0, 21196.0, 3.4e38, -3.4e38, 500.0, 47.4, 1e30, 1e-45]
)
ASKED = ("pos_ned", "vel_ned", "accel_ned", "yaw", "thrust", "cruise_speed", "q_ned_from_frd")
numbers = EDGES | st.floats(width=32)


class Flight:
    """A vehicle in the air, with a client; a new one takes off when the last one has landed."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        self.vehicle = Kinematic().flying()
        self.vehicle.fc.params = parameter_table()  # with MAV_SYS_ID
        vehicle_end, client_end = memory_pair()
        self.client = Client(client_end)
        self.vehicle.fc.attach(MavlinkServer(self.vehicle.fc, [vehicle_end]))

    def is_answered(self) -> bool:
        """Whether the controller still runs and answers, and no setpoint is infinite."""
        self.client.command(9999)
        for _ in range(25):
            self.vehicle.frame()
        for field in ASKED:
            assert not np.isinf(self.vehicle.setpoint[field]).any(), field
        names = {message.name for message in self.client.received()}
        if not self.vehicle.state.is_armed:
            self._start()
        return "COMMAND_ACK" in names


@pytest.fixture(scope="module")
def flight():
    return Flight()


@settings(deadline=None, max_examples=300)
@given(command=st.sampled_from(COMMANDS), params=st.lists(numbers, min_size=7, max_size=7))
def test_any_command(flight, command, params):
    flight.client.command(command, *params)
    assert flight.is_answered()


@settings(deadline=None, max_examples=200)
@given(
    items=st.lists(
        st.tuples(
            st.sampled_from(ITEM_COMMANDS),
            st.sampled_from([0, 2, 3, 6, 10, 1, 77]),
            st.lists(numbers, min_size=5, max_size=5),
            st.sampled_from([473977420, 473980000, 0, 2**31 - 1, -(2**31)]),
            st.sampled_from([85455940, 85460000, 0, 2**31 - 1, -(2**31)]),
        ),
        min_size=1,
        max_size=4,
    ),
    first=st.sampled_from([0.0, 1.0, -1.0, float("nan")]),
)
def test_any_mission(flight, items, first):
    flight.client.send("MISSION_COUNT", target_component=1, count=len(items))
    for seq, (command, frame, params, x, y) in enumerate(items):
        p1, p2, p3, p4, z = params
        flight.client.send(
            "MISSION_ITEM_INT", target_component=1, seq=seq, frame=frame, command=command, autocontinue=1,
            param1=p1, param2=p2, param3=p3, param4=p4, x=x, y=y, z=z,
        )  # fmt: skip
    flight.vehicle.frame()
    assert "MISSION_ACK" in {message.name for message in flight.client.received()}
    flight.client.command(300, first)
    assert flight.is_answered()


@settings(deadline=None, max_examples=200)
@given(name=st.sampled_from(MESSAGES), seed=st.integers(0, 2**32 - 1))
def test_any_message(flight, name, seed):
    kind = known_type(name)
    fields = kind.unpack(np.random.default_rng(seed).bytes(kind.size))._asdict()
    fields |= {key: 1 for key in ("target_system", "target_component") if key in fields}
    flight.client.link.send(frame_bytes(kind, kind.pack(**fields), 0, 255, 190))
    assert flight.is_answered()


def test_any_parameter_at_its_bounds(flight):
    table = flight.vehicle.table
    for declaration in table.declarations.values():
        for value in (declaration.minimum, declaration.maximum, declaration.default):
            table.set(declaration.name, value)
            assert flight.is_answered()


class Lost(Kinematic):
    """An estimate that is no number while `is_lost`."""

    is_lost = False

    def _publish(self):
        super()._publish()
        if self.is_lost:
            for name in ("pos_ned", "vel_ned", "terrain_d", "pos_h_std", "vel_std"):
                self.estimate[name] = nan


def enter(vehicle, mode):
    """Does what makes the mode possible, and asks for it; returns whether it is flown."""
    fc = vehicle.fc
    vehicle.pilot()
    fc.request(position_setpoint(5.0, 5.0, -10.0))
    fc.lists.load(ListKind.MISSION, [item(0, 16, 50.0), item(1, 16, 50.0, 50.0), item(2, 21, 0.0, 0.0, 0.0)])
    if mode is Mode.TAKEOFF:
        fc.request(TakeOff(vehicle.state.position.alt_m + 20.0, nan))
    elif mode is Mode.TERMINATION:
        fc.terminate()
    else:
        fc.request(ChangeMode(mode))
    return vehicle.state.mode is mode


def in_mode(mode, dialect):
    """A vehicle in the air in a mode, and a client."""
    vehicle = Lost()
    vehicle.fc.params = parameter_table()
    vehicle_end, client_end = memory_pair()
    vehicle.flying()
    vehicle.fc.attach(MavlinkServer(vehicle.fc, [vehicle_end], dialect))
    enter(vehicle, mode)
    vehicle.frame()
    assert enter(vehicle, mode)
    return vehicle, Client(client_end)


def extremes(rng, kind):
    """Fields of any bits, extreme numbers in the floats, addressed to the vehicle."""
    fields = kind.unpack(rng.bytes(kind.size))._asdict()
    edges = [nan, 3.4e38, -3.4e38, 1e30, 1e-45, 1e6, 900.0, -20.0, 1.0, 0.0]
    for name, value in fields.items():
        if isinstance(value, float) and rng.random() < 0.8:
            fields[name] = float(rng.choice(edges))
        elif isinstance(value, tuple) and isinstance(value[0], float):
            fields[name] = [float(edge) for edge in rng.choice(edges, len(value))]
        elif isinstance(value, int) and rng.random() < 0.8:
            fields[name] = value & int(rng.choice((0x0, 0x1, 0x3, 0xF)))
    if "lat" in fields and "lon" in fields:
        fields |= {"lat": 473977420, "lon": 85455940}
    return fields | {key: 1 for key in ("target_system", "target_component") if key in fields}


@pytest.mark.parametrize("dialect", [PX4, ARDUPILOT], ids=lambda dialect: dialect.name)
@pytest.mark.parametrize("mode", list(Mode), ids=lambda mode: mode.name)
def test_extreme_numbers_in_any_mode(mode, dialect):
    rng = np.random.default_rng(mode)
    vehicle, client = in_mode(mode, dialect)
    frames_in_mode = 0
    for _ in range(150):
        for _ in range(3):
            kind = known_type(str(rng.choice(MESSAGES)))
            client.link.send(frame_bytes(kind, kind.pack(**extremes(rng, kind)), 0, 255, 190))
        frames_in_mode += vehicle.state.mode is mode or enter(vehicle, mode)
        vehicle.frame()
        if not vehicle.state.is_flying:
            vehicle, client = in_mode(mode, dialect)
        for field in ASKED:
            assert not np.isinf(vehicle.setpoint[field]).any(), field
        assert np.isfinite(vehicle.pos).all()
    assert frames_in_mode > 75
    client.command(9999)
    vehicle.frame()
    assert "COMMAND_ACK" in {message.name for message in client.received()}


@pytest.mark.parametrize("mode", list(Mode), ids=lambda mode: mode.name)
def test_an_estimate_that_is_no_number_ends_no_mode(mode):
    vehicle, client = in_mode(mode, PX4)
    before = (vehicle.pos.copy(), vehicle.vel.copy())
    vehicle.is_lost = True
    for _ in range(10):
        vehicle.frame()
        vehicle.pos, vehicle.vel = (array.copy() for array in before)
    vehicle.is_lost = False
    vehicle.run(2.0)
    client.command(9999)
    vehicle.frame()
    assert "COMMAND_ACK" in {message.name for message in client.received()}
