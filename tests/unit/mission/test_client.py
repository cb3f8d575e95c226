"""The protocol half of the scripting client, against a peer that says what the test tells it to."""

from math import nan

import pytest

from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from common.kernels import FRAME_US
from mission.client import (
    Client,
    CommandRefused,
    MissionRefused,
    Running,
    ScriptError,
    ScriptTimeout,
    next_frame,
)
from mission.client_fields import parameter_from_wire, parameter_to_wire
from mission.plan.plan_file import PlanItem

ARM = 400
ACK_DENIED, ACK_IN_PROGRESS = 2, 5
REAL32, INT32 = 9, 6


class Peer:
    """A vehicle's end of a link; `answer` is asked for each message of the client's."""

    def __init__(self):
        self.link, client_end = memory_pair()
        self.client = Client(client_end)
        self.heard = []
        self.answer = lambda _: None
        self.time_us = 0
        self._reader = FrameReader()

    def say(self, name, sysid=1, **fields):
        self.link.send(encode(name, sysid, 1, 0, **fields))

    def frame(self):
        self.time_us += FRAME_US
        self.client.frame(self.time_us)
        for data in self.link.receive():
            for frame in self._reader.feed(data):
                message = decode(frame)
                self.heard.append(message)
                self.answer(message)

    def run(self, script, seconds=60.0):
        """Runs a script to its end; returns its result or raises its error."""
        running = self.client.start(script)
        for _ in range(round(seconds * 50)):
            self.frame()
            if running.is_done:
                if running.error is not None:
                    raise running.error
                return running.result
        raise AssertionError("the script does not end")

    def of(self, name):
        """Fields of the messages of a kind that have been heard."""
        return [message.fields for message in self.heard if message.name == name]


@pytest.fixture
def peer():
    return Peer()


def ack(command, result=0):
    return {
        "command": command, "result": result, "progress": 0, "result_param2": 0,
        "target_system": 245, "target_component": 190,
    }  # fmt: skip


def text(words, text_id=0, chunk=0):
    return {"severity": 4, "text": words.encode(), "id": text_id, "chunk_seq": chunk}


def test_a_script_returns_its_result(peer):
    async def script():
        await peer.client.sleep(1.0)
        return 42

    assert peer.run(script()) == 42
    assert peer.time_us == pytest.approx(1_000_000, abs=2 * FRAME_US)


def test_an_error_of_the_script_ends_it():
    async def script():
        await next_frame()
        raise ScriptError("no way")

    running = Running(script())
    running.step()
    assert not running.is_done
    running.step()
    assert running.is_done
    assert str(running.error) == "no way"
    running.step()


def test_a_bug_stops_the_flight(peer):
    async def script():
        await next_frame()
        return 1 / 0

    with pytest.raises(ZeroDivisionError):
        peer.run(script())


def test_a_cancelled_script_has_not_succeeded(peer):
    running = Running(peer.client.sleep(10.0))
    running.step()
    running.cancel()
    assert running.is_done
    assert isinstance(running.error, ScriptError)


def test_cancelling_a_finished_script_changes_nothing(peer):
    running = Running(peer.client.sleep(0.0))
    running.step()
    running.cancel()
    assert running.is_done
    assert running.error is None


def test_waiting_ends_by_the_vehicles_clock(peer):
    with pytest.raises(ScriptTimeout, match=r"^rain: nothing within 3 s$"):
        peer.run(peer.client.until(lambda: False, 3.0, "rain"))
    assert peer.time_us == pytest.approx(3_000_000, abs=2 * FRAME_US)


def test_two_scripts_run_side_by_side(peer):
    order = []

    async def script(name, seconds):
        await peer.client.sleep(seconds)
        order.append(name)

    peer.client.start(script("slow", 2.0))
    peer.client.start(script("fast", 1.0))
    for _ in range(150):
        peer.frame()
    assert order == ["fast", "slow"]


def test_heartbeats_come_once_a_second(peer):
    peer.run(peer.client.sleep(5.0))
    assert 5 <= len(peer.of("HEARTBEAT")) <= 6


def test_messages_of_other_systems_are_ignored(peer):
    peer.say("ATTITUDE", sysid=7, roll=1.0)
    peer.frame()
    assert peer.client.latest("ATTITUDE") is None
    peer.say("ATTITUDE", roll=0.5)
    peer.frame()
    assert peer.client.latest("ATTITUDE").roll == 0.5


