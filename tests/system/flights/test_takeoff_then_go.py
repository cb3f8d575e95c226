"""Sent somewhere while it is taking off: the vehicle rises first, then it goes. Judged by the simulator's truth."""

from math import cos, degrees, hypot, nan, sin

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, OrbitRequest, TakeOff, TargetReport
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
LOW_M = 1.5  # below that nothing but wind and noise may move it sideways
LEAN_MAX_DEG = 16.0  # of a take-off without any goto, as it leaves its feet: 14.8
NORTH_M, HEIGHT_M = 60.0, 20.0


class TakingOff:
    """A vehicle that has just been asked to take off, watched until it is where it was sent."""

    def __init__(self, mode=Mode.TAKEOFF, height_m=2.5):
        self.flight = Flight(FlightConfig(world=PLAIN))
        self.fc = self.flight.controller
        self.state = self.fc.state
        self.body = self.flight.rig.rows["truth"]
        self.lean_deg = self.moved_m = 0.0  # the most that was seen below LOW_M
        self.is_watched = False
        self.run(lambda: self.state.is_ready_to_arm, 30.0)
        if mode is Mode.GUIDED:
            assert self.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
        assert self.fc.arm(force=False).verdict is Verdict.ACCEPTED
        assert self.fc.request(TakeOff(self.flight.config.home.alt_m + height_m, nan)).verdict is Verdict.ACCEPTED
        self.start = self.pos.copy()
        self.is_watched = True

    @property
    def pos(self):
        return self.body[0]["pos_ned"].astype(float)

    def run(self, is_over, seconds):
        for _ in range(round(seconds * 50)):
            self.flight.frame()
            if self.is_watched:
                self._watch()
            if is_over():
                return
        raise AssertionError(f"not within {seconds:g} s: at {self.pos}, {self.state.mode}")

    def rest(self, seconds):
        end_us = self.flight.time_us + round(seconds * 1e6)
        self.run(lambda: self.flight.time_us >= end_us, seconds + 1.0)

    def _watch(self):
        if self.start[2] - self.pos[2] < LOW_M:
            x, y, _, _ = self.body[0]["q_ned_from_frd"]
            self.lean_deg = max(self.lean_deg, degrees(np.arccos(1.0 - 2.0 * float(x * x + y * y))))
            self.moved_m = max(self.moved_m, hypot(*(self.pos - self.start)[:2]))

    def target(self):
        latitude, longitude, _ = geodetic_from_ned(NORTH_M, 0.0, 0.0, self.flight.config.home)
        return latitude, longitude, self.flight.config.home.alt_m + HEIGHT_M


@pytest.mark.parametrize("pause_s", [0.1, 0.9, 1.1, 1.6])
def test_a_goto_on_take_off_is_taken_and_flown_once_the_vehicle_is_high(pause_s):
    """The vehicle lifts off 1 s after the command: the first two come before that."""
    vehicle = TakingOff()
    vehicle.rest(pause_s)
    assert (vehicle.state.landed_state is LandedState.ON_GROUND) is (pause_s < 1.0)
    assert vehicle.fc.request(GoTo(*vehicle.target(), nan, nan)).verdict is Verdict.ACCEPTED
    vehicle.run(lambda: hypot(*(vehicle.pos - (NORTH_M, 0.0, -HEIGHT_M))) < 1.5, 60.0)
    assert vehicle.lean_deg < LEAN_MAX_DEG
    assert vehicle.moved_m < 0.5


@pytest.mark.parametrize("pause_s", [0.5, 0.96, 1.02, 1.5])
def test_a_hold_before_the_goto_as_mavsdk_sends_it_changes_nothing(pause_s):
    vehicle = TakingOff()
    vehicle.rest(pause_s)
    assert vehicle.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    vehicle.rest(0.1)
    assert vehicle.fc.request(GoTo(*vehicle.target(), nan, nan)).verdict is Verdict.ACCEPTED
    vehicle.run(lambda: hypot(*(vehicle.pos - (NORTH_M, 0.0, -HEIGHT_M))) < 1.5, 60.0)
    assert vehicle.lean_deg < LEAN_MAX_DEG + 4.0  # it stops for a moment in between
    assert vehicle.moved_m < 0.5


