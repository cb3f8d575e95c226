from math import isnan

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import SetCurrentItem
from autopilot.interface.item_lists import ItemRefusal, ListKind, MissionItem
from autopilot.interface.vehicle_state import FenceLimit, FenceState, Reply, Verdict
from autopilot.mavlink.services.mission_protocol import DOWNLOAD_IDLE_US, RETRIES_MAX
from autopilot.mavlink.wire.item_messages import item_from_fields, scaled_position
from autopilot.navigator.mission.item_commands import MAX_ITEMS
from tests.unit.autopilot.mavlink.rig import FRAME_US, Client, Rig, texts

MISSION, FENCE, RALLY = ListKind
ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
OLD_PLAN = [MissionItem(0, 6, 16, (0.0, 1.0, 0.0, 0.0), 47.0, 8.0, 10.0)]
PLAN = [
    MissionItem(0, 6, 22, (0.0, 0.0, 0.0, 0.0), 47.397742, 8.545594, 10.0),
    MissionItem(1, 6, 16, (1.0, 2.0, 0.0, 0.5), 47.398, 8.546, 20.0, autocontinue=False),
    MissionItem(2, 2, 20, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0),
]
FRAMES_PER_RETRY = 1_500_000 // FRAME_US


def send_item(client: Client, item: MissionItem, **changes: float) -> None:
    x, y = scaled_position(item)
    fields = {f"param{i + 1}": value for i, value in enumerate(item.params)}
    fields |= {"seq": item.seq, "frame": item.frame, "command": item.command, "x": x, "y": y, "z": item.z}
    client.send("MISSION_ITEM_INT", target_component=1, autocontinue=int(item.autocontinue), **(fields | changes))


def start(rig: Rig, count: int, kind: ListKind = MISSION) -> None:
    rig.client.send("MISSION_COUNT", target_component=1, count=count, mission_type=kind)
    assert rig.only("MISSION_REQUEST_INT")[2:] == (0, kind)


def upload(rig: Rig, plan: list[MissionItem], kind: ListKind = MISSION) -> int:
    """The result of a whole upload."""
    start(rig, len(plan), kind)
    for item in plan[:-1]:
        send_item(rig.client, item, mission_type=kind)
        assert rig.only("MISSION_REQUEST_INT")[2:] == (item.seq + 1, kind)
    send_item(rig.client, plan[-1], mission_type=kind)
    ack = rig.only("MISSION_ACK")
    assert (ack.target_system, ack.target_component, ack.mission_type) == (255, 190, kind)
    return int(ack.type)


def download(rig: Rig, kind: ListKind = MISSION) -> list[MissionItem]:
    rig.client.send("MISSION_REQUEST_LIST", target_component=1, mission_type=kind)
    answer = rig.only("MISSION_COUNT")
    assert answer.mission_type == kind
    items = []
    for seq in range(answer.count):
        rig.client.send("MISSION_REQUEST_INT", target_component=1, seq=seq, mission_type=kind)
        answer = rig.only("MISSION_ITEM_INT")
        assert answer.mission_type == kind
        items.append(item_from_fields(answer))
    rig.client.send("MISSION_ACK", target_component=1, type=ACCEPTED, mission_type=kind)
    return items


@pytest.mark.parametrize("kind", list(ListKind))
def test_list_comes_back_as_it_was_sent(kind):
    rig = Rig()
    assert upload(rig, PLAN, kind) == ACCEPTED
    assert rig.vehicle.stored[kind].items == PLAN
    assert download(rig, kind) == PLAN
    for other in set(ListKind) - {kind}:
        assert download(rig, other) == []


