"""Functions of switches, by command and by radio channel."""

from math import nan

import pytest

from autopilot.ardupilot_only_params import ARDUPILOT_PARAMETERS
from autopilot.interface.client_requests import ChangeMode, SetCurrentItem
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.params import parameter_table
from tests.unit.autopilot.mavlink.rig import AskedVehicle, Rig, texts

AUX = 218  # MAV_CMD_DO_AUX_FUNCTION
LOW, MIDDLE, HIGH = 0, 1, 2
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
TAKEOFF, WAYPOINT, GRIPPER = 22, 16, 211
# ArduPilot's numbers
MODES = (
    (4, Mode.RETURN), (16, Mode.MISSION), (18, Mode.LAND), (33, Mode.BRAKE), (42, Mode.SMART_RETURN), (52, Mode.ACRO),
    (55, Mode.GUIDED), (56, Mode.HOLD), (57, Mode.FOLLOW), (68, Mode.STABILIZED), (69, Mode.POSITION),
    (70, Mode.ALTITUDE), (72, Mode.ORBIT),
)  # fmt: skip


class Taker:
    """A payload that takes some commands."""

    def __init__(self, *commands):
        self.commands = commands
        self.taken = []

    def takes(self, command):
        return command in self.commands

    def run(self, command, params, *_):
        self.taken.append((command, *params[:3]))
        return AskedVehicle().reply


@pytest.fixture
def rig():
    vehicle = AskedVehicle()
    vehicle.params = parameter_table(None, ARDUPILOT_PARAMETERS)
    rig = Rig(dialect=ARDUPILOT, vehicle=vehicle)
    rig.frame()
    rig.vehicle.calls.clear()
    return rig


def done(rig, function, position):
    return rig.ack(AUX, function, position).result


@pytest.mark.parametrize(("function", "mode"), MODES)
def test_high_changes_the_mode(rig, function, mode):
    assert done(rig, function, HIGH) == ACCEPTED
    assert rig.vehicle.calls == [ChangeMode(mode)]


@pytest.mark.parametrize("position", [LOW, MIDDLE])
def test_low_goes_back_to_the_mode_before_and_only_from_that_mode(rig, position):
    rig.update(mode=Mode.GUIDED)
    done(rig, 4, HIGH)
    rig.update(mode=Mode.RETURN)
    assert done(rig, 4, position) == ACCEPTED
    assert rig.vehicle.calls == [ChangeMode(Mode.RETURN), ChangeMode(Mode.GUIDED)]
    rig.update(mode=Mode.LAND)
    done(rig, 4, position)
    assert len(rig.vehicle.calls) == 2


@pytest.mark.parametrize("function", [41, 153])
def test_arms_and_disarms(rig, function):
    done(rig, function, HIGH)
    done(rig, function, LOW)
    assert rig.vehicle.calls == [("arm", False), ("disarm", False)]


def test_disarms_stops_motors_and_begins_the_mission_anew_when_high_only(rig):
    for function in (81, 31, 24):
        assert done(rig, function, LOW) == ACCEPTED
    assert not rig.vehicle.calls
    for function in (81, 31, 24):
        done(rig, function, HIGH)
    assert rig.vehicle.calls == [("disarm", False), ("terminate",), SetCurrentItem(0)]


def test_fence_is_switched(rig):
    done(rig, 11, HIGH)
    done(rig, 11, LOW)
    assert rig.vehicle.calls == [("enable", 15), ("disable", 15)]


@pytest.mark.parametrize(("function", "relay"), [(28, 0), (34, 1), (35, 2), (36, 3), (66, 4), (67, 5)])
def test_relays_are_switched(rig, function, relay):
    done(rig, function, HIGH)
    assert rig.vehicle.state.relays == 1 << relay
    done(rig, function, LOW)
    assert rig.vehicle.state.relays == 0


def test_gripper_and_camera_are_asked(rig):
    payload = Taker(GRIPPER, 2000, 2500, 2501)
    rig.vehicle.payload.add(payload)
    for function, position in ((19, HIGH), (19, MIDDLE), (19, LOW), (9, HIGH), (9, LOW), (166, HIGH), (166, LOW)):
        assert done(rig, function, position) == ACCEPTED
    assert payload.taken == [
        (GRIPPER, 1.0, 1.0, 0.0), (GRIPPER, 1.0, 0.0, 0.0), (2000, 0.0, 0.0, 1.0), (2500, 0.0, 0.0, 0.0),
        (2501, 0.0, 0.0, 0.0),
    ]  # fmt: skip


def test_without_a_camera_there_is_no_photo(rig):
    assert done(rig, 9, HIGH) == UNSUPPORTED


def test_waypoints_are_saved_behind_a_takeoff_and_cleared(rig):
    assert done(rig, 7, HIGH) == ACCEPTED
    assert done(rig, 7, HIGH) == ACCEPTED
    items = rig.vehicle.lists.items(ListKind.MISSION)
    assert [(item.seq, item.command) for item in items] == [(0, TAKEOFF), (1, WAYPOINT), (2, WAYPOINT)]
    assert items[2].z == pytest.approx(30.0, abs=0.1)
    assert items[2].x == pytest.approx(rig.vehicle.state.position.lat_deg)
    assert done(rig, 58, HIGH) == ACCEPTED
    assert not rig.vehicle.lists.items(ListKind.MISSION)


def test_no_waypoint_is_saved_on_the_ground(rig):
    rig.update(is_armed=False)
    assert done(rig, 7, HIGH) == REJECTED


@pytest.mark.parametrize(("function", "position"), [(9999, HIGH), (4, 3), (4, nan), (nan, HIGH), (4, -1), (1.5, HIGH)])
def test_what_there_is_not_is_denied(rig, function, position):
    assert done(rig, function, position) == DENIED
    assert not rig.vehicle.calls


def test_px4_vehicles_have_no_such_command():
    assert Rig().ack(AUX, 4, HIGH).result == UNSUPPORTED


def test_switch_on_a_channel_acts_when_it_moves(rig):
    rig.vehicle.params.set("RC7_OPTION", 4)
    sticks = rig.vehicle.state.sticks

    def put(pulse_us):
        sticks.channels[6] = pulse_us
        sticks.count += 1
        rig.frame()
        return [asked.mode for asked in rig.vehicle.calls]

    assert put(1900) == []  # where it stands at first does nothing
    assert put(1000) == []
    assert put(1900) == [Mode.RETURN]
    assert put(1850) == [Mode.RETURN]
    rig.update(mode=Mode.RETURN)
    assert put(1500) == [Mode.RETURN, Mode.HOLD]


def test_refused_switch_is_told(rig):
    rig.vehicle.params.set("RC8_OPTION", 300)
    said = []
    for pulse_us in (1000, 2000):
        rig.vehicle.state.sticks.channels[7] = pulse_us
        rig.vehicle.state.sticks.count += 1
        said += texts(rig.frame())
    assert said == ["RC8_OPTION 300: there is no auxiliary function 300"]
