"""Where a companion has been asked to go: gotos and the plan, as messages."""

from math import isfinite, isnan, nan

import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from autopilot.mavlink.wire.convert import degrees_e7
from common.geodesy import GeoPoint, geodetic_from_ned
from policies.companion.vehicle_link import COMPONENT, VehicleLink
from policies.companion.where_to.goals import Goals
from policies.companion.where_to.plan_download import PATIENCE_US, RENEW_US

HOME = GeoPoint(47.397742, 8.545594, 488.0)
STATION = (255, 190)
ABOVE_SEA, ABOVE_HOME, ABOVE_GROUND = 0, 6, 11


class Vehicle:
    """Its end of the link, with the goals of its companion."""

    def __init__(self, *, is_ordered_by_goto=True, is_airborne=True, is_placed=True):
        self.end, companion_end = memory_pair()
        self.link = VehicleLink(companion_end)
        self.goals = Goals(self.link, is_ordered_by_goto=is_ordered_by_goto)
        self.time_us = 0
        self._reader = FrameReader()
        self.fly(Mode.HOLD, is_airborne)
        if is_placed:
            self.get_place()
            self.get_home()

    def get_home(self):
        self.tell("HOME_POSITION", latitude=473977420, longitude=85455940, altitude=490000)

    def get_place(self):
        self.tell("GPS_GLOBAL_ORIGIN", latitude=473977420, longitude=85455940, altitude=488000)
        self.tell("ATTITUDE_QUATERNION", q1=1.0)
        self.tell("LOCAL_POSITION_NED", x=0.0, y=0.0, z=-3.0)

    def fly(self, mode, is_airborne=True):
        base_mode = 128 if is_airborne else 0
        self.tell("HEARTBEAT", type=2, autopilot=12, base_mode=base_mode, custom_mode=PX4.custom_mode(mode))
        self.tell("EXTENDED_SYS_STATE", landed_state=2 if is_airborne else 1)

    def tell(self, name, sender=(1, 1), **fields):
        self.end.send(encode(name, *sender, 0, **fields))
        self.link.receive(self.time_us)

    def said(self):
        """What the companion has sent since the last call."""
        return [decode(frame) for data in self.end.receive() for frame in self._reader.feed(data)]

    def goto(self, north, east, down=-4.0, frame=ABOVE_SEA, z=None, component=COMPONENT):
        lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, HOME)
        self.tell(
            "COMMAND_INT", STATION, target_system=1, target_component=component, command=192, frame=frame,
            x=degrees_e7(lat_deg), y=degrees_e7(lon_deg), z=alt_m if z is None else z,
        )  # fmt: skip

    def goes_to(self, north, east, down=-4.0, type_mask=0):
        lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, HOME)
        self.tell(
            "POSITION_TARGET_GLOBAL_INT", type_mask=type_mask, coordinate_frame=5, lat_int=degrees_e7(lat_deg),
            lon_int=degrees_e7(lon_deg), alt=alt_m,
        )  # fmt: skip

    def step(self, us):
        self.time_us += us
        self.goals.frame(self.time_us)
        return self.said()


def answer(said):
    return next(message.fields for message in said if message.name == "COMMAND_ACK")


def text(said):
    return "".join(message.fields.text for message in said if message.name == "STATUSTEXT")


def test_a_goto_to_the_companion_is_an_order_and_is_answered():
    vehicle = Vehicle(is_ordered_by_goto=False)
    vehicle.goto(30.0, 40.0)
    assert vehicle.goals.goal.pos_ned == pytest.approx((30.0, 40.0, -4.0), abs=0.05)
    assert vehicle.goals.is_ordered()
    assert not vehicle.goals.is_ordered()
    ack = answer(vehicle.said())
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (192, 0, *STATION)


