"""A plane in somebody's hands: held, thrown, picked up."""

from math import atan2, hypot

import numpy as np
import pytest

from common.airframe import load_airframe
from common.geodesy import GRAVITY_M_S2
from sim.bodies.plane_model import plane_model
from sim.hand import Hand
from sim.turntable import Turntable
from tests.unit.sim.plane_fleet import PlaneFleet

GLIDER = load_airframe("easyglider")
THROW = GLIDER.throw
FRAME_S = 0.02


def in_hand():
    fleet = PlaneFleet(model=plane_model(GLIDER, 0.0))
    hand = Hand(fleet.state, THROW)
    hand.take()
    return fleet, hand


def frames(fleet, hand, seconds, *, is_awaited=False, is_armed=True, wind_ned=(0.0, 0.0, 0.0)):
    for _ in range(round(seconds / FRAME_S)):
        hand.frame(is_awaited=is_awaited, is_armed=is_armed)
        fleet.fly(FRAME_S, (0.0,), wind_ned=wind_ned)


def test_it_is_held_still_and_feels_its_weight_and_the_wind():
    fleet, hand = in_hand()
    before = fleet.state["pos_ned"].copy()
    frames(fleet, hand, 3.0, wind_ned=(-4.0, 0.0, 0.0))
    assert fleet.state["pos_ned"] == pytest.approx(before)
    assert fleet.state["accel_frd"][0] == pytest.approx((0.0, 0.0, -GRAVITY_M_S2), abs=1e-4)
    assert fleet.state["height_agl_m"][0] == pytest.approx(THROW.height_m + GLIDER.belly.depth_m, abs=0.02)
    assert fleet.state["pitot_pa"][0] == pytest.approx(0.5 * 1.225 * 4.0**2, rel=1e-2)


def test_nobody_throws_before_it_is_awaited():
    fleet, hand = in_hand()
    frames(fleet, hand, 5.0)
    assert hand.is_holding
    frames(fleet, hand, 0.9, is_awaited=True)
    assert fleet.state["vel_ned"][0, 0] == 0.0
    frames(fleet, hand, 1.0, is_awaited=True)
    assert not hand.is_holding


def test_a_throw_ends_at_its_speed_and_elevation_and_is_felt():
    fleet, hand = in_hand()
    assert hand.throw()
    felt = []
    while hand.is_holding:
        hand.frame(is_awaited=False, is_armed=True)
        if hand.is_holding:
            fleet.fly(FRAME_S)
            felt.append(fleet.state["accel_frd"][0].copy())
    north, east, down = fleet.state["vel_ned"][0]
    assert hypot(north, east, down) == pytest.approx(THROW.speed_m_s, rel=0.07)  # a frame more or less of 15
    assert atan2(-down, north) == pytest.approx(THROW.elevation_rad, abs=1e-3)
    assert len(felt) * FRAME_S == pytest.approx(THROW.stroke_s, abs=FRAME_S)
    # What it feels is its motion without gravity: summed, it is the speed that it has got.
    gained = np.sum(felt, axis=0) * FRAME_S + np.array((0.0, 0.0, GRAVITY_M_S2)) * FRAME_S * len(felt)
    assert gained == pytest.approx((north, east, down), abs=1e-3)


def test_it_is_thrown_once():
    _, hand = in_hand()
    assert hand.throw()
    assert not hand.throw()


def test_it_is_picked_up_where_it_lies_if_it_is_not_armed():
    fleet, hand = in_hand()
    hand.throw()
    frames(fleet, hand, 15.0)
    assert fleet.state["is_on_ground"][0] == 1
    lies = fleet.state["pos_ned"][0].copy()
    frames(fleet, hand, 20.0)
    assert not hand.is_holding
    frames(fleet, hand, 10.0, is_armed=False)
    assert hand.is_holding
    up = fleet.state["pos_ned"][0]
    assert up[:2] == pytest.approx(lies[:2], abs=0.2)
    assert lies[2] - up[2] == pytest.approx(THROW.height_m, rel=0.06)
    assert fleet.state["vel_ned"][0] == pytest.approx((0.0, 0.0, 0.0))
    assert fleet.state["q_ned_from_frd"][0, :2] == pytest.approx((0.0, 0.0), abs=1e-2)


def test_who_holds_it_after_a_throw_holds_it_still():
    fleet, hand = in_hand()
    hand.throw()
    frames(fleet, hand, 1.0)
    assert not hand.is_holding
    fleet.state["vel_ned"] = 0.0
    before = fleet.state["pos_ned"].copy()
    Turntable(fleet.state).show(0.0, 0.0)  # as a calibration does
    fleet.fly(0.5)
    assert fleet.state["pos_ned"] == pytest.approx(before)


def test_wreckage_is_left_where_it_is():
    fleet, hand = in_hand()
    hand.throw()
    frames(fleet, hand, 15.0)
    fleet.state["is_crashed"] = 1
    frames(fleet, hand, 20.0, is_armed=False)
    assert not hand.is_holding
