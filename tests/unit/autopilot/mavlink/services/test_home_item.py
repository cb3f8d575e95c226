import pytest

from autopilot.interface.client_requests import SetCurrentItem, StartMission
from autopilot.interface.item_lists import ItemRefusal, ListKind, MissionItem
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.services.home_item import with_home, without_home
from tests.unit.autopilot.mavlink.rig import Rig, flying_state, texts

WAYPOINT, JUMP = 16, 177


def item(seq: int, command: int = WAYPOINT, p1: float = 0.0) -> MissionItem:
    return MissionItem(seq, 3, command, (p1, 0.0, 0.0, 0.0), 47.4, 8.5, 20.0)


def upload(rig: Rig, items: list[MissionItem], **options):
    """Uploads as a client does; returns the acknowledgement."""
    (ack,) = [message.fields for message in answers(rig, items, **options) if message.name == "MISSION_ACK"]
    return ack


def answers(rig: Rig, items: list[MissionItem], kind: ListKind = ListKind.MISSION, *, in_integers: bool = True):
    """Uploads as a client does that knows MISSION_REQUEST alone; returns the messages that answer the last item."""
    rig.client.send("MISSION_COUNT", count=len(items), mission_type=kind)
    for sent in items:
        request = rig.only("MISSION_REQUEST")
        assert (request.seq, request.mission_type) == (sent.seq, kind)
        rig.client.send(
            "MISSION_ITEM_INT" if in_integers else "MISSION_ITEM",
            seq=sent.seq,
            frame=sent.frame,
            command=sent.command,
            param1=sent.params[0],
            x=int(sent.x * 1e7) if in_integers else sent.x,
            y=int(sent.y * 1e7) if in_integers else sent.y,
            z=sent.z,
            mission_type=kind,
        )
    return rig.frame()


def test_home_comes_first_and_jumps_go_to_the_same_items():
    state = flying_state()
    shown = with_home([item(0), item(1), item(2, JUMP, 1.0)], state)
    assert [each.seq for each in shown] == [0, 1, 2, 3]
    assert (shown[0].frame, shown[0].command, shown[0].x, shown[0].z) == (0, WAYPOINT, state.home.lat_deg, 488.0)
    assert shown[3].params[0] == 2.0
    assert without_home(shown) == [item(0), item(1), item(2, JUMP, 1.0)]


def test_empty_mission_stays_empty():
    assert with_home([], flying_state()) == []
    assert without_home([]) == []


def test_upload_leaves_home_out():
    rig = Rig(dialect=ARDUPILOT)
    assert upload(rig, [item(0), item(1), item(2, JUMP, 1.0)]).type == 0
    stored = rig.vehicle.lists.items(ListKind.MISSION)
    assert [each.seq for each in stored] == [0, 1]
    assert stored[1].params[0] == 0.0


@pytest.mark.parametrize("in_integers", [False, True])
@pytest.mark.parametrize("kind", ListKind)
def test_every_list_is_asked_for_by_the_message_that_ardupilots_clients_know(kind, in_integers):
    rig = Rig(dialect=ARDUPILOT)
    assert upload(rig, [item(0), item(1), item(2)], kind=kind, in_integers=in_integers).type == 0
    stored = rig.vehicle.lists.items(kind)
    assert len(stored) == (2 if kind is ListKind.MISSION else 3)
    assert stored[0].x == pytest.approx(47.4, abs=1e-5)


@pytest.mark.parametrize("kind", ListKind)
def test_px4s_clients_are_asked_in_integers(kind):
    rig = Rig(dialect=PX4)
    rig.client.send("MISSION_COUNT", count=1, mission_type=kind)
    assert rig.only("MISSION_REQUEST_INT").mission_type == kind