def test_refused_item_leaves_the_old_plan_and_is_named():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    rig.vehicle.stored[MISSION].refusal = ItemRefusal(1, mavlink.MAV_MISSION_UNSUPPORTED, "command 93 is not supported")
    start(rig, 1)
    send_item(rig.client, PLAN[0])
    messages = rig.frame()
    assert [m.fields.type for m in messages if m.name == "MISSION_ACK"] == [mavlink.MAV_MISSION_UNSUPPORTED]
    assert texts(messages) == ["Mission: item 2: command 93 is not supported"]
    assert rig.vehicle.stored[MISSION].items == OLD_PLAN


def test_infinite_number_is_refused_by_its_place():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    for i, field in enumerate(("param1", "param2", "param3", "param4", None, None, "z")):
        if field:
            start(rig, 1)
            send_item(rig.client, PLAN[0], **{field: float("inf")})
            assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_INVALID_PARAM1 + i
    assert rig.vehicle.stored[MISSION].items == OLD_PLAN


def test_unfinished_upload_leaves_the_old_plan():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    start(rig, 3)
    send_item(rig.client, PLAN[0])
    rig.frame()
    assert download(rig) == OLD_PLAN


def test_item_that_does_not_come_is_asked_for_again_and_then_given_up():
    rig = Rig()
    start(rig, 3)
    send_item(rig.client, PLAN[0])
    assert rig.only("MISSION_REQUEST_INT").seq == 1
    for _ in range(RETRIES_MAX):
        assert rig.all("MISSION_REQUEST_INT", FRAMES_PER_RETRY - 1) == []
        assert rig.only("MISSION_REQUEST_INT").seq == 1
    assert rig.only("MISSION_ACK", FRAMES_PER_RETRY).type == mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert rig.all("MISSION_REQUEST_INT", 5 * FRAMES_PER_RETRY) == []


def test_upload_over_a_lossy_link_succeeds():
    rig = Rig()
    start(rig, 3)
    for item in PLAN:
        rig.frame(FRAMES_PER_RETRY)  # the first answer was lost: the item is asked for again
        send_item(rig.client, item)
    rig.frame(2)
    assert rig.vehicle.stored[MISSION].items == PLAN


def test_repeated_item_is_not_appended():
    rig = Rig()
    start(rig, 3)
    for item in (PLAN[0], PLAN[0], PLAN[1], PLAN[0], PLAN[1], PLAN[2]):
        send_item(rig.client, item)
    assert rig.only("MISSION_ACK").type == ACCEPTED
    assert rig.vehicle.stored[MISSION].items == PLAN


def test_last_item_again_gets_the_same_answer_again():
    rig = Rig()
    upload(rig, PLAN)
    send_item(rig.client, PLAN[2])
    assert rig.only("MISSION_ACK").type == ACCEPTED


def test_item_out_of_sequence_ends_the_upload():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    start(rig, 3)
    send_item(rig.client, PLAN[2])
    assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_INVALID_SEQUENCE
    send_item(rig.client, PLAN[0])
    assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_INVALID_SEQUENCE
    assert rig.vehicle.stored[MISSION].items == OLD_PLAN


def test_second_uploader_is_denied_and_the_first_finishes():
    rig = Rig()
    start(rig, 3)
    rig.second_client.send("MISSION_COUNT", target_component=1, count=1)
    send_item(rig.second_client, PLAN[0])
    rig.frame()
    acks = [message.fields.type for message in rig.second_client.received() if message.name == "MISSION_ACK"]
    assert acks == [mavlink.MAV_MISSION_DENIED] * 2
    for item in PLAN:
        send_item(rig.client, item)
    assert rig.only("MISSION_ACK").type == ACCEPTED


def test_new_count_of_the_same_client_starts_again():
    rig = Rig()
    start(rig, 3)
    send_item(rig.client, OLD_PLAN[0])
    rig.frame()
    assert upload(rig, PLAN) == ACCEPTED
    assert rig.vehicle.stored[MISSION].items == PLAN


