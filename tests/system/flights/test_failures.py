"""What the vehicle does when a part fails that a client made fail: whole flights over MAVLink in lockstep.

Tolerances are those of PX4's MAVSDK flight tests and of ArduPilot's autotest where a comment does not say otherwise.
"""

from dataclasses import dataclass
from math import nan

import numpy as np
import pytest

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from common.geodesy import geodetic_from_ned
from mission.client import CommandRefused
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

INJECT, TERMINATE, TAKEOFF, WAYPOINT, LAND = 420, 185, 22, 16, 21
ABOVE_HOME = 6  # MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
GYRO, MAG, BARO, GNSS, BATTERY, MOTOR, RC_SIGNAL = 0, 2, 3, 4, 100, 101, 104  # FAILURE_UNIT
OK, OFF, STUCK, WRONG, SLOW, DELAYED, INTERMITTENT = 0, 1, 2, 4, 5, 6, 7  # FAILURE_TYPE
HEIGHT_REFERENCES = BY_BARO, BY_GNSS = (0, 1)
HEIGHT_M = 10.0
GCS = 6  # MAV_TYPE


@dataclass
class Outcome:
    """A flight from the failure on."""

    flight: Flight
    texts: list
    time_s: np.ndarray  # since the failure
    pos_ned: np.ndarray  # truth
    is_armed: np.ndarray

    @property
    def drift_m(self):
        return float(np.hypot(*(self.pos_ned[:, :2] - self.pos_ned[0, :2]).T).max())

    @property
    def height_error_m(self):
        return float(np.abs(self.pos_ned[:, 2] - self.pos_ned[0, 2]).max())

    @property
    def disarmed_s(self):
        """When the motors stopped."""
        return float(self.time_s[~self.is_armed][0])

    def said(self, part):
        return any(part in text for text in self.texts)


def config(**params):
    return FlightConfig(
        seed=1, wind_m_s=3.0, world=WorldConfig(trees_per_ha=0.0), parameters={"SYS_FAILURE_EN": 1, **params}
    )


def flown(script, **params):
    """Runs `script(drone, fail)` to its end; `fail(unit, failure, instance)` injects."""
    flight = Flight(config(**params))
    started_us = []

    async def whole(drone):
        async def fail(unit, failure, instance=0):
            await drone.command(INJECT, float(unit), float(failure), float(instance), name="fail")
            started_us.append(flight.time_us)

        await drone.wait_ready()
        await script(drone, fail)

    running = flight.fly(whole, seconds=600.0)
    if running.error is not None:
        raise running.error
    assert running.is_done
    history = flight.close()
    after = history.time_us > started_us[0]
    return Outcome(
        flight,
        list(flight.drone.texts),
        (history.time_us[after] - started_us[0]) * 1e-6,
        history.pos_ned_true[after].astype(float),
        history.is_armed[after],
    )


def hovering(unit, failure, instance=0, seconds=30.0, height_m=HEIGHT_M, **params):
    """Holds, and loses a part."""

    async def script(drone, fail):
        await drone.arm()
        await drone.takeoff(height_m, timeout_s=120.0)
        await drone.sleep(3.0)
        await fail(unit, failure, instance)
        await drone.sleep(seconds)

    return flown(script, **params)


def square_items():
    """A 20 m square at 10 m, from take-off to landing."""
    corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0), (0.0, 0.0), (0.0, 0.0)]
    commands = [TAKEOFF, *[WAYPOINT] * 4, LAND]
    items = []
    for seq, (command, corner) in enumerate(zip(commands, corners, strict=True)):
        lat_deg, lon_deg, _ = geodetic_from_ned(*corner, 0.0, config().home)
        items.append(MissionItem(seq, ABOVE_HOME, command, (0.0, 0.0, 0.0, nan), lat_deg, lon_deg, HEIGHT_M))
    return items


