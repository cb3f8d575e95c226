"""GNSS lost while it follows, and the estimator takes what the companion sees: it goes on, or stays where it is."""

from math import dist, hypot
from types import SimpleNamespace

import numpy as np
import pytest

from autopilot.interface.failure_requests import Failure, Unit
from autopilot.interface.vehicle_state import Mode
from autopilot.ports import POSITION_VALID
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.vehicle_setup import BY_SIGHT
from policies.companion.engagement import Phase
from policies.companion.names import FOLLOWER
from policies.companion.odometry.by_sight import BACK_US
from tests.unit.mission.follow.follow_flight import advance, following, hide

SIGHT_LOST_S = 20.0
DRIFT_M_S = 0.1  # of a place that is reckoned from odometry; a velocity may be so wrong for long


def begun(parameters=None, **changed):
    """A flight that has followed by the policy that ships for some seconds."""
    pilot = any_pilot(FOLLOWER)
    pilot.reset()
    flight, companion = following(pilot=pilot, parameters=BY_SIGHT | (parameters or {}), **changed)
    advance(flight, 5.0)
    return flight, companion


def switch_gnss(flight, failure):
    flight.injector.inject(Unit.GNSS, failure, 0)


def place_ne(flight):
    return np.array(flight.rig.rows["truth"][0]["pos_ned"][:2])


def known_place_ne(companion):
    return np.array(companion.vehicle.own.pos_ned[:2])


@pytest.fixture(scope="module")
def outage():
    """An outage of 25 s while somebody walks, and 15 s after it: twice a second what was so."""
    flight, companion = begun()
    seen = SimpleNamespace(distances_m=[], errors_m_s=[], phases=set(), modes=set(), valid=[], before=place_ne(flight))

    def look(seconds):
        for _ in range(round(seconds * 2)):
            advance(flight, 0.5)
            truth = flight.rig.rows["truth"][0]
            seen.distances_m.append(dist(tuple(map(float, truth["pos_ned"])), flight.owner.chest_ned))
            seen.errors_m_s.append(np.array(companion.vehicle.own.vel_ned) - truth["vel_ned"])
            seen.phases.add(companion.phase)
            seen.modes.add(flight.controller.state.mode)
            seen.valid.append(bool(flight.controller.state.estimate.flags & POSITION_VALID))

    switch_gnss(flight, Failure.OFF)
    look(25.0)
    seen.sent = companion.skill._sight.count
    seen.way_m = float(hypot(*(place_ne(flight) - seen.before)))
    switch_gnss(flight, Failure.OK)
    look(15.0)
    seen.sent_after = companion.skill._sight.count
    seen.texts, seen.shift_m = list(flight.drone.texts), hypot(*companion.vehicle.frame.shift_ne)
    seen.is_crashed = flight.is_crashed
    flight.close()
    return seen


def test_it_follows_through_an_outage_of_25_s(outage):
    assert outage.phases == {Phase.FLYING}
    assert outage.modes == {Mode.OFFBOARD}
    assert not outage.is_crashed
    distances_m = np.array(outage.distances_m)
    assert distances_m.min() > 1.5
    assert np.mean((distances_m >= 1.0) & (distances_m <= 3.0)) > 0.9
    assert distances_m.max() < 5.0


def test_its_velocity_is_known_and_its_position_valid_all_the_time(outage):
    assert all(outage.valid)
    errors = np.array(outage.errors_m_s)[4:50]
    assert np.sqrt((errors**2).mean(0)).max() < 0.15


def test_it_measures_only_while_gnss_is_away_and_says_so_once(outage):
    assert 220 < outage.sent <= 250
    assert outage.sent_after - outage.sent < 10 * BACK_US * 1e-6 + 20
    assert [text for text in outage.texts if "GNSS" in text] == [
        "Companion: no GNSS: by sight",
        "Companion: GNSS is back",
    ]


def test_an_owner_who_is_gone_is_not_searched_by_sight_but_held_for_and_then_it_lands():
    flight, companion = begun({"EKF2_EVV_TOUT": 45.0}, settings={"sight_lost_s": SIGHT_LOST_S, "return_s": 5.0})
    switch_gnss(flight, Failure.OFF)
    advance(flight, 3.0)
    hide(flight)
    advance(flight, 4.0)
    stood_us, stood_ne, known_ne = flight.time_us, place_ne(flight), known_place_ne(companion)
    advance(flight, 20.0, lambda: companion.phase is not Phase.FLYING)
    advance(flight, 2.0)
    assert flight.controller.state.mode is Mode.HOLD
    advance(flight, 10.0)
    assert flight.controller.state.mode is Mode.HOLD  # nobody is sent home by what was flown since
    assert hypot(*(known_place_ne(companion) - known_ne)) < 1.0  # it stays, as far as it knows
    assert hypot(*(place_ne(flight) - stood_ne)) < DRIFT_M_S * (flight.time_us - stood_us) * 1e-6
    advance(flight, 40.0, lambda: not flight.controller.state.is_armed)
    assert not flight.controller.state.is_armed  # for longer than EKF2_EVV_TOUT nobody believes its position
    assert not flight.is_crashed
    assert not any("returning" in text for text in flight.drone.texts)
    flight.close()


def test_without_depth_there_is_no_odometry_and_it_lands_as_ever():
    flight, companion = begun(numbers={"depth_max_m": 0.0})
    switch_gnss(flight, Failure.OFF)
    advance(flight, 30.0, lambda: not flight.controller.state.is_armed)
    assert not flight.controller.state.is_armed
    assert not flight.is_crashed
    assert companion.skill._sight.count == 0
    flight.close()
