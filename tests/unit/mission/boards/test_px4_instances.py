"""Several PX4s at once: each flight has its own ports, and nobody hears or moves another's vehicle."""

from contextlib import ExitStack, closing

import pytest

from autopilot.mavlink.transport.links import LinkRole, UdpLink
from autopilot.mavlink.wire.codec import FrameReader
from sim.boards.outside import PeerError
from tests.unit.mission.boards.px4_pilot import Px4, flight_of
from tests.unit.sim.boards.flown_by import running

STARTS_NE_M = {7: (0.0, 0.0), 8: (20.0, 0.0), 9: (0.0, -30.0)}  # of instances whose ports no other test uses
ARMED = (7, 9)
FRAMES = 60


@pytest.fixture(scope="module")
def three():
    px4s, flights, companions = {}, {}, {}
    with ExitStack() as held:
        for i, start_ne_m in STARTS_NE_M.items():
            px4s[i] = Px4(i, control=lambda i=i: [0.01 * i] * 4)
            companions[i] = held.enter_context(closing(UdpLink(14580 + i, LinkRole.ONBOARD, local_port=14540 + i)))
            flights[i] = flight_of(i, start_ne_m=start_ne_m)
            held.enter_context(running(px4s[i].work))
            held.callback(flights[i].close)
        for count in range(FRAMES):
            for i, each in flights.items():
                each.frame()
                if count == FRAMES // 2 and i in ARMED:
                    each.drone.ask("COMMAND_LONG", command=400, param1=1.0)
        yield px4s, flights, companions


def test_each_flies_its_own_vehicle(three):
    px4s, flights, _ = three
    for i, each in flights.items():
        assert each.end_reason == ""
        assert each.time_us == FRAMES * 20_000
        assert px4s[i].exchange.faults == []
        assert px4s[i].exchange.counts["sensor"] == 5 * FRAMES
        assert each.rig.board_commands.numpy()[0][:4] == pytest.approx([0.01 * i] * 4)


def test_each_hears_of_its_own_vehicle(three):
    _, flights, _ = three
    for i, each in flights.items():
        assert each.controller.state.estimate.pos_ned[:2] == pytest.approx(STARTS_NE_M[i], abs=0.1)


def test_each_obeys_its_own_script(three):
    px4s, flights, _ = three
    for i, each in flights.items():
        assert px4s[i].pilot.is_armed == each.controller.state.is_armed == (i in ARMED)


def test_a_companion_hears_the_one_of_its_port(three):
    for i, companion in three[2].items():
        reader = FrameReader()
        heard = {frame.sysid for data in companion.receive() for frame in reader.feed(data)}
        assert heard == {i + 1}


def test_an_instance_that_flies_already_is_refused_with_its_port(three):
    with pytest.raises(PeerError, match="TCP port 4568 for PX4 is in use"):
        flight_of(8)