def in_mission(unit, failure, **params):
    """A mission in which a part fails on the way to item 2; until the vehicle is disarmed."""

    async def script(drone, fail):
        await drone.upload(square_items())
        await drone.start_mission()
        await drone.until(lambda: 1 in drone.reached, 120.0, "item 1")
        await fail(unit, failure)
        await drone.until(lambda: not drone.is_armed, 300.0, "disarmed")
        await drone.sleep(1.0)

    return flown(script, **params)


@pytest.mark.parametrize("height_reference", HEIGHT_REFERENCES)
def test_gnss_lost_in_a_mission_leads_to_a_blind_descent(height_reference):
    outcome = in_mission(GNSS, OFF, EKF2_HGT_REF=height_reference)
    assert outcome.said("Position lost: land")
    assert not outcome.said("Position is valid again")
    assert outcome.disarmed_s < 30.0
    assert not outcome.flight.rig.rows["truth"]["is_crashed"][0]


@pytest.mark.parametrize(
    ("unit", "failure", "limit_s", "height_reference"),
    [
        (MAG, OFF, 90.0, BY_BARO),
        (MAG, STUCK, 120.0, BY_BARO),
        *((BARO, failure, 90.0, reference) for failure in (OFF, STUCK) for reference in HEIGHT_REFERENCES),
    ],
)
def test_mission_finishes_without(unit, failure, limit_s, height_reference):
    outcome = in_mission(unit, failure, EKF2_HGT_REF=height_reference)
    assert outcome.flight.drone.reached[-1] == 5
    assert outcome.disarmed_s < limit_s


def test_gnss_glitch_in_loiter_moves_nothing():
    outcome = hovering(GNSS, WRONG)  # 100 m north, east and down
    assert outcome.said("position reset by")
    assert outcome.drift_m < 3.0  # ArduPilot: 20 m
    assert outcome.height_error_m < 2.0


def test_gnss_that_comes_and_goes_is_told_once():
    outcome = hovering(GNSS, INTERMITTENT)
    assert sum("dead reckoning" in text for text in outcome.texts) == 1
    assert outcome.drift_m < 3.0


def test_weak_motor_is_flown_with():
    outcome = hovering(MOTOR, SLOW, 1, seconds=60.0)  # 60 % of its command
    assert outcome.drift_m < 2.0  # ArduPilot: 10 m
    assert outcome.height_error_m < 1.0  # ArduPilot: 5 m


def test_empty_battery_is_noticed_and_lands():
    outcome = hovering(BATTERY, OFF, seconds=60.0)
    assert outcome.said("Battery nearly empty: land")
    assert outcome.disarmed_s < 40.0
    assert not outcome.flight.rig.rows["truth"]["is_crashed"][0]


def test_dead_gyro_stops_the_motors():
    assert hovering(GYRO, OFF, seconds=5.0).disarmed_s < 0.5


def test_terminated_flight_falls_and_disarms_on_the_ground():
    async def script(drone, fail):
        await drone.arm()
        await drone.takeoff(100.0, timeout_s=120.0)
        await fail(MOTOR, OK)  # marks the time
        await drone.command(TERMINATE, 1.0, name="terminate")
        await drone.until(lambda: not drone.is_armed, 30.0, "disarmed")

    outcome = flown(script)
    assert outcome.disarmed_s < 2.0 + np.sqrt(2.0 * 100.0 / 10.0)


def test_repaired_part_works_again():
    async def script(drone, fail):
        await drone.arm()
        await drone.takeoff(HEIGHT_M)
        for failure in (STUCK, OK):
            await fail(MAG, failure)
            await drone.sleep(10.0)
        await fail(MOTOR, SLOW, 2)
        await fail(MOTOR, OK, 2)
        await drone.land()

    outcome = flown(script)
    faults = outcome.flight.rig.arrays.faults.numpy()[0]
    assert faults["mag"]["mode"] == 0
    assert not faults["motor_loss"].any()


