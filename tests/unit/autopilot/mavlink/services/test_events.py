import ast
import struct
from dataclasses import dataclass
from pathlib import Path

import pytest

from autopilot.commander import arming
from autopilot.commander.failsafe import RULES
from autopilot.interface.vehicle_state import Mode, Severity
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.services.event_texts import (
    ARMED,
    ARMING_SUMMARY,
    DISARMED,
    FAILSAFES,
    HEALTH_SUMMARY,
    MODE_CHANGED,
    check_of,
    events_metadata,
)
from autopilot.mavlink.services.events import KEPT
from tests.unit.autopilot.mavlink.rig import Rig


@pytest.fixture
def rig():
    rig = Rig()
    rig.vehicle.params.set("MAV_EVENTS", 1)
    rig.frame()  # which reports that all is well, in events 1 and 2
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
    assert (disarmed.id, disarmed.sequence) == (DISARMED, 3)
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
    reported = rig.all("CURRENT_EVENT_SEQUENCE", 150)
    assert [each.sequence for each in reported] == [3, 3, 3]
    assert {each.flags for each in reported} == {0}
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
    assert asked.events == []
    (error,) = asked.errors
    assert (error.sequence, error.sequence_oldest_available) == (3, 8)


def test_absurd_range_is_bounded(rig):
    change(rig, mode=Mode.RETURN)
    assert len(ask(rig, 2, 1).events) <= KEPT


def numbers(event, layout):
    return struct.unpack_from(layout, bytes(event.arguments))


def test_arming_checks_are_reported_when_asked_and_when_they_change(rig):
    rig.update(is_armed=False)
    rig.vehicle.arming_problems = ["GNSS: 5 satellites, 6 needed", "mission item 3 is lost"]
    before, satellites, other, after = rig.all("EVENT", 55)
    assert (before.id, after.id) == (ARMING_SUMMARY, HEALTH_SUMMARY)
    gps = 1 << check_of("GNSS: no data").component
    system = 1 << check_of("vehicle is moving").component
    assert numbers(before, "<BQQII") == (0, gps | system, 0, 0, 0)
    assert numbers(satellites, "<IBff") == (1, 7, 5.0, 6.0)
    assert other.id == check_of("anything else").number
    assert numbers(after, "<BQQQ")[2] == gps | system
    assert {before.log_levels & 0xF, after.log_levels & 0xF} == {8}
    assert satellites.log_levels == Severity.ERROR << 4 | Severity.ERROR
    assert rig.all("EVENT", 100) == []
    rig.client.command(401)
    assert len(rig.all("EVENT")) == 4
    rig.vehicle.arming_problems = []
    before, after = rig.all("EVENT", 55)
    assert numbers(before, "<BQQII") == (0, 0, 0, 1, 1)


def test_armed_vehicle_reports_whether_it_may_go_on(rig):
    rig.update(is_failsafe=True)
    before, _ = rig.all("EVENT", 55)
    assert numbers(before, "<BQQII") == (0, 0, 0, 1, 0)


def test_every_event_has_a_text_of_its_own():
    events = [
        event
        for group in events_metadata(PX4)["components"]["1"]["event_groups"].values()
        for event in group["events"].values()
    ]
    assert len({event["name"] for event in events}) == len(events)
    known = 5 + len(FAILSAFES)
    assert len(events) > known + 20


def written(node):
    """A string of the source, its numbers as 5 and its words as they come."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    source = ast.unparse(node)
    if "%}" in source:
        return "5%"
    if "label" in source:  # every sensor that arming needs has a reason of its own
        (needed,) = arming._NEEDED_SENSORS
        return needed.label
    return "vertical" if "word" in source else "5.0"


def test_reasons_against_arming_are_events_of_their_own():
    tree = ast.parse(Path(arming.__file__).read_text(encoding="utf-8"))
    returned = [node for each in ast.walk(tree) if isinstance(each, ast.Return) for node in ast.walk(each)]
    formatted = [node.values for node in returned if isinstance(node, ast.JoinedStr)]
    parts = {part for values in formatted for part in values}
    plain = [[node] for node in returned if isinstance(node, ast.Constant) and node not in parts]
    reasons = ["".join(map(written, values)) for values in formatted + plain]
    reasons = [reason for reason in reasons if " " in reason]
    assert len(reasons) > 15
    other = check_of("anything else").number
    assert [reason for reason in reasons if check_of(reason).number == other] == []
