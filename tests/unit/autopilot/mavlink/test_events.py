from dataclasses import dataclass

import pytest

from autopilot.commander.failsafe import RULES
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.events import ARMED, DISARMED, FAILSAFES, KEPT, MODE_CHANGED
from autopilot.vehicle import Mode, Severity
from tests.unit.autopilot.mavlink.rig import Rig


@pytest.fixture
def rig():
    rig = Rig()
    rig.vehicle.params.set("MAV_EVENTS", 1)
    rig.frame()
    return rig


def change(rig, **state):
    rig.update(**state)
    rig.server.heartbeat_now()
    return rig.all("EVENT")


@dataclass
class Asked:
    events: list
    errors: list


def ask(rig, first, last):
    rig.client.send("REQUEST_EVENT", target_component=1, first_sequence=first, last_sequence=last)
    messages = rig.frame()
    return Asked(
        [message.fields.sequence for message in messages if message.name == "EVENT"],
        [message.fields for message in messages if message.name == "RESPONSE_EVENT_ERROR"],
    )


def test_nothing_is_sent_unless_it_is_switched_on():
    rig = Rig()
    rig.update(mode=Mode.RETURN, is_armed=False)
    rig.server.heartbeat_now()
    names = {message.name for message in rig.frame(100)}
    assert not names & {"EVENT", "CURRENT_EVENT_SEQUENCE"}
    assert ask(rig, 0, 10) == Asked([], [])


def test_arming_and_mode_are_events(rig):
    (disarmed,) = change(rig, is_armed=False)
    assert (disarmed.id, disarmed.sequence) == (DISARMED, 1)
    (mode,) = change(rig, mode=Mode.RETURN)
    assert mode.id == MODE_CHANGED
    assert int.from_bytes(bytes(mode.arguments[:4]), "little") == PX4.custom_mode(Mode.RETURN)
    assert [event.id for event in change(rig, is_armed=True, mode=Mode.HOLD)] == [ARMED, MODE_CHANGED]
    assert change(rig) == []


def test_failsafe_text_is_an_event_of_its_severity(rig):
    for rule in RULES:
        rig.server.statustext(rule.severity, f"{rule.text}: returning")
        (event,) = rig.all("EVENT")
        assert event.id == FAILSAFES[rule.text]
        assert event.log_levels == rule.severity << 4 | rule.severity
    rig.server.statustext(Severity.INFO, "Landed")
    assert rig.all("EVENT") == []


def test_numbers_of_events_differ():
    numbers = [ARMED, DISARMED, MODE_CHANGED, *FAILSAFES.values()]
    assert len(set(numbers)) == len(numbers)
    assert {number >> 24 for number in numbers} == {1}


def test_sequence_is_told_every_second_with_its_reset_once(rig):
    change(rig, mode=Mode.RETURN)
    told = rig.all("CURRENT_EVENT_SEQUENCE", 150)
    assert [each.sequence for each in told] == [1, 1, 1]
    assert {each.flags for each in told} == {0}
    fresh = Rig()
    fresh.vehicle.params.set("MAV_EVENTS", 1)
    assert [each.flags for each in fresh.all("CURRENT_EVENT_SEQUENCE", 60)] == [1, 0]


def test_missed_events_are_sent_again(rig):
    for mode in (Mode.RETURN, Mode.HOLD, Mode.LAND):
        change(rig, mode=mode)
    assert ask(rig, 2, 3) == Asked([2, 3], [])
    assert ask(rig, 1, 1).events == [1]


def test_what_is_not_kept_is_an_error_with_the_oldest(rig):
    for i in range(KEPT + 5):
        change(rig, mode=(Mode.RETURN, Mode.HOLD)[i % 2])
    asked = ask(rig, 3, 7)
    assert asked.events == [6, 7]
    (error,) = asked.errors
    assert (error.sequence, error.sequence_oldest_available) == (3, 6)


def test_absurd_range_is_bounded(rig):
    change(rig, mode=Mode.RETURN)
    assert len(ask(rig, 2, 1).events) <= KEPT
