from math import isnan, nan

import pytest

from autopilot.interface.vehicle_state import Mode, Verdict
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from tests.unit.autopilot.mavlink.rig import HOME, Rig, texts

REPOSITION, WAYPOINT = 192, 16
CHANGE_MODE = 1


def guided_rig() -> Rig:
    rig = Rig(dialect=ARDUPILOT)
    rig.update(mode=Mode.GUIDED)
    return rig


def reposition(rig: Rig, flags: float, **others):
    rig.client.send(
        "COMMAND_INT",
        command=REPOSITION,
        **(
            {"frame": 0, "param1": -1.0, "param2": flags, "param4": nan, "x": 474_000_000, "y": 85_000_000, "z": 500.0}
            | others
        ),
    )
    return rig.only("COMMAND_ACK").result


def test_goto_is_flown_in_mode_guided():
    rig = Rig(dialect=ARDUPILOT)
    assert reposition(rig, CHANGE_MODE) == 0
    (goto,) = rig.vehicle.calls
    assert (goto.lat_deg, goto.lon_deg, goto.alt_amsl_m, goto.mode) == (47.4, 8.5, 500.0, Mode.GUIDED)


def test_goto_in_mode_guided_leaves_the_mode_alone():
    rig = guided_rig()
    assert reposition(rig, 0.0, frame=3, z=20.0) == 0
    assert [goto.alt_amsl_m for goto in rig.vehicle.calls] == [HOME.alt_m + 20.0]


def test_goto_without_leave_to_change_the_mode_is_refused():
    rig = Rig(dialect=ARDUPILOT)
    assert reposition(rig, 0.0) == Verdict.DENIED
    assert rig.vehicle.calls == []


@pytest.mark.parametrize("name", ["MISSION_ITEM", "MISSION_ITEM_INT"])
def test_guided_item_is_a_goto(name):
    rig = guided_rig()
    scale = 1e7 if name.endswith("INT") else 1
    rig.client.send(name, current=2, frame=3, command=WAYPOINT, x=int(47 * scale), y=int(8 * scale), z=30.0)
    assert rig.only("MISSION_ACK").type == 0
    (goto,) = rig.vehicle.calls
    assert (goto.lat_deg, goto.lon_deg, goto.alt_amsl_m) == (47.0, 8.0, HOME.alt_m + 30.0)


def test_guided_altitude_item_changes_the_height_alone():
    rig = guided_rig()
    rig.client.send("MISSION_ITEM", current=3, frame=3, command=WAYPOINT, x=47.0, y=8.0, z=30.0)
    assert rig.only("MISSION_ACK").type == 0
    (goto,) = rig.vehicle.calls
    assert isnan(goto.lat_deg)
    assert isnan(goto.lon_deg)
    assert goto.alt_amsl_m == HOME.alt_m + 30.0


@pytest.mark.parametrize(
    ("mode", "fields", "reason"),
    [
        (Mode.HOLD, {}, "Goto: needs mode Guided"),
        (Mode.GUIDED, {"command": 21}, "Goto: only a waypoint can be a guided item"),
        (Mode.GUIDED, {"x": 1000.0}, "Goto: there is no such place"),
    ],
)
def test_guided_item_is_refused_with_a_reason(mode, fields, reason):
    rig = Rig(dialect=ARDUPILOT)
    rig.update(mode=mode)
    rig.client.send("MISSION_ITEM", **({"current": 2, "frame": 3, "command": WAYPOINT, "x": 47.0, "y": 8.0} | fields))
    messages = rig.frame()
    assert [message.fields.type != 0 for message in messages if message.name == "MISSION_ACK"] == [True]
    assert texts(messages) == [reason]


def test_px4_knows_no_guided_items():
    rig = Rig()
    rig.client.send("MISSION_ITEM", current=2, frame=3, command=WAYPOINT, x=47.0, y=8.0)
    assert rig.only("MISSION_ACK").type == 13  # INVALID_SEQUENCE: no upload is under way
