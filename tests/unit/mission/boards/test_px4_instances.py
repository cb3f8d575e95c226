"""Several PX4s at once: each flight has its own ports, and nobody hears or moves another's vehicle."""

from contextlib import ExitStack, closing

import pytest

from autopilot.mavlink.transport.links import LinkRole, UdpLink
from autopilot.mavlink.wire.codec import FrameReader
from bench.standins.px4 import Px4StandIn
from bench.standins.px4_links import Px4Links
from mission.boards.board_flight import BoardFlight
from mission.boards.peers import PEERS
from mission.flight_config import FlightConfig
from sim.boards.outside import PeerError, wait_for
from tests.unit.sim.boards.flown_by import running

PEER = PEERS["px4"]
STARTS_NE_M = {7: (0.0, 0.0), 8: (20.0, 0.0), 9: (0.0, -30.0)}  # of instances whose ports no other test uses
FRAMES = 60


def flight(instance):
    config = FlightConfig(start_ne_m=STARTS_NE_M[instance])
    return BoardFlight(config, PEER, wait_for(5.0, "PX4"), instance=instance)


def flown(instance, links, made):
    """A PX4 that holds its motors at a command of its own until the simulator has gone."""

    def control(px4):
        links.frame(px4)
        return [0.01 * (instance + 1)] * 4

    def work():
        with closing(Px4StandIn(4560 + instance, control, system_id=instance + 1)) as px4:
            made[instance] = px4
            while px4.step():
                pass

    return running(work)


@pytest.fixture(scope="module")
def three():
    made, links, flights, companions = {}, {}, {}, {}
    with ExitStack() as held:
        for i in STARTS_NE_M:
            links[i] = held.enter_context(closing(Px4Links(i)))
            companions[i] = held.enter_context(closing(UdpLink(14580 + i, LinkRole.ONBOARD, local_port=14540 + i)))
            flights[i] = flight(i)
            held.enter_context(flown(i, links[i], made))
            held.callback(flights[i].close)
        for count in range(FRAMES):
            for i, each in flights.items():
                each.frame()
                if count == FRAMES // 2:
                    each.drone.ask("COMMAND_LONG", command=400, param1=1.0, param2=float(i))
        yield flights, links, made, companions


def test_each_flies_its_own_vehicle(three):
    flights, _, made, _ = three
    for i, each in flights.items():
        assert each.end_reason == ""
        assert each.time_us == FRAMES * 20_000
        assert made[i].faults == []
        assert made[i].counts["answers"] == made[i].counts["sensor"] == 5 * FRAMES
        assert each.rig.board_commands.numpy()[0][:4] == pytest.approx([0.01 * (i + 1)] * 4)


def test_each_hears_of_its_own_vehicle(three):
    flights, _, _, _ = three
    for i, each in flights.items():
        assert each.controller.state.estimate.pos_ned[:2] == pytest.approx(STARTS_NE_M[i], abs=0.05)
        assert each.controller.state.is_armed


def test_each_obeys_its_own_script(three):
    _, links, _, _ = three
    for i, link in links.items():
        assert [message.param2 for message in link.commands if message.command == 400] == [float(i)]
        assert link.strays == []


def test_a_companion_hears_the_one_of_its_port(three):
    for i, companion in three[3].items():
        reader = FrameReader()
        heard = {frame.sysid for data in companion.receive() for frame in reader.feed(data)}
        assert heard == {i + 1}


def test_an_instance_that_flies_already_is_refused_with_its_port(three):
    with pytest.raises(PeerError, match="TCP port 4568 for PX4 is in use"):
        flight(8)
