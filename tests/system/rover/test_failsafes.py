"""What a rover does when something fails: it holds, returns, or is disarmed; where a drone would land, it stands."""

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from mission.plan.plan_file import PlanItem
from mission.plan.plan_lists import EXCLUSION_VERTEX, FENCE_LIST, RALLY_LIST, RALLY_POINT
from tests.system.published.published_rules import CMD_SET_MODE, Flown, Sticks
from tests.system.published.test_published_fences import least_clearance, place, polygon

INJECT, GNSS, BATTERY, OFF = 420, 4.0, 100.0, 1.0
GCS = 6  # MAV_TYPE
POSCTL = 3.0
STOP_S = 5.0  # until it stands, whatever it did
HOLDS_WITHIN_M = 1.0  # by an estimate that wanders
DISARMED = None  # instead of a mode

LINK_ACTIONS = [
    (1, Mode.HOLD, ": hold"),
    (2, Mode.RETURN, ": return"),
    (3, Mode.HOLD, ": hold"),  # land
    (5, DISARMED, ": motors stopped"),  # terminate
    (6, DISARMED, ": motors stopped"),
]


class Rover(Flown):
    """A rover whose script begins when it is armed."""

    def __init__(self, airframe="rover", links=(), **parameters):
        super().__init__(config={"airframe": airframe}, links=links, **parameters)

    def run(self, script):
        async def whole(drone):
            await drone.wait_ready()
            await drone.arm()
            await script(drone)

        super().run(whole, 300.0)

    async def answers(self, drone, mode, text):
        """It says so, and does it."""
        await drone.until(lambda: self.said(text), 20.0, text)
        await drone.sleep(STOP_S)
        if mode is DISARMED:
            assert not self.state.is_armed
        else:
            assert self.state.mode is mode
            assert self.state.is_failsafe
        if mode in (Mode.RETURN, Mode.SMART_RETURN):
            await drone.wait_disarmed(60.0)
            assert self.home_distance_m < 1.0
        else:
            place = self.pos
            await drone.sleep(5.0)
            assert np.linalg.norm(self.pos - place) < HOLDS_WITHIN_M


async def driven_off(drone, speed=2.0, seconds=6.0):
    drone.offboard_velocity(speed, 0.0, 0.0)
    await drone.start_offboard()
    await drone.sleep(seconds)


def tip_over(rover):
    """A blow that leaves it on its roof."""
    body = rover.flight.rig.rows["body"][0]
    body["omega_frd"][0] = 9.0
    body["vel_ned"][2] = -2.0


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_tipped_over_it_is_disarmed(airframe):
    rover = Rover(airframe)

    async def script(drone):
        await driven_off(drone, 1.0)
        tip_over(rover)
        await rover.answers(drone, DISARMED, "Crash detected: motors stopped")
        assert abs(rover.state.roll_rad) > 1.0

    rover.run(script)


def drain(rover, share):
    rover.flight.rig.rows["body"]["battery_charge_c"][0] = share * 3.6 * rover.flight.airframe.battery.capacity_mah


def test_a_low_battery_is_told_and_a_critical_one_brings_it_home():
    rover = Rover()

    async def script(drone):
        await drone.goto_ned(30.0, 0.0, 0.0)
        drain(rover, 0.13)
        await drone.until(lambda: rover.said("Battery low"), 30.0, "low")
        await drone.sleep(1.0)
        assert rover.state.mode is Mode.HOLD
        assert not rover.state.is_failsafe
        drain(rover, 0.06)
        await drone.until(lambda: rover.said("Battery critical"), 200.0, "critical")  # parked it draws little
        await rover.answers(drone, Mode.RETURN, "Battery critical: return")

    rover.run(script)


@pytest.mark.parametrize("action", [2, 3])
def test_an_empty_battery_stops_it_wherever_it_is(action):
    rover = Rover(SYS_FAILURE_EN=1, COM_LOW_BAT_ACT=action)

    async def script(drone):
        await driven_off(drone)
        await drone.command(INJECT, BATTERY, OFF, 0.0, name="fail")
        await rover.answers(drone, Mode.HOLD, "Battery nearly empty: hold")
        assert rover.home_distance_m > 5.0

    rover.run(script)


