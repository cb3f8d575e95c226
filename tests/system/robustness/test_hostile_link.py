"""Wrong traffic on a second link while the vehicle holds its position: everything is answered, nothing stops it."""

from math import inf, nan

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, frame_bytes, known_type
from mission.client import MissionRefused
from mission.flight import Flight, FlightConfig
from mission.plan.plan_file import PlanItem
from mission.script import Drone

HEIGHT_M = 10.0
HOLD_M = 0.5
STATION = 255, 190
UNSUPPORTED, DENIED = mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED


class Station:
    """A ground station that speaks through pymavlink."""

    def __init__(self, link):
        self._link = link
        self._reader = FrameReader()
        self.mav = mavlink.MAVLink(self, *STATION)
        self.frames = []

    def write(self, data):
        """What pymavlink has packed."""
        self._link.send(bytes(data))

    def take(self, name):
        """The messages of a kind that have come since the last call; the others are forgotten."""
        messages = [decode(frame) for data in self._link.receive() for frame in self._reader.feed(data)]
        return [message.fields for message in messages if message.name == name]


class Holding:
    """A vehicle that holds 10 m above home without sensor noise, and a station on a link of its own."""

    def __init__(self):
        vehicle_end, station_end = memory_pair(LinkRole.GROUND)
        self.flight = Flight(FlightConfig(noise=0.0), links=[vehicle_end])
        self.station = Station(station_end)
        self.flight.fly(self._climb)
        assert self.height_m == pytest.approx(HEIGHT_M, abs=0.3)
        self.run(2.0)
        self.station.take("COMMAND_ACK")

    @staticmethod
    async def _climb(drone: Drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(HEIGHT_M)

    @property
    def body(self):
        return self.flight.rig.rows["truth"][0]

    @property
    def height_m(self):
        return -float(self.body["pos_ned"][2])

    def run(self, seconds, each_frame=lambda: None):
        """Advances; returns the largest distance from where it was [m]."""
        start_ned, distances_m = self.body["pos_ned"].copy(), []
        for _ in range(round(seconds * 50)):
            each_frame()
            self.flight.frame()
            distances_m.append(float(np.linalg.norm(self.body["pos_ned"] - start_ned)))
        return max(distances_m)


@pytest.fixture(scope="module")
def holding():
    holding = Holding()
    yield holding
    assert holding.flight.controller.state.is_armed
    assert holding.height_m == pytest.approx(HEIGHT_M, abs=1.0)
    holding.flight.close()


def command(station, number, *params, x=0, y=0, z=0.0, frame=0):
    station.mav.command_int_send(1, 1, frame, number, 0, 0, *params, *([0.0] * (4 - len(params))), x, y, z)


def test_broken_bytes_change_nothing(holding):
    rng = np.random.default_rng(1)
    station = holding.station
    whole = [frame_bytes(known_type("COMMAND_LONG"), bytes(33), seq, *STATION) for seq in range(8)]

    def disturb():
        frame = bytearray(whole[rng.integers(8)])
        frame[rng.integers(len(frame))] ^= rng.integers(1, 256)
        station.write(frame[: rng.integers(1, len(frame) + 1)])
        station.write(rng.bytes(rng.integers(1, 300)))

    assert holding.run(10.0, disturb) < HOLD_M
    for _ in range(40):  # fills up whatever frame a false start has announced
        station.mav.command_long_send(1, 1, 31_000, 0, *[0.0] * 7)
    holding.run(0.1)
    assert station.take("COMMAND_ACK")[-1].result == UNSUPPORTED


def test_unknown_commands_are_all_answered_unsupported(holding):
    rng = np.random.default_rng(2)
    supported = holding.flight.server.command_handlers()
    unknown = [int(number) for number in rng.integers(0, 65_536, 400) if number not in supported]
    acks = []

    def disturb():
        if unknown:
            number = unknown.pop()
            station.mav.command_long_send(1, 1, number, 0, *rng.normal(scale=100.0, size=7))
            command(station, number, nan, inf)
        acks.extend(station.take("COMMAND_ACK"))

    station, count = holding.station, 2 * len(unknown)
    assert holding.run(9.0, disturb) < HOLD_M
    assert len(acks) == count
    assert {ack.result for ack in acks} == {UNSUPPORTED}


@pytest.mark.parametrize(
    ("number", "arguments"),
    [
        (mavlink.MAV_CMD_DO_REPOSITION, {"x": 2_000_000_000, "z": 500.0}),  # latitude 200 degrees
        (mavlink.MAV_CMD_DO_REPOSITION, {"z": inf}),
        (mavlink.MAV_CMD_DO_REPOSITION, {"z": 500.0, "frame": 99}),
        (mavlink.MAV_CMD_NAV_TAKEOFF, {"z": 1e30}),
        (mavlink.MAV_CMD_NAV_LAND, {"x": 950_000_000}),
        (mavlink.MAV_CMD_DO_SET_MODE, {"params": (1.0, 77.0, 77.0)}),
        (mavlink.MAV_CMD_DO_SET_MODE, {"params": (1.0, nan, nan)}),
        (mavlink.MAV_CMD_DO_CHANGE_SPEED, {"params": (1.0, -5.0)}),
        (mavlink.MAV_CMD_DO_CHANGE_SPEED, {"params": (1.0, 1e9)}),
        (mavlink.MAV_CMD_DO_SET_HOME, {"x": 1_000_000_000, "y": 0, "z": 500.0}),
        (mavlink.MAV_CMD_MISSION_START, {"params": (99.0,)}),
        (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, {"params": (99.0,)}),
        (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, {"params": (0.0,)}),
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, {"params": (0.0,)}),  # in the air
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, {"params": (nan,)}),
        (mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, {"params": (1.0,)}),  # in the air
        (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, {"params": (0.0, -1.0)}),  # the heartbeat stays
        (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, {"params": (30.0, nan)}),
        (mavlink.MAV_CMD_REQUEST_MESSAGE, {"params": (1e9,)}),
    ],
)
def test_known_command_with_wrong_values_is_refused_once(holding, number, arguments):
    station = holding.station
    station.take("COMMAND_ACK")
    command(station, number, *arguments.pop("params", ()), **arguments)
    assert holding.run(1.0) < HOLD_M
    acks = station.take("COMMAND_ACK")
    assert [ack.command for ack in acks] == [number]
    assert acks[0].result != mavlink.MAV_RESULT_ACCEPTED


