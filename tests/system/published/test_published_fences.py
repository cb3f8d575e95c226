"""Fences and returns as PX4's and ArduPilot's own flight tests judge them, in lockstep, with noisy sensors.

Each test quotes what is published. A breach is judged in truth, by the simulator's own position.
"""

import json

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.item_lists import ListKind
from autopilot.interface.vehicle_state import Mode
from common.geodesy import geodetic_from_ned
from mission.client import CommandRefused, MissionRefused
from mission.flight import FlightConfig
from mission.plan.plan_file import PlanItem, parse_plan
from mission.plan.plan_lists import EXCLUSION_VERTEX, FENCE_LIST, INCLUSION_VERTEX, RALLY_LIST
from mission.script import fly_plan
from tests.system.published.published_rules import Flown, airborne

BLOCK = ((25.0, -30.0), (25.0, 30.0), (45.0, 30.0), (45.0, -30.0))
FIELD = ((-40.0, -60.0), (-40.0, 60.0), (100.0, 60.0), (100.0, -60.0))


class Fenced(Flown):
    """A flight whose script is given the flight too."""

    def __init__(self, **parameters):
        super().__init__(config={"seed": 0}, **parameters)

    def run(self, script, seconds=600.0):
        super().run(lambda drone: script(drone, self), seconds)
        return np.array(self.rows)[:, 1:4]


def place(north, east):
    return geodetic_from_ned(north, east, 0.0, FlightConfig().home)[:2]


def polygon(points, command):
    params = (float(len(points)), 0.0, 0.0, 0.0)
    return [PlanItem(i, 0, command, params, *place(*point), 0.0) for i, point in enumerate(points)]


def least_clearance(flown, track):
    """How near [m] the vehicle was to what its fence excludes, in truth; negative: inside."""
    fence = flown.flight.controller.fence
    return float(fence.region.clearances(track[:, :2]).min())


async def back_home(drone, flown, begin_s, seconds=30.0):
    """The fence has answered in time, and the vehicle comes home and lands."""
    assert flown.state.mode is Mode.RETURN
    assert flown.state.time_us * 1e-6 - begin_s < seconds
    await drone.wait_disarmed(180.0)


def test_direct_return_passes_around_an_exclusion_polygon():
    """PX4, late 2026: a direct return past an exclusion zone goes around it; home within 5 m, no breach."""
    flown = Fenced(RTL_RETURN_ALT=15.0)

    async def script(drone, _):
        await drone.wait_ready()
        await drone.upload(polygon(BLOCK, EXCLUSION_VERTEX), FENCE_LIST)
        await airborne(drone)
        for point in ((0.0, 45.0), (70.0, 45.0), (70.0, 0.0)):
            await drone.goto_ned(*point, -10.0)
        await drone.return_home()
        await drone.wait_disarmed(180.0)

    track = flown.run(script)
    assert flown.home_distance_m < 1.5  # 5 m published
    assert least_clearance(flown, track) > 0.5
    assert not flown.state.fence.breach_count


def test_goto_passes_around_an_exclusion_polygon():
    """ArduPilot rover: avoidance in guided: around the fence without a breach, and home again."""
    flown = Fenced()

    async def script(drone, flown):
        await drone.wait_ready()
        await drone.upload(polygon(BLOCK, EXCLUSION_VERTEX), FENCE_LIST)
        await airborne(drone)
        await drone.goto_ned(70.0, 0.0, -10.0)
        assert np.hypot(flown.pos[0] - 70.0, flown.pos[1]) < 2.0
        await drone.return_home()
        await drone.wait_disarmed(180.0)

    track = flown.run(script)
    assert flown.home_distance_m < 1.5  # 3 to 7 m published
    assert least_clearance(flown, track) > 0.5
    assert not flown.state.fence.breach_count


@pytest.mark.parametrize(
    ("parameters", "target"),
    [
        ({"GF_MAX_HOR_DIST": 40.0}, (60.0, 0.0, -10.0)),
        ({"GF_MAX_VER_DIST": 20.0}, (0.0, 0.0, -30.0)),
        ({"GF_MIN_ALT": 6.0}, (0.0, 0.0, -3.0)),
    ],
)
def test_breach_of_a_limit_returns_home(parameters, target):
    """ArduPilot copter: circle, maximum and minimum altitude: RTL within 30 s of the breach, home within 10 m."""
    flown = Fenced(GF_ACTION=3.0, RTL_RETURN_ALT=12.0, **parameters)

    async def script(drone, flown):
        await airborne(drone)
        with pytest.raises(CommandRefused, match="outside fence"):
            await drone.goto_ned(*target)
        begin_s = flown.state.time_us * 1e-6
        drone.offboard_position(*target)  # an outside computer that does not know the fence
        await drone.sleep(1.0)
        await drone.start_offboard()
        await drone.until(lambda: flown.state.fence.breached, 30.0, "breach")
        await drone.until(lambda: flown.state.mode is Mode.RETURN, 1.0, "return")
        await back_home(drone, flown, begin_s)
        assert any("Geofence breached" in text for text in drone.texts)

    flown.run(script)
    assert flown.home_distance_m < 1.5  # 10 m published


