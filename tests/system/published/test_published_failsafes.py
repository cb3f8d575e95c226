"""Failsafes and failing sensors as ArduPilot's and PX4's own flight tests judge them, in truth.

Each test quotes what is published; more of it is in `test_failures.py`, `test_hexarotor.py` and `test_sticks.py`.
"""

from math import nan

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from common.geodesy import geodetic_from_ned
from mission.plan.plan_file import PlanItem
from sim.faults import set_fault
from tests.system.published.published_rules import Flown, Sticks, airborne

GCS = 6  # MAV_TYPE
ABOVE_HOME, TAKEOFF, WAYPOINT, RETURN = 6, 22, 16, 20
INJECT, ACCELEROMETER, GNSS, GARBAGE, WRONG = 420, 1.0, 4.0, 3.0, 4.0
CHARGE_OK, CHARGE_LOW, CHARGE_CRITICAL, CHARGE_EMERGENCY = 1, 2, 3, 4


def items(flown, length_m):
    """Out along a line and back home."""
    lat, lon, _ = geodetic_from_ned(length_m, 0.0, 0.0, flown.flight.config.home)
    home = flown.flight.config.home
    places = [(TAKEOFF, home.lat_deg, home.lon_deg), (WAYPOINT, lat, lon), (RETURN, nan, nan)]
    return [
        PlanItem(i, ABOVE_HOME, command, (0.0, 0.0, 0.0, nan), x, y, 15.0) for i, (command, x, y) in enumerate(places)
    ]