@pytest.mark.parametrize(
    ("item", "result"),
    [
        ({"command": mavlink.MAV_CMD_NAV_VTOL_TAKEOFF}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"command": 65_535}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"frame": 99}, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        ({"params": (inf, 0.0, 0.0, nan)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"params": (0.0, -inf, 0.0, nan)}, mavlink.MAV_MISSION_INVALID_PARAM2),
        ({"x": 147.0}, mavlink.MAV_MISSION_INVALID_PARAM5_X),
        ({"z": nan}, mavlink.MAV_MISSION_INVALID_PARAM7),
        ({"z": inf}, mavlink.MAV_MISSION_INVALID_PARAM7),
    ],
)
def test_wrong_mission_item_is_refused_and_the_old_mission_stays(holding, item, result):
    fields = {"seq": 1, "frame": 3, "command": 16, "params": (0.0, 0.0, 0.0, nan), "x": 47.398, "y": 8.546, "z": 10.0}
    good = PlanItem(**fields | {"seq": 0})

    async def script(drone):
        await drone.upload([good])
        await drone.upload([good, PlanItem(**fields | item)])

    running = holding.flight.fly(script, seconds=5.0)
    assert isinstance(running.error, MissionRefused), running.error
    assert running.error.result == result
    assert "item 2" in str(running.error)
    kept = holding.flight.fly(lambda drone: drone.download(), seconds=5.0).result
    assert len(kept) == 1
    assert holding.run(0.5) < HOLD_M