def test_a_command_long_is_a_goto_too():
    vehicle = Vehicle()
    lat_deg, lon_deg, alt_m = geodetic_from_ned(30.0, 40.0, -4.0, HOME)
    vehicle.tell(
        "COMMAND_LONG", STATION, target_system=1, target_component=COMPONENT, command=192, param5=lat_deg,
        param6=lon_deg, param7=alt_m,
    )  # fmt: skip
    assert vehicle.goals.goal.pos_ned == pytest.approx((30.0, 40.0, -4.0), abs=1.0)  # single precision


def test_altitudes_count_from_what_the_frame_says():
    vehicle = Vehicle()
    vehicle.goto(30.0, 0.0, frame=ABOVE_HOME, z=5.0)
    assert vehicle.goals.goal.pos_ned[2] == pytest.approx(-7.0, abs=0.1)  # home is 2 m above the origin
    vehicle.goto(30.0, 0.0, frame=ABOVE_GROUND, z=5.0)
    assert isnan(vehicle.goals.goal.pos_ned[2])


@pytest.mark.parametrize(
    ("place", "result", "reason"),
    [
        ((5000.0, 0.0), 2, "it is 5.0 km away, 1.0 km allowed"),
        ((30.0, 0.0, nan, ABOVE_SEA, float("inf")), 2, "there is no such place"),
    ],
)
def test_a_goto_that_cannot_be_is_refused_with_the_reason(place, result, reason):
    vehicle = Vehicle()
    vehicle.goto(*place)
    said = vehicle.said()
    assert answer(said).result == result
    assert reason in text(said)
    assert vehicle.goals.goal is None


def test_on_the_ground_a_goto_is_refused_for_now():
    vehicle = Vehicle(is_airborne=False)
    vehicle.goto(30.0, 0.0)
    said = vehicle.said()
    assert answer(said).result == 1
    assert "not in the air" in text(said)


def test_gotos_to_others_and_other_commands_are_not_answered():
    vehicle = Vehicle()
    vehicle.goto(30.0, 0.0, component=1)
    vehicle.tell("COMMAND_LONG", STATION, target_system=1, target_component=COMPONENT, command=400)
    assert vehicle.said() == []
    assert vehicle.goals.goal is None


@pytest.mark.parametrize("is_order", [True, False])
def test_where_the_vehicle_says_it_goes_in_hold_is_a_goto(is_order):
    vehicle = Vehicle(is_ordered_by_goto=is_order)
    vehicle.goes_to(0.5, 0.0)  # holds
    assert vehicle.goals.goal is None
    vehicle.goes_to(50.0, 0.0)
    assert vehicle.goals.goal.pos_ned == pytest.approx((50.0, 0.0, -4.0), abs=0.05)
    assert vehicle.goals.is_ordered() is is_order
    vehicle.goes_to(50.0, 0.0)  # said again
    assert not vehicle.goals.is_ordered()


def test_a_way_that_had_begun_before_the_companion_came_is_no_order():
    vehicle = Vehicle()
    vehicle.goes_to(50.0, 0.0)
    assert vehicle.goals.goal is None


@pytest.mark.parametrize(("mode", "type_mask"), [(Mode.MISSION, 0), (Mode.RETURN, 0), (Mode.HOLD, 7)])
def test_what_is_no_goto_is_not_taken_for_one(mode, type_mask):
    vehicle = Vehicle()
    vehicle.goes_to(0.0, 0.0)
    vehicle.fly(mode)
    vehicle.goes_to(50.0, 0.0, type_mask=type_mask)
    assert vehicle.goals.goal is None


def plan(vehicle, places, current=0):
    """The vehicle's answers to the download of a plan."""
    vehicle.tell("MISSION_CURRENT", seq=current, total=len(places))
    to_us = {"target_system": 1, "target_component": COMPONENT}
    asked = vehicle.step(RENEW_US + 1)
    assert [message.name for message in asked] == ["MISSION_REQUEST_LIST"]
    vehicle.tell("MISSION_COUNT", count=len(places), **to_us)
    for seq, (command, north, east) in enumerate(places):
        (request,) = vehicle.said()
        assert (request.name, request.fields.seq) == ("MISSION_REQUEST_INT", seq)
        lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, HOME)
        vehicle.tell(
            "MISSION_ITEM_INT", seq=seq, frame=ABOVE_HOME, command=command, x=degrees_e7(lat_deg),
            y=degrees_e7(lon_deg), z=3.0, autocontinue=1, **to_us,
        )  # fmt: skip
    assert [message.name for message in vehicle.said()] == ["MISSION_ACK"]
    vehicle.goals.frame(vehicle.time_us)