@pytest.mark.parametrize("timeout_s", [5.0, pytest.param(10.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("action", "mode", "text"),
    [
        (0, Mode.HOLD, "Ground station lost"),
        (1, Mode.HOLD, "Ground station lost: hold"),
        (2, Mode.RETURN, "Ground station lost: return"),
        (3, Mode.LAND, "Ground station lost: land"),
        (7, Mode.SMART_RETURN, "Ground station lost: smart return"),
    ],
)
def test_ground_station_failsafe(action, mode, text, timeout_s):
    """ArduPilot: "none, RTL, Land, SmartRTL after 5 s (10 s with FS_GCS_TIMEOUT); recovery does not change the mode
    back"."""
    vehicle_end, station = memory_pair(LinkRole.GROUND)
    flown = Flown(links=[vehicle_end], NAV_DLL_ACT=float(action), COM_DL_LOSS_T=timeout_s)

    async def heard(drone, seconds):
        for _ in range(round(seconds)):
            station.send(encode("HEARTBEAT", 255, 190, 0, type=GCS, autopilot=8, mavlink_version=3))
            await drone.sleep(1.0)

    async def script(drone):
        await airborne(drone)
        await drone.goto_ned(25.0, 0.0, -10.0)
        await heard(drone, 5.0)
        await drone.sleep(timeout_s - 1.5)
        assert flown.state.mode is Mode.HOLD
        await drone.sleep(1.0)
        assert flown.state.mode is mode
        assert text in drone.texts
        await heard(drone, 4.0)
        assert flown.state.mode is mode
        assert "Ground station is back" in drone.texts
        if mode is Mode.HOLD:
            return
        await drone.wait_disarmed(120.0)

    flown.run(script)
    if mode is Mode.HOLD:
        assert flown.state.is_armed
    else:
        assert np.hypot(flown.pos[0] - (25.0 if mode is Mode.LAND else 0.0), flown.pos[1]) < 2.0


def test_battery_failsafe():
    """ArduPilot: "battery failsafe: 12.5, 11.4, 10.0 V: charge state, text, RTL then LAND"; by the charge left."""
    flown = Flown(RTL_LAND_DELAY=-1.0)
    capacity_c = 3.6 * flown.flight.airframe.battery.capacity_mah

    def drain(share):
        flown.flight.rig.rows["body"]["battery_charge_c"][0] = share * capacity_c

    async def script(drone):
        def charge_state():
            return drone.latest("BATTERY_STATUS").charge_state

        await airborne(drone)
        await drone.goto_ned(25.0, 0.0, -10.0)
        assert charge_state() == CHARGE_OK
        drain(0.13)
        await drone.until(lambda: flown.said("Battery low"), 15.0, "low")
        await drone.sleep(1.0)
        assert charge_state() == CHARGE_LOW
        assert flown.state.mode is Mode.HOLD
        drain(0.06)
        await drone.until(lambda: flown.said("Battery critical: return"), 200.0, "critical")
        await drone.sleep(1.0)
        assert charge_state() == CHARGE_CRITICAL
        assert flown.state.mode is Mode.RETURN
        drain(0.045)
        await drone.until(lambda: flown.said("Battery nearly empty: land"), 200.0, "empty")
        await drone.sleep(1.0)
        assert charge_state() == CHARGE_EMERGENCY
        assert flown.state.mode is Mode.LAND
        await drone.wait_disarmed(60.0)

    flown.run(script)
    assert flown.home_distance_m < 2.0
    assert not flown.body["is_crashed"]


@pytest.mark.parametrize(("action", "mode"), [(1, Mode.HOLD), (2, Mode.RETURN), (3, Mode.LAND), (7, Mode.SMART_RETURN)])
def test_throttle_failsafe(action, mode):
    """ArduPilot: "throttle failsafe: RC loss in each mode: RTL, LAND, SMART_RTL"."""
    flown = Flown(NAV_RCL_ACT=float(action))

    async def script(drone):
        sticks = Sticks(drone)
        await airborne(drone)
        await drone.goto_ned(25.0, 0.0, -10.0)
        await drone.command(176, 1.0, 3.0, name="position mode")
        await drone.sleep(1.0)
        sticks.is_sending = False
        await drone.until(lambda: flown.state.mode is mode, 8.0, "failsafe")  # PX4 holds for 5 s first
        if mode is not Mode.HOLD:
            await drone.wait_disarmed(120.0)

    flown.run(script)
    if mode is not Mode.HOLD:
        assert np.hypot(flown.pos[0] - (25.0 if mode is Mode.LAND else 0.0), flown.pos[1]) < 2.0


def test_throttle_failsafe_lets_a_mission_go_on():
    """ArduPilot: "throttle failsafe: RC loss ... or continue the mission"."""
    flown = Flown(NAV_RCL_ACT=2.0, COM_RCL_EXCEPT=1.0)

    async def script(drone):
        sticks = Sticks(drone)
        await drone.wait_ready()
        await drone.upload(items(flown, 60.0))
        await drone.start_mission()
        await drone.until(lambda: flown.pos[0] > 10.0, 60.0, "underway")
        sticks.is_sending = False
        await drone.until(lambda: 1 in drone.reached, 60.0, "the waypoint")
        assert not flown.said("Sticks lost: return")
        await drone.wait_disarmed(120.0)

    flown.run(script)
    assert flown.home_distance_m < 2.0


def test_gnss_glitches_in_loiter():
    """ArduPilot: "GPS glitch in loiter: glitches up to 110 m: truth moves <= 20 m in 30 s"."""
    flown = Flown(config={"wind_m_s": 3.0})
    moved = []

    async def script(drone):
        await airborne(drone, 20.0)
        await drone.sleep(3.0)
        begin_s, place = flown.now_s, flown.pos
        for bias_m in (2.0, 5.0, 12.0, -30.0, 50.0, 78.0, 0.0):  # on each axis: 110 m over ground at most
            set_fault(flown.faults, "gnss", "biased", bias_m)
            await drone.sleep(3.0)
        set_fault(flown.faults, "gnss", "none")
        await drone.sleep(9.0)
        moved.append(np.hypot(*(flown.since(begin_s)[:, 1:3] - place[:2]).T).max())
        await drone.land()

    flown.run(script)
    assert moved[0] < 3.0


def test_jammed_gnss_degrades_and_recovers():
    """ArduPilot: "jamming: GPS accuracies, satellites and position degrade"."""
    flown = Flown(SYS_FAILURE_EN=1.0)
    seen = {}

    async def fixes(drone, name):
        rows = []
        for _ in range(15):
            await drone.sleep(0.2)
            fix = drone.latest("GPS_RAW_INT")
            rows.append((fix.h_acc * 1e-3, fix.vel_acc * 1e-3, fix.satellites_visible, fix.lat * 0.0111, fix.eph))
        seen[name] = np.array(rows)

    async def script(drone):
        await airborne(drone, 15.0)
        await fixes(drone, "open")
        await drone.command(INJECT, GNSS, GARBAGE, 0.0, name="jam")
        await drone.sleep(0.6)
        await fixes(drone, "jammed")
        assert flown.state.mode is Mode.HOLD
        assert np.hypot(*(flown.pos[:2])) < 3.0
        await drone.command(INJECT, GNSS, 0.0, 0.0, name="repair")
        await drone.sleep(0.6)
        await fixes(drone, "after")
        await drone.land()

    flown.run(script)
    scatter_m = {name: rows[:, 3].std() for name, rows in seen.items()}
    assert seen["jammed"][:, 0].min() > 10.0 * seen["open"][:, 0].max()
    assert seen["jammed"][:, 1].min() > 10.0 * seen["open"][:, 1].max()
    assert seen["jammed"][:, 2].max() <= 5
    assert seen["open"][:, 2].min() >= 10
    assert scatter_m["jammed"] > 3.0
    assert scatter_m["open"] < 1.0
    assert seen["after"][:, 0] == pytest.approx(seen["open"][:, 0])
    assert flown.home_distance_m < 3.0


def test_total_loss_of_gnss_leaves_hold():
    """PX4: "GNSS failover: ... total loss leaves Hold in 10 s"; and it comes down upright."""
    flown = Flown()

    async def script(drone):
        await airborne(drone)
        set_fault(flown.faults, "gnss", "off")
        await drone.until(lambda: flown.state.mode is not Mode.HOLD, 8.0, "another mode")
        assert flown.state.mode is Mode.LAND
        await drone.until(lambda: not drone.is_armed, 60.0, "disarmed")

    flown.run(script)
    assert not flown.body["is_crashed"]


@pytest.mark.parametrize("bias_m_s2", [2.0, -2.0])
def test_vibration_failsafe(bias_m_s2):
    """ArduPilot: "vibration failsafe: text within 30 s, still lands (-5..2 m)"; its simulated vibration is a bias."""
    flown = Flown()

    async def script(drone):
        await airborne(drone, 20.0)
        imu = flown.flight.rig.arrays.sensors.numpy()["imu"]
        imu["accel_bias_frd"][0, 2] += bias_m_s2
        begin_s = flown.now_s
        await drone.until(lambda: flown.said("Vibration compensation ON"), 5.0, "told")
        await drone.sleep(25.0)
        assert np.abs(flown.since(begin_s)[:, 3] + 20.0).max() < 5.0
        assert np.abs(flown.since(begin_s + 10.0)[:, 3] + 20.0).max() < 2.5
        imu["accel_bias_frd"][0, 2] -= bias_m_s2
        await drone.until(lambda: flown.said("Vibration compensation OFF"), 30.0, "told that it is over")
        imu["accel_bias_frd"][0, 2] += bias_m_s2
        await drone.sleep(5.0)
        await drone.land(50.0)

    flown.run(script)
    assert not flown.body["is_crashed"]
    assert flown.home_distance_m < 2.0


@pytest.mark.parametrize("bias_m_s2", [2.0, -2.0])
def test_mission_is_flown_with_a_wrong_accelerometer(bias_m_s2):
    """PX4 asks this of two IMUs: "clipped accelerometer on the primary IMU: corridor 3 m in truth"; here is one."""
    flown = Flown()

    async def script(drone):
        await drone.wait_ready()
        await drone.upload(items(flown, 60.0))
        await drone.start_mission()
        await drone.until(lambda: flown.pos[0] > 15.0, 60.0, "underway")
        flown.flight.rig.arrays.sensors.numpy()["imu"]["accel_bias_frd"][0, 2] += bias_m_s2
        await drone.until(lambda: 1 in drone.reached, 60.0, "the waypoint")
        await drone.wait_disarmed(120.0)

    flown.run(script)
    assert np.abs(np.array(flown.rows)[:, 2]).max() < 2.0
    assert flown.home_distance_m < 2.0
    assert not flown.body["is_crashed"]


def test_accelerometer_that_is_wrong_on_every_axis_is_flown_with():
    """The failure that clients inject as wrong: 2 m/s2 too much on each axis, which tilts the horizon by 16 deg."""
    flown = Flown(SYS_FAILURE_EN=1.0)

    async def script(drone):
        await airborne(drone, 20.0)
        begin_s = flown.now_s
        await drone.command(INJECT, ACCELEROMETER, WRONG, 0.0, name="wrong accelerometer")
        await drone.sleep(30.0)
        track = flown.since(begin_s)[:, 1:4]
        assert np.abs(track[:, 2] - track[0, 2]).max() < 6.0
        await drone.land(90.0)

    flown.run(script)
    assert not flown.body["is_crashed"]


def test_accelerometer_bias_is_found():
    """ArduPilot: "estimator: accelerometer bias 0.7 m/s2 found"; on every axis at once."""
    flown = Flown(EKF2_ABL_LIM=0.8)
    set_fault(flown.faults, "accel", "biased", 0.7)

    async def script(drone):
        await airborne(drone)
        for place in ((20.0, 0.0, -10.0), (20.0, 20.0, -15.0), (0.0, 0.0, -10.0)):
            await drone.goto_ned(*place)
        await drone.land()

    flown.run(script)
    assert flown.state.estimate.accel_bias_frd == pytest.approx((0.7, 0.7, 0.7), abs=0.1)
    assert flown.home_distance_m < 2.0
