"""Whatever mission is taken can be flown: every setpoint is finite where it must be, and the flight goes on or ends."""

from math import isfinite, nan

from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot.interface.client_requests import ChangeMode, SetCurrentItem
from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.mission.item_checks import SUPPORTED_COMMANDS, refuse_items
from autopilot.ports import SETPOINT_TRAJECTORY
from tests.unit.autopilot.kinematic import Kinematic, geo

FLOWN_S = 25.0
numbers = st.one_of(
    st.sampled_from([nan, 0.0, 1.0, 2.0, 3.0, -1.0, 0.5, 5.0, 15.0, -20.0, 90.0]), st.floats(-400.0, 400.0)
)
metres = st.one_of(st.sampled_from([0.0, 10.0, 30.0]), st.floats(-60.0, 60.0))


@st.composite
def items(draw, seq):
    command = draw(st.sampled_from(sorted(SUPPORTED_COMMANDS)))
    lat, lon, _ = geo(draw(metres), draw(metres))
    frame = draw(st.sampled_from([0, 2, 3, 6, 6, 6]))
    height = draw(st.floats(2.0, 30.0)) + (488.0 if frame == 0 else 0.0)
    params = tuple(draw(numbers) for _ in range(4))
    return MissionItem(seq, frame, command, params, lat, lon, height, draw(st.sampled_from([True, True, True, False])))


@st.composite
def missions(draw):
    """Items that are taken, each on its own."""
    taken = []
    for _ in range(draw(st.integers(2, 9))):
        item = draw(items(len(taken)))
        if refuse_items([*taken, item], lambda _: False) is None:
            taken.append(item)
    return taken


@settings(max_examples=20, deadline=None)
@given(missions(), st.integers(0, 8), st.booleans())
def test_every_mission_that_is_taken_is_flown(mission, restart_at, is_paused):
    rig = Kinematic().flying()
    assert rig.fc.lists.load(ListKind.MISSION, mission) is None
    rig.fc.request(ChangeMode(Mode.MISSION))
    for frame in range(round(FLOWN_S / 0.02)):
        rig.frame()
        if frame == 300 and is_paused:
            rig.fc.guidance.pause()
        if frame == 400 and is_paused:
            rig.fc.guidance.resume()
        if frame == 600:
            rig.fc.request(SetCurrentItem(restart_at))
        if rig.sp("kind") == SETPOINT_TRAJECTORY and rig.sp("is_armed") and not rig.sp("is_landed"):
            pos, vel = rig.sp("pos_ned"), rig.sp("vel_ned")
            assert all(isfinite(p) or isfinite(v) for p, v in zip(pos, vel, strict=True)), (pos, vel)
            assert isfinite(rig.sp("yaw")) or isfinite(rig.sp("yaw_rate"))
            assert max(abs(v) for v in vel if isfinite(v)) < 13.0 if any(map(isfinite, vel)) else True
    assert abs(rig.pos).max() < 1000.0