def test_an_inbox_collects_its_messages_in_order_while_it_is_open(peer):
    with peer.client.subscribe("ATTITUDE", "VFR_HUD") as inbox:
        for roll in (0.1, 0.2):
            peer.say("ATTITUDE", roll=roll)
        peer.say("SYSTEM_TIME")
        peer.frame()
        rolls = [peer.run(inbox.next(1.0, "attitude")).roll for _ in range(2)]
        assert rolls == pytest.approx([0.1, 0.2])
        with pytest.raises(ScriptTimeout, match="attitude"):
            peer.run(inbox.next(1.0, "attitude"))
    peer.say("ATTITUDE")
    peer.frame()
    with pytest.raises(ScriptTimeout):
        peer.run(inbox.next(0.1, "attitude"))


def test_a_long_text_is_put_together(peer):
    peer.say("STATUSTEXT", **text("a" * 50, 3, 0))
    peer.say("STATUSTEXT", **text("bcd", 3, 1))
    peer.say("STATUSTEXT", **text("short"))
    peer.say("STATUSTEXT", **text("lost its start", 4, 1))
    peer.frame()
    assert peer.client.texts == ["a" * 50 + "bcd", "short", "lost its start"]


def test_an_accepted_command_returns_its_acknowledgement(peer):
    peer.answer = lambda message: message.name == "COMMAND_LONG" and peer.say("COMMAND_ACK", **ack(ARM))
    assert peer.run(peer.client.command(ARM, 1.0)).command == ARM
    (sent,) = peer.of("COMMAND_LONG")
    assert (sent.target_system, sent.param1, sent.param7, sent.confirmation) == (1, 1.0, 0.0, 0)


def test_a_refused_command_carries_result_and_reason(peer):
    def answer(message):
        if message.name == "COMMAND_LONG":
            peer.say("COMMAND_ACK", **ack(ARM, ACK_DENIED))
            peer.say("STATUSTEXT", **text("Arm: no GNSS fix"))

    peer.say("STATUSTEXT", **text("an old text"))
    peer.frame()
    peer.answer = answer
    with pytest.raises(CommandRefused, match=r"^arm refused \(result 2\): Arm: no GNSS fix$") as refused:
        peer.run(peer.client.command(ARM, 1.0, name="arm"))
    assert refused.value.result == ACK_DENIED
    assert refused.value.reason == "Arm: no GNSS fix"


def test_a_command_is_sent_three_times_before_it_is_given_up(peer):
    with pytest.raises(ScriptTimeout, match="arm: no answer after 3 tries"):
        peer.run(peer.client.command(ARM, 1.0, name="arm"))
    assert [sent.confirmation for sent in peer.of("COMMAND_LONG")] == [0, 1, 2]


def test_any_message_can_be_addressed_to_the_vehicle():
    vehicle_end, client_end = memory_pair()
    client = Client(client_end, system_id=7)
    client.send("PARAM_REQUEST_LIST", target_system=client.system_id, target_component=1)
    (data,) = vehicle_end.receive()
    assert [decode(frame).fields.target_system for frame in FrameReader().feed(data)] == [7]


def test_progress_and_other_commands_answers_are_waited_through(peer):
    def answer(message):
        if message.name == "COMMAND_LONG":
            peer.say("COMMAND_ACK", **ack(22))
            peer.say("COMMAND_ACK", **ack(ARM, ACK_DENIED) | {"target_system": 255})  # another client's
            peer.say("COMMAND_ACK", **ack(ARM, ACK_IN_PROGRESS))
            peer.say("COMMAND_ACK", **ack(ARM))

    peer.answer = answer
    assert peer.run(peer.client.command(ARM, 1.0)).result == 0
    assert len(peer.of("COMMAND_LONG")) == 1


def test_a_command_with_a_place_keeps_its_integers(peer):
    peer.answer = lambda message: message.name == "COMMAND_INT" and peer.say("COMMAND_ACK", **ack(192))
    peer.run(peer.client.command_int(192, 6, (-1.0, 1.0, 0.0, nan), 473_977_421, 85_455_942, 12.5))
    (sent,) = peer.of("COMMAND_INT")
    assert (sent.x, sent.y, sent.z, sent.frame) == (473_977_421, 85_455_942, 12.5, 6)


def items(count):
    return [PlanItem(seq, 3, 16, (0.0, 0.0, 0.0, nan), 47.4, 8.5, 10.0 + seq) for seq in range(count)]