def test_upload_that_stops_half_way_is_cancelled(holding):
    station = holding.station
    station.take("MISSION_ACK")
    station.mav.mission_count_send(1, 1, 5)
    assert holding.run(12.0) < HOLD_M
    acks = station.take("MISSION_ACK")
    assert [ack.type for ack in acks] == [mavlink.MAV_MISSION_OPERATION_CANCELLED]


def test_setpoints_without_offboard_mode_move_nothing(holding):
    rng = np.random.default_rng(3)
    mav = holding.station.mav

    def disturb():
        values = [float(value) for value in rng.choice([nan, inf, -inf, 1e30, 0.0, -3.0], 11)]
        frame, mask = int(rng.integers(0, 22)), int(rng.integers(0, 65_536))
        mav.set_position_target_local_ned_send(0, 1, 1, frame, mask, *values)
        mav.set_position_target_global_int_send(0, 1, 1, frame, mask, 2**31 - 1, -(2**31), *values[2:])
        mav.set_attitude_target_send(0, 1, 1, mask & 0xFF, values[:4], *values[4:8])

    assert holding.run(5.0, disturb) < HOLD_M


@pytest.mark.parametrize(
    ("name", "asked", "stored"),
    [
        ("MIS_TAKEOFF_ALT", 1e9, 80.0),
        ("MIS_TAKEOFF_ALT", -1e9, 0.5),
        ("MIS_TAKEOFF_ALT", nan, 2.5),
        ("MIS_TAKEOFF_ALT", inf, 2.5),
        ("COM_LOW_BAT_ACT", 99.0, 3.0),
        ("SYS_AUTOSTART", 1.0, 4001.0),  # a constant
    ],
)
def test_parameter_out_of_range_is_answered_with_what_is_stored(holding, name, asked, stored):
    async def script(drone):
        default = await drone.get_parameter(name)
        answer = await drone.set_parameter(name, asked)
        kept = await drone.get_parameter(name)
        await drone.set_parameter(name, default)
        return answer, kept

    running = holding.flight.fly(script, seconds=5.0)
    assert running.error is None
    assert running.result == (stored, stored)
    assert holding.run(0.2) < HOLD_M


def test_valid_messages_of_any_content_never_stop_a_flight():
    """Some of them are obeyed: the vehicle may go anywhere, but its controller goes on and its numbers stay finite."""
    holding = Holding()
    rng = np.random.default_rng(4)
    heard = sorted(holding.flight.server.message_handlers())
    commands = sorted(holding.flight.server.command_handlers())
    floats = np.array([nan, inf, -1.0, 0.0, 1.0, 2.0, 4.0, 8.5, 47.4, 500.0, 1e6])

    def content(kind):
        """Random values of each field's type; every second float is one that means something."""
        fields = {}
        for name, value in kind.unpack(rng.bytes(kind.size))._asdict().items():
            is_random = rng.integers(2) == 0
            fields[name] = value if is_random or not isinstance(value, float) else float(rng.choice(floats))
        if "command" in fields:
            fields["command"] = int(rng.choice(commands))
        return fields | {name: 1 for name in ("target_system", "target_component") if name in fields}

    def disturb():
        kind = known_type(str(rng.choice(heard)))
        holding.station.write(frame_bytes(kind, kind.pack(**content(kind)), 0, *STATION))

    holding.run(60.0, disturb)
    holding.station.mav.command_long_send(1, 1, 31_000, 0, *[0.0] * 7)
    holding.run(0.1)
    assert holding.station.take("COMMAND_ACK")[-1].result == UNSUPPORTED
    estimate = holding.flight.controller.state.estimate
    assert np.isfinite([*estimate.pos_ned, *estimate.vel_ned, *estimate.q_ned_from_frd]).all()
    assert np.isfinite(holding.body["pos_ned"]).all()
    history = holding.flight.close()
    assert np.isfinite(history.pos_ned_true).all()
