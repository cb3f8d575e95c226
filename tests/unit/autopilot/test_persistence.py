"""What the vehicle remembers over a restart."""

from math import isnan, nan

import pytest

from autopilot.commander.home import Home
from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.interface.vehicle_state import VehicleState
from autopilot.params import parameter_table
from autopilot.persistence import WRITE_PERIOD_US, Persistence
from common.geodesy import GeoPoint
from common.state_folder import StateFolder
from tests.unit.autopilot.kinematic import Recorder

PLACE = GeoPoint(47.0, 8.0, 488.0)


class Lists:
    """Lists that take everything, or refuse item 1."""

    def __init__(self):
        self.kept = dict.fromkeys(ListKind, ())
        self.refusal = None
        self.listeners = []

    def items(self, kind):
        return self.kept[kind]

    def load(self, kind, items):
        if self.refusal is None:
            self.kept[kind] = tuple(items)
            for listener in self.listeners:
                listener(kind)
        return self.refusal

    def on_change(self, listener):
        self.listeners.append(listener)


class Counting(StateFolder):
    """Counts whole writes, and can be full."""

    def __init__(self, folder):
        super().__init__(folder)
        self.writes = []
        self.is_full = False

    def _require_space(self):
        if self.is_full:
            raise OSError(28, "No space left on device")

    def note(self, record, changes):
        self._require_space()
        super().note(record, changes)

    def write(self, record, content):
        self._require_space()
        super().write(record, content)
        self.writes.append(record)


@pytest.fixture
def state(tmp_path):
    state = Counting(tmp_path)
    yield state
    state.close()


def restarted(state, chosen=()):
    """Parameters, lists and their keeper of a vehicle that starts with this state."""
    params, lists = parameter_table(), Lists()
    keeper = Persistence(state, params, chosen)
    keeper.keep_lists(lists)
    return params, lists, keeper


ITEM = MissionItem(0, 6, 16, (1.0, nan, 0.0, nan), 47.123456789, 8.5, 30.0)


def test_parameters_that_differ_are_kept_and_defaults_are_not(state):
    params, _, keeper = restarted(state)
    default = params["MIS_TAKEOFF_ALT"]
    params.set("MIS_TAKEOFF_ALT", 12.5)
    params.set("MAV_SYS_ID", 9)
    params.set("MAV_SYS_ID", 1)
    keeper.write()
    assert state.read("parameters") == {"MIS_TAKEOFF_ALT": 12.5}
    params, _, _ = restarted(state)
    assert (params["MIS_TAKEOFF_ALT"], params["MAV_SYS_ID"]) == (12.5, 1)
    params.set("MIS_TAKEOFF_ALT", default)
    assert state.read("parameters") == {}


def test_change_is_stored_before_anyone_hears_of_it(state):
    params, _, _ = restarted(state)
    seen = []
    params.on_change(lambda _: seen.append(StateFolder.read(state, "parameters")))
    params.set("MIS_TAKEOFF_ALT", 12.5)
    assert seen == [{"MIS_TAKEOFF_ALT": 12.5}]


def test_lists_of_every_kind_are_kept(state):
    _, lists, _ = restarted(state)
    for kind in ListKind:
        lists.load(kind, [ITEM] * (kind + 1))
    _, lists, _ = restarted(state)
    assert [len(lists.items(kind)) for kind in ListKind] == [1, 2, 3]
    item = lists.items(ListKind.RALLY)[2]
    assert (item.seq, item.command, item.x, item.autocontinue) == (2, 16, 47.123456789, True)
    assert item.params[0] == 1.0
    assert isnan(item.params[1])


def test_many_changes_are_one_write_per_second(state):
    params, _, keeper = restarted(state)
    keeper.frame(0)
    for i in range(500):
        params.set("MIS_TAKEOFF_ALT", 3.0 + 0.01 * i)
    for time_us in range(20_000, WRITE_PERIOD_US + 40_000, 20_000):
        keeper.frame(time_us)
        params.set("MIS_TAKEOFF_ALT", 10.0 + time_us * 1e-6)
    assert state.writes == ["parameters", "parameters"]
    assert state.read("parameters")["MIS_TAKEOFF_ALT"] == params["MIS_TAKEOFF_ALT"]