def test_an_upload_answers_whatever_is_asked_for(peer):
    wanted = iter([0, 0, 2, 1, 1])  # as after lost messages

    def answer(message):
        if message.name in {"MISSION_COUNT", "MISSION_ITEM_INT"}:
            seq = next(wanted, None)
            if seq is None:
                peer.say("MISSION_ACK", target_system=245, target_component=190, type=0, mission_type=0)
            else:
                peer.say("MISSION_REQUEST_INT", target_system=245, target_component=190, seq=seq, mission_type=0)

    peer.answer = answer
    peer.run(peer.client.upload(items(3)))
    assert peer.of("MISSION_COUNT")[0].count == 3
    assert [sent.seq for sent in peer.of("MISSION_ITEM_INT")] == [0, 0, 2, 1, 1]
    last = peer.of("MISSION_ITEM_INT")[-1]
    assert (last.x, last.y, last.z) == (474_000_000, 85_000_000, 11.0)


def test_a_refused_upload_carries_result_and_reason(peer):
    def answer(message):
        if message.name == "MISSION_COUNT":
            peer.say("MISSION_ACK", target_system=245, target_component=190, type=3, mission_type=0)
            peer.say("STATUSTEXT", **text("Mission: item 1: not supported"))

    peer.answer = answer
    with pytest.raises(MissionRefused, match=r"result 3\): Mission: item 1: not supported") as refused:
        peer.run(peer.client.upload(items(2)))
    assert refused.value.result == 3


def test_an_upload_that_nobody_answers_ends(peer):
    with pytest.raises(ScriptTimeout, match="mission upload"):
        peer.run(peer.client.upload(items(2)))


def test_items_reached_before_an_upload_are_forgotten(peer):
    peer.say("MISSION_ITEM_REACHED", seq=4)
    peer.frame()
    assert peer.client.reached == [4]
    peer.answer = lambda message: (
        message.name == "MISSION_COUNT"
        and peer.say("MISSION_ACK", target_system=245, target_component=190, type=0, mission_type=0)
    )
    peer.run(peer.client.upload([]))
    assert peer.client.reached == []


def test_a_download_returns_what_was_sent(peer):
    stored = items(3)

    def answer(message):
        if message.name == "MISSION_REQUEST_LIST":
            peer.say("MISSION_COUNT", target_system=245, target_component=190, count=3, mission_type=0)
        if message.name == "MISSION_REQUEST_INT":
            item = stored[message.fields.seq]
            params = {f"param{k + 1}": value for k, value in enumerate(item.params)}
            peer.say(
                "MISSION_ITEM_INT", target_system=245, target_component=190, seq=item.seq, frame=item.frame,
                command=item.command, current=0, autocontinue=1, x=474_000_000, y=85_000_000, z=item.z,
                mission_type=0, **params,
            )  # fmt: skip

    peer.answer = answer
    got = peer.run(peer.client.download())
    assert [(item.seq, item.command, item.z) for item in got] == [(0, 16, 10.0), (1, 16, 11.0), (2, 16, 12.0)]
    assert got[0].x == pytest.approx(47.4)
    assert peer.of("MISSION_ACK")[0].type == 0


@pytest.mark.parametrize(("kind", "value"), [(REAL32, 4.25), (INT32, 4001.0), (INT32, -7.0)])
def test_a_value_survives_the_wire(kind, value):
    class Fields:
        param_type = kind
        param_value = parameter_to_wire(value, kind)

    assert parameter_from_wire(Fields) == value


def test_an_integer_is_set_by_its_bits(peer):
    def answer(message):
        if message.name in {"PARAM_REQUEST_READ", "PARAM_SET"}:
            value = 5 if message.name == "PARAM_SET" else 2
            common = {"param_type": INT32, "param_count": 1, "param_index": 0}
            peer.say("PARAM_VALUE", param_id=b"OTHER", param_value=1, **common)
            peer.say("PARAM_VALUE", param_id=b"COUNT", param_value=value, **common)

    peer.answer = answer
    assert peer.run(peer.client.get_parameter("COUNT")) == 2.0
    assert peer.run(peer.client.set_parameter("COUNT", 9.0)) == 5.0  # what the vehicle has stored
    (sent,) = peer.of("PARAM_SET")
    assert (sent.param_id, sent.param_value, sent.param_type) == ("COUNT", 9, INT32)


def test_a_parameter_that_does_not_exist_ends_in_a_timeout(peer):
    with pytest.raises(ScriptTimeout, match="parameter NOPE"):
        peer.run(peer.client.get_parameter("NOPE"))