def test_home_is_served_although_the_mission_is_empty():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("MISSION_REQUEST_LIST")
    assert rig.only("MISSION_COUNT").count == 0
    rig.client.send("MISSION_REQUEST", seq=0)
    home = rig.only("MISSION_ITEM")
    assert (home.seq, home.frame, home.command, home.z) == (0, 0, WAYPOINT, 488.0)
    assert home.x == pytest.approx(47.397742, abs=1e-5)
    rig.client.send("MISSION_REQUEST", seq=1)
    assert rig.only("MISSION_ACK").type == 13  # MAV_MISSION_INVALID_SEQUENCE
    rig.client.send("MISSION_REQUEST_INT", seq=0, mission_type=1)
    assert rig.only("MISSION_ACK").type == 13


def test_upload_of_home_alone_clears():
    rig = Rig(dialect=ARDUPILOT)
    upload(rig, [item(0), item(1)])
    assert upload(rig, [item(0)]).type == 0
    assert list(rig.vehicle.lists.items(ListKind.MISSION)) == []


def test_download_has_home_as_item_0():
    rig = Rig(dialect=ARDUPILOT)
    upload(rig, [item(0), item(1)])
    rig.client.send("MISSION_REQUEST_LIST")
    assert rig.only("MISSION_COUNT").count == 2
    rig.client.send("MISSION_REQUEST_INT", seq=0)
    home = rig.only("MISSION_ITEM_INT")
    assert (home.seq, home.x, home.z) == (0, 473_977_420, 488.0)
    rig.client.send("MISSION_REQUEST_INT", seq=1)
    assert rig.only("MISSION_ITEM_INT").x == 474_000_000


def test_numbers_of_current_and_reached_items_count_home():
    rig = Rig(dialect=ARDUPILOT)
    rig.update(mission_count=3, mission_current=1)
    rig.client.command(512, 42.0)
    current = rig.all("MISSION_CURRENT")[-1]
    assert (current.seq, current.total) == (2, 3)
    rig.server.mission_item_reached(1)
    assert rig.only("MISSION_ITEM_REACHED").seq == 2


def test_current_item_is_set_by_the_clients_number():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("MISSION_SET_CURRENT", seq=2)
    rig.frame()
    rig.ack(224, 1.0)
    rig.ack(300, 0.0, 0.0)
    assert rig.vehicle.calls == [SetCurrentItem(1), SetCurrentItem(0), StartMission(-1, -1)]


def test_refused_item_is_named_by_the_clients_number():
    rig = Rig(dialect=ARDUPILOT)
    rig.vehicle.stored[ListKind.MISSION].refusal = ItemRefusal(1, 3, "no such command")
    rig.client.send("MISSION_COUNT", count=3)
    for seq in range(3):
        rig.frame()
        rig.client.send("MISSION_ITEM_INT", seq=seq, frame=3, command=WAYPOINT)
    messages = rig.frame()
    assert [message.fields.type for message in messages if message.name == "MISSION_ACK"] == [3]
    assert texts(messages) == ["Mission: item 2: no such command"]


@pytest.mark.parametrize("dialect", [PX4, ARDUPILOT], ids=lambda dialect: dialect.name)
def test_texts_count_items_from_1_in_both_dialects(dialect):
    rig = Rig(dialect=dialect)
    rig.vehicle.stored[ListKind.MISSION].refusal = ItemRefusal(1, 13, "jump to item 8 is not possible")
    count = 2 + dialect.first_seq  # home is not counted
    rig.client.send("MISSION_COUNT", count=count)
    for seq in range(count):
        rig.frame()
        rig.client.send("MISSION_ITEM_INT", seq=seq, frame=3, command=WAYPOINT)
    assert texts(rig.frame()) == ["Mission: item 2: jump to item 8 is not possible"]
    rig.client.send("MISSION_REQUEST_INT", seq=9 + dialect.first_seq)
    assert texts(rig.frame()) == ["Mission: there is no item 10"]


def test_the_current_item_of_no_mission_is_0():
    rig = Rig(dialect=ARDUPILOT)
    rig.frame(2)
    rig.update(mission_count=0, mission_current=0)
    rig.server.mission_current_changed(0)
    assert [each.seq for each in rig.all("MISSION_CURRENT", 60)] == [0, 0]
