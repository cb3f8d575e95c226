"""Gripper, winch, traffic and RTK of the simulation."""

from math import hypot, nan

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Verdict
from common.geodesy import DEFAULT_HOME, ned_from_geodetic
from sim.devices import ABANDON_LINE, DELIVER, GRIPPER, LOAD_LINE, LOCK, RATE, RELATIVE, RETRACT, WINCH, Gripper, Winch
from sim.simulated_traffic import HEARD_WITHIN_M, SimulatedTraffic


class Clock:
    def __init__(self):
        self.now_us = 0

    def __call__(self):
        return self.now_us

    def run(self, seconds):
        self.now_us += int(seconds * 1e6)


def winch():
    clock = Clock()
    return clock, Winch(clock)


def act(device, action, length=nan, rate=nan):
    return device.run(WINCH, (0.0, float(action), length, rate), nan, nan, nan).verdict


def test_gripper_grabs_and_releases():
    gripper = Gripper()
    assert gripper.run(GRIPPER, (0.0, 1.0, nan, nan), nan, nan, nan).verdict is Verdict.ACCEPTED
    assert gripper.holds
    gripper.run(GRIPPER, (0.0, 0.0, nan, nan), nan, nan, nan)
    assert not gripper.holds
    assert gripper.run(GRIPPER, (0.0, 5.0, nan, nan), nan, nan, nan).verdict is Verdict.DENIED


def test_line_runs_out_at_its_rate_and_stops_at_its_length():
    clock, device = winch()
    assert act(device, RELATIVE, 3.0, 1.0) is Verdict.ACCEPTED
    clock.run(1.0)
    assert device.status().length_m == pytest.approx(1.0)
    assert device.status().rate_m_s == 1.0
    clock.run(10.0)
    assert device.status().length_m == pytest.approx(3.0)
    assert device.status().rate_m_s == 0.0
    act(device, RETRACT)
    clock.run(3.0)
    assert device.status().length_m == pytest.approx(1.5)
    clock.run(10.0)
    assert device.status().flags & 2  # retracted


def test_line_can_be_stopped_and_lost():
    clock, device = winch()
    act(device, DELIVER)
    clock.run(4.0)
    act(device, LOCK)
    clock.run(4.0)
    assert device.status().length_m == pytest.approx(2.0)
    act(device, ABANDON_LINE)
    assert act(device, DELIVER) is Verdict.FAILED
    assert act(device, LOAD_LINE) is Verdict.ACCEPTED
    assert act(device, DELIVER) is Verdict.ACCEPTED


def test_impossible_moves_are_refused():
    _, device = winch()
    assert act(device, RELATIVE, 100.0, 1.0) is Verdict.DENIED
    assert act(device, RELATIVE, -1.0, 1.0) is Verdict.DENIED
    assert act(device, RATE, nan, 50.0) is Verdict.DENIED
    assert act(device, 99) is Verdict.DENIED


def test_aircraft_fly_straight_at_their_speed_and_come_again():
    traffic = SimulatedTraffic(5, DEFAULT_HOME, 1)
    before, after = traffic.heard(0), traffic.heard(1_000_000)
    for a, b in zip(before, after, strict=True):
        positions = [np.array(ned_from_geodetic(c.lat_deg, c.lon_deg, c.alt_amsl_m, DEFAULT_HOME)) for c in (a, b)]
        moved = hypot(*(positions[1] - positions[0])[:2])
        assert moved == pytest.approx(a.speed_m_s, rel=0.01) or moved > HEARD_WITHIN_M
    assert traffic.heard(77_000_000) == SimulatedTraffic(5, DEFAULT_HOME, 1).heard(77_000_000)