def test_chosen_parameter_is_neither_read_nor_stored(state):
    state.write("parameters", {"MIS_TAKEOFF_ALT": 12.5})
    params, _, keeper = restarted(state, chosen=["MIS_TAKEOFF_ALT"])
    assert params["MIS_TAKEOFF_ALT"] != 12.5
    params.set("MAV_SYS_ID", 7)
    keeper.write()
    assert state.read("parameters") == {"MIS_TAKEOFF_ALT": 12.5, "MAV_SYS_ID": 7}


def test_stored_values_that_do_not_fit_are_named_and_left_alone(state):
    state.write(
        "parameters", {"NO_SUCH": 1.0, "MAV_SYS_ID": 100_000, "MIS_TAKEOFF_ALT": "high", "NAV_RCL_ACT": 10**400}
    )
    params, _, keeper = restarted(state)
    assert params["MAV_SYS_ID"] == 1
    (problem,) = keeper.problems
    assert problem.endswith("NO_SUCH, MAV_SYS_ID, MIS_TAKEOFF_ALT, NAV_RCL_ACT")
    assert len(state.read("parameters")) == 4


NUMBERS = {"command": 16, "frame": 3, "params": [0, 0, 0, 0], "position": [47.0, 8.0, 10.0], "autocontinue": True}


@pytest.mark.parametrize(
    "content",
    [
        {"items": 3},
        {"items": [{}]},
        {"other": []},
        {"items": [NUMBERS | {"frame": float("inf")}]},
        {"items": [NUMBERS | {"position": [47.0, 8.0, 10**400]}]},
    ],
)
def test_stored_list_that_is_none_is_left_out_with_a_sentence(state, content):
    state.write("mission", content)
    _, lists, keeper = restarted(state)
    assert lists.items(ListKind.MISSION) == ()
    assert keeper.problems == ["the stored mission is not a list of items; it is left out"]


def test_full_disk_is_said_and_does_not_stop_the_flight(state):
    params, _, keeper = restarted(state)
    said = []
    keeper.on_trouble = said.append
    state.is_full = True
    params.set("MIS_TAKEOFF_ALT", 12.5)
    keeper.frame(0)
    assert said == ["Parameters not stored: No space left on device"] * 2
    state.is_full = False
    keeper.frame(WRITE_PERIOD_US)
    assert state.read("parameters") == {"MIS_TAKEOFF_ALT": 12.5}


def home_of(state):
    return Home(state, Recorder())


def test_home_that_a_client_gave_is_kept(tmp_path):
    given = VehicleState(origin=PLACE)
    with_home = home_of(given)
    first = StateFolder(tmp_path)
    Persistence(first, parameter_table()).keep_home(with_home)
    assert given.home is None
    with_home.set(47.0, 8.0, 500.0, has_position=False)
    first.close()  # as a killed process leaves it: noted, and never written whole
    again = VehicleState(origin=PLACE)
    second = StateFolder(tmp_path)
    Persistence(second, parameter_table()).keep_home(home_of(again))
    assert again.home == GeoPoint(47.0, 8.0, 500.0)
    second.close()


def test_home_that_does_not_fit_is_told_and_left_out(tmp_path):
    state = StateFolder(tmp_path)
    state.write("given_home", {"lat_deg": 47.0, "lon_deg": "east", "alt_m": 1.0})
    persistence = Persistence(state, parameter_table())
    persistence.keep_home(home_of(VehicleState(origin=PLACE)))
    assert "no place" in persistence.problems[0]
    state.write("given_home", {"lat_deg": 10**400, "lon_deg": 8.0, "alt_m": 1.0})
    persistence = Persistence(state, parameter_table())
    persistence.keep_home(home_of(VehicleState(origin=PLACE)))
    assert "no place" in persistence.problems[0]
    state.write("given_home", {"lat_deg": 47.0, "lon_deg": 8.0, "alt_m": 1.0})
    persistence = Persistence(state, parameter_table())
    persistence.keep_home(home_of(VehicleState(origin=GeoPoint(0.0, 0.0, 0.0))))
    assert "too far" in persistence.problems[0]
    state.close()