def test_client_can_give_up_its_upload():
    rig = Rig()
    start(rig, 3)
    rig.client.send("MISSION_ACK", target_component=1, type=mavlink.MAV_MISSION_OPERATION_CANCELLED)
    assert rig.all("MISSION_REQUEST_INT", 3 * FRAMES_PER_RETRY) == []


def test_count_0_and_clear_both_clear():
    rig = Rig()
    for request in (
        ("MISSION_COUNT", {"count": 0}),
        ("MISSION_CLEAR_ALL", {}),
        ("MISSION_CLEAR_ALL", {"mission_type": 255}),
    ):
        rig.vehicle.stored[MISSION].items = OLD_PLAN
        rig.client.send(request[0], target_component=1, **request[1])
        assert rig.only("MISSION_ACK").type == ACCEPTED
        assert rig.vehicle.stored[MISSION].items == []


def test_plan_may_not_be_cleared_while_another_is_uploaded():
    rig = Rig()
    start(rig, 3)
    rig.second_client.send("MISSION_CLEAR_ALL", target_component=1)
    rig.frame()
    (ack,) = [m.fields for m in rig.second_client.received() if m.name == "MISSION_ACK"]
    assert ack.type == mavlink.MAV_MISSION_DENIED


def test_clearing_gives_up_an_upload_of_ones_own():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    start(rig, 3)
    send_item(rig.client, PLAN[0])
    rig.frame()
    rig.client.send("MISSION_CLEAR_ALL", target_component=1)
    assert rig.only("MISSION_ACK").type == ACCEPTED
    assert rig.vehicle.stored[MISSION].items == []
    assert rig.all("MISSION_REQUEST_INT", 2 * FRAMES_PER_RETRY) == []
    assert upload(rig, PLAN) == ACCEPTED


@pytest.mark.parametrize("count", [MAX_ITEMS + 1, 65_535])
def test_more_items_than_the_navigator_takes_are_refused_before_they_are_sent(count):
    rig = Rig()
    rig.client.send("MISSION_COUNT", target_component=1, count=count)
    assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_NO_SPACE
    start(rig, MAX_ITEMS)


@pytest.mark.parametrize("kind", [FENCE, RALLY])
def test_each_list_is_cleared_alone_or_all_at_once(kind):
    rig = Rig()
    of_kind = {"target_component": 1, "mission_type": kind}
    for request, cleared in (
        (("MISSION_COUNT", of_kind), {kind}),
        (("MISSION_CLEAR_ALL", of_kind), {kind}),
        (("MISSION_CLEAR_ALL", {"target_component": 1, "mission_type": 255}), set(ListKind)),
    ):
        for stored in rig.vehicle.stored.values():
            stored.items = OLD_PLAN
        rig.client.send(request[0], **request[1])
        assert rig.only("MISSION_ACK")[2:] == (ACCEPTED, request[1]["mission_type"])
        assert {k for k in ListKind if not rig.vehicle.stored[k].items} == cleared


def test_two_clients_upload_different_lists_at_the_same_time():
    rig = Rig()
    start(rig, 1)
    rig.second_client.send("MISSION_COUNT", target_component=1, count=1, mission_type=FENCE)
    send_item(rig.second_client, PLAN[0], mission_type=FENCE)
    send_item(rig.client, PLAN[0])
    rig.frame()
    assert rig.vehicle.stored[FENCE].items == rig.vehicle.stored[MISSION].items == [PLAN[0]]


def test_refusal_of_a_fence_names_the_fence():
    rig = Rig()
    rig.vehicle.stored[FENCE].refusal = ItemRefusal(0, mavlink.MAV_MISSION_INVALID, "the polygon crosses itself")
    start(rig, 1, FENCE)
    send_item(rig.client, PLAN[0], mission_type=FENCE)
    messages = rig.frame()
    assert [m.fields[2:] for m in messages if m.name == "MISSION_ACK"] == [(mavlink.MAV_MISSION_INVALID, FENCE)]
    assert texts(messages) == ["Fence: item 1: the polygon crosses itself"]