TOUR = ((22, 0.0, 0.0), (16, 30.0, 0.0), (178, 0.0, 0.0), (16, 30.0, 30.0), (20, 0.0, 0.0))


def test_waypoints_come_one_after_the_other_and_the_rest_of_the_plan_is_left_out():
    vehicle = Vehicle()
    plan(vehicle, TOUR)
    first = vehicle.goals.reached()
    second = vehicle.goals.reached()
    assert (first.name, first.is_last) == ("waypoint 1 of 2", False)
    assert first.pos_ned == pytest.approx((30.0, 0.0, -5.0), abs=0.1)
    assert (second.name, second.is_last) == ("waypoint 2 of 2", True)
    assert vehicle.goals.goal is None
    assert vehicle.goals.done == "waypoint 2 of 2 reached"
    assert not vehicle.goals.is_ordered()


def test_the_plan_begins_with_the_current_item():
    vehicle = Vehicle()
    plan(vehicle, TOUR, current=2)
    assert vehicle.goals.goal.pos_ned[1] == pytest.approx(30.0, abs=0.1)


def test_a_goto_comes_before_the_plan():
    vehicle = Vehicle()
    plan(vehicle, TOUR)
    vehicle.goto(-20.0, 0.0)
    assert vehicle.goals.goal.name == "goto"


def test_a_download_that_is_not_answered_is_begun_anew():
    vehicle = Vehicle()
    vehicle.step(RENEW_US + 1)
    vehicle.tell("MISSION_COUNT", count=2, target_system=1, target_component=COMPONENT)
    assert [message.name for message in vehicle.said()] == ["MISSION_REQUEST_INT"]
    vehicle.step(PATIENCE_US + 1)
    assert [message.name for message in vehicle.step(RENEW_US + 1)] == ["MISSION_REQUEST_LIST"]


@pytest.mark.parametrize("order", ["place, home", "home, place"])
def test_a_plan_that_is_there_before_position_and_home_are_has_its_places_once_they_are(order):
    at_once, late = Vehicle(), Vehicle(is_placed=False)
    plan(at_once, TOUR)
    plan(late, TOUR)
    assert late.goals.goal is None
    for what in order.split(", "):
        late.get_place() if what == "place" else late.get_home()
        late.step(20_000)
    assert late.goals.goal == at_once.goals.goal
    assert isfinite(late.goals.goal.pos_ned[2])


@pytest.mark.parametrize(("reached", "left"), [(1, "waypoint 2 of 2"), (2, None)])
def test_a_home_that_is_learnt_under_way_gives_the_places_that_are_left_their_heights(reached, left):
    vehicle = Vehicle(is_placed=False)
    vehicle.get_place()
    plan(vehicle, TOUR)
    for _ in range(reached):
        vehicle.goals.reached()
    done = vehicle.goals.done
    vehicle.get_home()
    vehicle.step(20_000)
    assert (vehicle.goals.goal and vehicle.goals.goal.name) == left
    assert vehicle.goals.goal is None or isfinite(vehicle.goals.goal.pos_ned[2])
    assert vehicle.goals.done == done


def test_a_home_that_is_learnt_after_a_goto_brings_back_no_plan_that_was_not_asked_for():
    vehicle = Vehicle(is_placed=False)
    vehicle.get_place()
    plan(vehicle, TOUR)
    vehicle.goto(20.0, 0.0)
    vehicle.goals.reached()
    vehicle.get_home()
    vehicle.step(20_000)
    assert (vehicle.goals.goal, vehicle.goals.done) == (None, "goto reached")