@pytest.mark.parametrize(
    ("enabled", "is_armed", "request_", "reason"),
    [
        (0, True, (GNSS, OFF, 0), "disabled"),
        (1, False, (GNSS, OFF, 0), "armed vehicle only"),
        (1, True, (GNSS, DELAYED, 0), "cannot be made delayed"),
        (1, True, (GNSS, OFF, 2), "only one"),
        (1, True, (MOTOR, OFF, 5), "motors 1 to 4"),
        (1, True, (MOTOR, STUCK, 1), "cannot be made stuck"),
        (1, True, (5, OFF, 0), "no optical flow"),
        (1, True, (77, OFF, 0), "no failure"),
    ],
)
def test_injection_is_refused_with_a_reason(enabled, is_armed, request_, reason):
    refusals = []

    async def script(drone):
        await drone.wait_ready()
        if is_armed:
            await drone.arm()
        try:
            await drone.command(INJECT, *map(float, request_), name="fail")
        except CommandRefused as refused:
            refusals.append(str(refused))

    flight = Flight(config(SYS_FAILURE_EN=enabled))
    flight.fly(script, seconds=60.0)
    assert len(refusals) == 1
    assert reason in refusals[0]
    assert not flight.rig.arrays.faults.numpy()["gnss"]["mode"][0]


def test_quadrotor_without_a_motor_says_so_and_stops_the_others():
    outcome = hovering(MOTOR, OFF, 1, seconds=5.0)
    assert "Motor 1 has failed" in outcome.texts
    assert outcome.said("Motor failure")
    assert outcome.said("Crash detected: motors stopped")
    assert outcome.disarmed_s < 1.5


def test_motor_failure_can_terminate_the_flight():
    """PX4: free fall from 100 m disarms within 2 + sqrt(2h/10) s."""
    height_m = 100.0
    outcome = hovering(MOTOR, OFF, 1, seconds=15.0, height_m=height_m, COM_ACT_FAIL_ACT=4)
    assert outcome.said("Motor failure: flight terminated")
    assert outcome.disarmed_s < 2.0 + np.sqrt(2.0 * height_m / 10.0)


def test_motor_watch_can_be_switched_off():
    outcome = hovering(MOTOR, OFF, 1, seconds=3.0, FD_ACT_EN=0)
    assert not outcome.said("Motor 1 has failed")


def heartbeat(kind):
    return encode("HEARTBEAT", 255, 190, 0, type=kind, autopilot=8, mavlink_version=3)


def test_vehicle_returns_when_its_ground_station_falls_silent():
    vehicle_end, station = memory_pair(LinkRole.GROUND)
    flight = Flight(config(NAV_DLL_ACT=2, COM_DL_LOSS_T=5.0), links=[vehicle_end])
    modes = []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(HEIGHT_M)
        await drone.goto_ned(30.0, 0.0, -HEIGHT_M)
        for _ in range(20):
            station.send(heartbeat(GCS))
            await drone.sleep(1.0)
        modes.append(flight.controller.state.mode)
        await drone.sleep(4.5)
        modes.append(flight.controller.state.mode)
        await drone.wait_disarmed(120.0)

    running = flight.fly(script, seconds=300.0)
    assert running.error is None
    assert modes == [Mode.HOLD, Mode.RETURN]
    assert "Ground station lost: return" in flight.drone.texts
    assert np.hypot(*flight.rig.rows["truth"]["pos_ned"][0][:2]) < 2.0


def test_vehicle_returns_from_wind_above_its_limit():
    flight = Flight(
        FlightConfig(
            seed=1,
            wind_m_s=10.0,
            world=WorldConfig(trees_per_ha=0.0),
            parameters={"COM_WIND_WARN": 4.0, "COM_WIND_MAX_ACT": 3},
        )
    )

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(20.0)
        flight.params.set("COM_WIND_MAX", 7.0)
        await drone.wait_disarmed(180.0)

    assert flight.fly(script, seconds=300.0).error is None
    assert "Strong wind" in flight.drone.texts
    assert "Wind above its limit: return" in flight.drone.texts