def test_listeners_hear_of_a_new_list_and_not_of_a_refused_one():
    rig = Rig()
    heard = []
    rig.vehicle.lists.on_change(heard.append)
    upload(rig, PLAN, RALLY)
    rig.vehicle.stored[FENCE].refusal = ItemRefusal(0, mavlink.MAV_MISSION_INVALID, "no")
    upload(rig, PLAN, FENCE)
    rig.client.send("MISSION_CLEAR_ALL", target_component=1)
    rig.frame()
    assert heard == [RALLY, MISSION]


def test_list_that_does_not_exist_is_refused():
    rig = Rig()
    for name in ("MISSION_REQUEST_LIST", "MISSION_CLEAR_ALL", "MISSION_COUNT"):
        rig.client.send(name, target_component=1, mission_type=77)
        assert rig.only("MISSION_ACK")[2:] == (mavlink.MAV_MISSION_UNSUPPORTED, 77)


def test_part_of_a_stored_list_is_replaced():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = PLAN
    changed = MissionItem(1, 6, 16, (0.0,) * 4, 47.399, 8.547, 30.0)
    rig.client.send("MISSION_WRITE_PARTIAL_LIST", target_component=1, start_index=1, end_index=1)
    assert rig.only("MISSION_REQUEST_INT").seq == 1
    send_item(rig.client, changed)
    assert rig.only("MISSION_ACK").type == ACCEPTED
    assert rig.vehicle.stored[MISSION].items == [PLAN[0], changed, PLAN[2]]


@pytest.mark.parametrize(("first", "last"), [(0, 3), (-1, 1), (2, 1)])
def test_part_that_is_not_in_the_list_is_refused(first, last):
    rig = Rig()
    rig.vehicle.stored[MISSION].items = PLAN
    rig.client.send("MISSION_WRITE_PARTIAL_LIST", target_component=1, start_index=first, end_index=last)
    assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_INVALID_SEQUENCE
    assert rig.vehicle.stored[MISSION].items == PLAN


def test_part_of_a_list_is_not_read_at_once():
    rig = Rig()
    rig.client.send("MISSION_REQUEST_PARTIAL_LIST", target_component=1, start_index=0, end_index=1)
    assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_UNSUPPORTED