def test_a_take_off_given_up_on_the_ground_is_not_flown_by_a_later_goto():
    vehicle = TakingOff()
    vehicle.rest(0.5)
    assert vehicle.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    vehicle.rest(4.0)
    reply = vehicle.fc.request(GoTo(*vehicle.target(), nan, nan))
    assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "not in the air")


def test_a_guided_goto_on_take_off_does_too():
    vehicle = TakingOff(Mode.GUIDED, height_m=10.0)
    vehicle.rest(0.5)
    assert vehicle.fc.request(GoTo(*vehicle.target(), nan, nan, mode=Mode.GUIDED)).verdict is Verdict.ACCEPTED
    vehicle.run(lambda: hypot(*(vehicle.pos - (NORTH_M, 0.0, -HEIGHT_M))) < 1.5, 60.0)
    assert vehicle.lean_deg < LEAN_MAX_DEG
    assert vehicle.moved_m < 0.5


def test_an_orbit_on_take_off_does_too():
    vehicle = TakingOff()
    vehicle.rest(0.5)
    latitude, longitude, _ = geodetic_from_ned(20.0, 0.0, 0.0, vehicle.flight.config.home)
    altitude = vehicle.flight.config.home.alt_m + 10.0
    request = OrbitRequest(10.0, 3.0, lat_deg=latitude, lon_deg=longitude, alt_amsl_m=altitude)
    assert vehicle.fc.request(request).verdict is Verdict.ACCEPTED
    vehicle.run(lambda: abs(hypot(vehicle.pos[0] - 20.0, vehicle.pos[1]) - 10.0) < 1.0 and vehicle.pos[2] < -9.0, 40.0)
    assert vehicle.lean_deg < LEAN_MAX_DEG
    assert vehicle.moved_m < 0.5


def test_following_on_take_off_does_too():
    vehicle = TakingOff()
    vehicle.rest(0.5)
    assert vehicle.fc.request(ChangeMode(Mode.FOLLOW)).verdict is Verdict.ACCEPTED
    for second in range(15):
        angle = 0.1 * second
        place = (30.0 * cos(angle), 30.0 * sin(angle), 0.0)
        vehicle.fc.request(TargetReport(place, (0.0, 0.0, 0.0), 0.5, 0.3))
        vehicle.rest(1.0)
    assert vehicle.state.mode is Mode.FOLLOW
    assert hypot(*vehicle.pos[:2]) > 5.0
    assert vehicle.lean_deg < LEAN_MAX_DEG
    assert vehicle.moved_m < 0.5


def test_holding_on_take_off_gives_up_the_goto():
    vehicle = TakingOff()
    vehicle.rest(1.2)
    assert vehicle.fc.request(GoTo(*vehicle.target(), nan, nan)).verdict is Verdict.ACCEPTED
    vehicle.rest(0.5)
    assert vehicle.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    vehicle.rest(8.0)
    assert hypot(*vehicle.pos[:2]) < 1.0


def test_a_second_goto_on_take_off_replaces_the_first():
    vehicle = TakingOff()
    vehicle.rest(0.5)
    assert vehicle.fc.request(GoTo(*vehicle.target(), nan, nan)).verdict is Verdict.ACCEPTED
    vehicle.rest(0.2)
    latitude, longitude, _ = geodetic_from_ned(-15.0, 0.0, 0.0, vehicle.flight.config.home)
    assert vehicle.fc.request(GoTo(latitude, longitude, vehicle.target()[2], nan, nan)).verdict is Verdict.ACCEPTED
    vehicle.run(lambda: hypot(*(vehicle.pos - (-15.0, 0.0, -HEIGHT_M))) < 1.5, 60.0)
    assert vehicle.moved_m < 0.5