@pytest.mark.parametrize(("action", "mode", "outcome"), LINK_ACTIONS)
def test_without_its_ground_station(action, mode, outcome):
    vehicle_end, station = memory_pair(LinkRole.GROUND)
    rover = Rover(links=[vehicle_end], NAV_DLL_ACT=action, COM_DL_LOSS_T=5)

    async def script(drone):
        station.send(encode("HEARTBEAT", 255, 190, 0, type=GCS, autopilot=8, mavlink_version=3))
        await driven_off(drone, seconds=4.0)
        await rover.answers(drone, mode, f"Ground station lost{outcome}")

    rover.run(script)


@pytest.mark.parametrize(("action", "mode", "outcome"), LINK_ACTIONS)
def test_without_the_sticks_that_drive_it(action, mode, outcome):
    rover = Rover(NAV_RCL_ACT=action)

    async def script(drone):
        sticks = Sticks(drone)
        await drone.sleep(0.5)
        await drone.command(CMD_SET_MODE, 1.0, POSCTL)
        await sticks.hold(6.0, z=900)
        sticks.axes["z"] = 900
        sticks.is_sending = False
        await rover.answers(drone, mode, f"Sticks lost{outcome}")

    rover.run(script)


@pytest.mark.parametrize(
    ("action", "mode", "outcome"),
    [
        (3, Mode.RETURN, ": return"),
        (4, Mode.HOLD, ": hold"),
        (5, Mode.HOLD, ": hold"),
        (6, DISARMED, ": motors stopped"),
        (7, DISARMED, ": motors stopped"),
    ],
)
def test_without_offboard_setpoints(action, mode, outcome):
    rover = Rover(COM_OBL_RC_ACT=action)

    async def script(drone):
        await driven_off(drone)
        drone._offboard = None
        await rover.answers(drone, mode, f"Offboard setpoints lost{outcome}")

    rover.run(script)


@pytest.mark.parametrize(
    ("action", "mode", "outcome"),
    [
        (2, Mode.HOLD, ": hold"),
        (3, Mode.RETURN, ": return"),
        (4, DISARMED, ": motors stopped"),
        (5, Mode.HOLD, ": hold"),
        (6, Mode.SMART_RETURN, ": smart return"),
    ],
)
def test_outside_its_fence(action, mode, outcome):
    rover = Rover(GF_ACTION=action, GF_MAX_HOR_DIST=15.0)

    async def script(drone):
        await driven_off(drone)
        await rover.answers(drone, mode, f"Geofence breached{outcome}")

    rover.run(script)


@pytest.mark.parametrize(
    ("action", "mode", "outcome"),
    [(3, Mode.HOLD, ": hold"), (5, DISARMED, ": motors stopped"), (6, DISARMED, ": motors stopped")],
)
def test_without_a_position(action, mode, outcome):
    rover = Rover(SYS_FAILURE_EN=1, COM_POS_LOST_ACT=action, EKF2_WHL_CTRL=0)

    async def script(drone):
        await driven_off(drone, seconds=3.0)
        await drone.command(INJECT, GNSS, OFF, 0.0, name="fail")
        await rover.answers(drone, mode, f"Position lost{outcome}")

    rover.run(script)


def test_it_returns_to_the_nearest_rally_point_round_what_its_fence_excludes():
    rover = Rover(RTL_TYPE=3)
    block = ((15.0, -8.0), (15.0, 8.0), (25.0, 8.0), (25.0, -8.0))

    async def script(drone):
        await drone.upload(polygon(block, EXCLUSION_VERTEX), FENCE_LIST)
        await drone.upload([PlanItem(0, 3, RALLY_POINT, (0.0, 0.0, 0.0, 0.0), *place(10.0, 3.0), 0.0)], RALLY_LIST)
        await drone.goto_ned(40.0, 0.0, 0.0)
        await drone.return_home()
        await drone.wait_disarmed(60.0)

    rover.run(script)
    track = np.array(rover.rows)[:, 1:4]
    assert np.hypot(track[-1, 0] - 10.0, track[-1, 1] - 3.0) < 1.0
    assert least_clearance(rover, track) > 0.0
    assert rover.said("rally")