def test_download_without_a_final_ack_ends_by_itself():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    rig.client.send("MISSION_REQUEST_LIST", target_component=1)
    rig.frame()
    rig.vehicle.stored[MISSION].items = PLAN
    rig.frame(DOWNLOAD_IDLE_US // FRAME_US + 1)
    rig.client.send("MISSION_REQUEST_INT", target_component=1, seq=2)
    assert item_from_fields(rig.only("MISSION_ITEM_INT")) == PLAN[2]


def test_items_are_served_in_any_order_and_repeatedly():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = PLAN
    for seq in (2, 0, 2, 1):
        rig.client.send("MISSION_REQUEST_INT", target_component=1, seq=seq)
        assert rig.only("MISSION_ITEM_INT").seq == seq
    rig.client.send("MISSION_REQUEST_INT", target_component=1, seq=3)
    assert rig.only("MISSION_ACK").type == mavlink.MAV_MISSION_INVALID_SEQUENCE


def test_download_is_not_torn_by_an_upload():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = OLD_PLAN
    rig.client.send("MISSION_REQUEST_LIST", target_component=1)
    rig.frame()
    rig.vehicle.stored[MISSION].items = PLAN
    rig.client.send("MISSION_REQUEST_INT", target_component=1, seq=0)
    assert item_from_fields(rig.only("MISSION_ITEM_INT")) == OLD_PLAN[0]
    assert download(rig) == PLAN


def test_float_items_are_still_served_and_taken():
    rig = Rig()
    rig.vehicle.stored[MISSION].items = PLAN
    rig.client.send("MISSION_REQUEST", target_component=1, seq=1)
    item = rig.only("MISSION_ITEM")
    assert (item.x, item.z) == (pytest.approx(47.398, abs=1e-5), 20.0)
    start(rig, 1)
    rig.client.send("MISSION_ITEM", **(item._asdict() | {"seq": 0, "target_system": 1, "target_component": 1}))
    assert rig.only("MISSION_ACK").type == ACCEPTED
    assert rig.vehicle.stored[MISSION].items[0].x == pytest.approx(47.398, abs=1e-5)


def test_positions_are_scaled_by_their_frame():
    local = MissionItem(0, 1, 16, (0.0,) * 4, 12.5, -3.25, -10.0)
    assert scaled_position(local) == (125_000, -32_500)
    assert scaled_position(MissionItem(0, 2, 177, (0.0,) * 4, 3.0, 4.0, 0.0)) == (3, 4)
    unset = MissionItem(0, 6, 16, (0.0,) * 4, float("nan"), float("nan"), 0.0)
    assert scaled_position(unset) == (2**31 - 1, 2**31 - 1)


def test_unset_position_is_nan():
    rig = Rig()
    start(rig, 1)
    send_item(rig.client, PLAN[0], x=2**31 - 1, y=2**31 - 1)
    rig.frame()
    assert isnan(rig.vehicle.stored[MISSION].items[0].x)


def test_set_current_is_answered_by_the_current_item():
    rig = Rig()
    rig.frame(2)
    rig.client.send("MISSION_SET_CURRENT", target_component=1, seq=1)
    assert len(rig.all("MISSION_CURRENT")) == 1
    assert rig.vehicle.calls == [SetCurrentItem(1)]
    rig.vehicle.reply = Reply(Verdict.DENIED, "there is no item 9")
    rig.client.send("MISSION_SET_CURRENT", target_component=1, seq=9)
    assert texts(rig.frame()) == ["Mission: there is no item 9"]


def test_fence_is_switched_by_command():
    rig = Rig()
    for params, call in (
        ((1.0,), ("enable", 15)),
        ((0.0, 0.0), ("disable", 15)),
        ((1.0, 4.0), ("enable", 4)),
        ((2.0,), ("disable", 8)),
    ):
        assert rig.ack(mavlink.MAV_CMD_DO_FENCE_ENABLE, *params).result == 0
        assert rig.vehicle.calls[-1] == call
    for params in ((3.0,), (1.0, 16.0), ()):
        assert rig.ack(mavlink.MAV_CMD_DO_FENCE_ENABLE, *params).result == mavlink.MAV_RESULT_DENIED


def test_breached_fence_is_reported():
    rig = Rig()
    geofence = mavlink.MAV_SYS_STATUS_GEOFENCE
    for fence, is_enabled, is_healthy, kind in (
        (FenceState(), False, True, mavlink.FENCE_BREACH_NONE),
        (FenceState(is_active=True), True, True, mavlink.FENCE_BREACH_NONE),
        (FenceState(True, FenceLimit.CEILING, FenceLimit.CEILING, 1, 4_000_000), True, False, 2),
        (FenceState(True, 0, FenceLimit.SHAPES, 2, 4_000_000), True, True, mavlink.FENCE_BREACH_BOUNDARY),
    ):
        rig.update(fence=fence)
        rig.client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 1)
        rig.client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 162)
        messages = rig.frame()
        status = next(m.fields for m in messages if m.name == "SYS_STATUS")
        assert bool(status.onboard_control_sensors_enabled & geofence) is is_enabled
        assert bool(status.onboard_control_sensors_health & geofence) is is_healthy
        answer = next(m.fields for m in messages if m.name == "FENCE_STATUS")
        assert (answer.breach_status, answer.breach_count) == (int(fence.breached != 0), fence.breach_count)
        assert answer.breach_type == kind
        assert answer.breach_time == fence.breach_time_us // 1000