def test_vehicle_outside_its_fence_is_told_before_arming():
    """ArduPilot copter: arming outside a fence is refused, with a text that says why."""
    flown = Fenced()

    async def script(drone, _):
        await drone.wait_ready()
        away = [(north + 300.0, east) for north, east in FIELD]
        await drone.upload(polygon(away, INCLUSION_VERTEX), FENCE_LIST)
        with pytest.raises(CommandRefused, match="outside fence"):
            await drone.arm()
        await drone.until(lambda: any("PreArm: outside fence" in t for t in drone.texts), 40.0, "told")
        await drone.upload([], FENCE_LIST)
        await drone.sleep(1.0)
        await drone.arm()
        await drone.disarm()

    flown.run(script)


def test_polygon_fence_is_uploaded_kept_and_flown_within():
    """ArduPilot rover: upload, refusal of bad lists, the fence respected by a client that goes on, home 3..7 m."""
    flown = Fenced(GF_ACTION=3.0, GF_PREDICT=1.0, RTL_RETURN_ALT=12.0)

    async def script(drone, flown):
        await drone.wait_ready()
        fence = polygon(FIELD, INCLUSION_VERTEX)
        await drone.upload(fence, FENCE_LIST)
        with pytest.raises(MissionRefused, match="crosses itself"):
            await drone.upload(polygon((FIELD[0], FIELD[2], FIELD[1], FIELD[3]), INCLUSION_VERTEX), FENCE_LIST)
        kept = await drone.download(FENCE_LIST)
        assert [(item.command, item.params) for item in kept] == [(item.command, item.params) for item in fence]
        await airborne(drone)
        drone.offboard_velocity(0.0, 8.0, 0.0)
        await drone.sleep(1.0)
        await drone.start_offboard()
        await drone.until(lambda: flown.state.mode is Mode.RETURN, 30.0, "return before the border")
        await drone.wait_disarmed(180.0)

    track = flown.run(script)
    assert flown.home_distance_m < 1.5  # 3 to 7 m published
    assert least_clearance(flown, track) > 0.0  # predicted: stopped inside, in truth
    assert track[:, 1].max() > 35.0


def test_smart_return_goes_back_through_the_corner():
    """ArduPilot rover: SmartRTL back through the corner (5 m) to 3..7 m of home."""
    flown = Fenced()

    async def script(drone, flown):
        await airborne(drone)
        await drone.goto_ned(50.0, 0.0, -10.0)
        await drone.goto_ned(50.0, 40.0, -10.0)
        flown.begin = len(flown.rows)
        assert flown.flight.controller.request(ChangeMode(Mode.SMART_RETURN)).reason == ""
        await drone.wait_disarmed(180.0)

    track = flown.run(script)[flown.begin :]
    assert np.hypot(track[:, 0] - 50.0, track[:, 1]).min() < 2.5  # 5 m published
    assert flown.home_distance_m < 2.5  # 3 to 7 m published


def test_plan_with_fence_and_rally_points_is_flown_inside_and_returns_to_the_point():
    """A QGroundControl plan: all three lists are uploaded; the return at its end goes to the rally point."""
    home_lat, home_lon = place(0.0, 0.0)
    items = [
        {"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, None, home_lat, home_lon, 12]},
        {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, None, *place(60.0, 20.0), 12]},
        {"type": "SimpleItem", "command": 20, "frame": 2, "params": [0, 0, 0, 0, 0, 0, 0]},
    ]
    for i, item in enumerate(items):
        item |= {"autoContinue": True, "doJumpId": i + 1}
    document = {
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "mission": {"version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
                    "plannedHomePosition": [home_lat, home_lon, 488], "items": items},
        "geoFence": {"version": 2, "circles": [],
                     "polygons": [{"version": 1, "inclusion": True, "polygon": [list(place(*p)) for p in FIELD]}]},
        "rallyPoints": {"version": 2, "points": [[*place(40.0, -20.0), 15.0]]},
    }  # fmt: skip
    flown = Fenced()

    async def script(drone, _):
        await fly_plan(drone, parse_plan(json.dumps(document), "fenced.plan"))
        assert len(await drone.download(RALLY_LIST)) == 1

    track = flown.run(script)
    assert np.hypot(track[-1, 0] - 40.0, track[-1, 1] + 20.0) < 1.5
    assert least_clearance(flown, track) > 30.0


def test_fence_is_the_same_after_a_reboot_that_keeps_its_items():
    """ArduPilot rover: a fence survives a reboot; keeping the items is the host's part."""
    flown = Fenced()
    lists = flown.flight.controller.lists
    assert lists.load(ListKind.FENCE, polygon(FIELD, INCLUSION_VERTEX)) is None
    again = Fenced()
    assert again.flight.controller.lists.load(ListKind.FENCE, lists.items(ListKind.FENCE)) is None
    assert again.flight.controller.fence.region.polygons == flown.flight.controller.fence.region.polygons
