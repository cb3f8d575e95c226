"""The rover's law on the simulator's body, with the truth for an estimate and with sensors and estimator."""

from functools import cache
from math import degrees, radians, sqrt

import numpy as np
import pytest

from tests.unit.autopilot.vehicles.rover.rig import RoverRig, to

AIRFRAMES = ["rover", "rover-skid"]
LATERAL_M_S2 = 3.0
SIDE_M = 40.0
CORNERS = [(0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M)]


@cache
def drives(airframe: str, slope_deg: float):
    """A drive of each kind, 20 s, side by side."""
    rig = RoverRig(7, airframe, slope_deg=slope_deg)
    fast = 1.8 if airframe == "rover-skid" else 5.0
    rig.ports[0].drive(speed=fast, yaw=0.0)
    rig.ports[1].drive(speed=-1.0, yaw=0.0)
    rig.ports[2].drive(speed=1.5, yaw_rate=0.5)
    to(rig.ports[3], 15.0, 10.0)
    to(rig.ports[4], -2.0, 0.3)
    rig.ports[5].drive(speed=0.0, yaw=radians(90.0))
    rig.ports[6].drive(speed=-1.0, yaw_rate=0.3)
    rig.run(1000)
    return fast, rig.track()


@pytest.mark.parametrize("slope_deg", [0.0, 15.0])
@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_a_speed_is_held_forward_and_backwards(airframe, slope_deg):
    fast, track = drives(airframe, slope_deg)
    if slope_deg == 0.0:  # uphill the motor has not the force for the greatest speed
        assert np.abs(track.speed[400:, 0] - fast).max() < 0.1
    assert np.abs(track.speed[400:, 1] + 1.0).max() < 0.1


@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_a_heading_is_held_and_nothing_chatters(airframe):
    _, track = drives(airframe, 0.0)
    for row in (0, 1):
        assert np.abs(np.degrees(track.yaw[400:, row])).max() < 1.0
        assert np.ptp(track.command[600:, row], axis=0).max() < 0.01


@pytest.mark.parametrize("airframe", AIRFRAMES)
@pytest.mark.parametrize(("row", "rate"), [(2, 0.5), (6, 0.3)])
def test_a_yaw_rate_is_followed_forward_and_backwards(airframe, row, rate):
    _, track = drives(airframe, 0.0)
    assert track.yaw_rate[600:, row].mean() == pytest.approx(rate, abs=0.02)


@pytest.mark.parametrize("slope_deg", [0.0, 15.0])
@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_a_place_is_reached_and_stood_at_braked(airframe, slope_deg):
    _, track = drives(airframe, slope_deg)
    for row, place in ((3, (15.0, 10.0)), (4, (-2.0, 0.3))):
        assert np.linalg.norm(track.pos[-1, row, :2] - place) < 0.5
        assert np.linalg.norm(track.pos[-1, row] - track.pos[-100, row]) < 0.01
        assert track.command[-1, row, 2] == 1.0


def test_a_place_behind_is_reached_backwards_with_the_nose_as_it_was():
    _, track = drives("rover", 0.0)
    assert abs(degrees(track.yaw[-1, 4])) < 45.0


def test_skid_steer_turns_on_the_spot_and_a_car_stays():
    _, skid = drives("rover-skid", 0.0)
    assert degrees(skid.yaw[-1, 5]) == pytest.approx(90.0, abs=1.0)
    assert np.linalg.norm(skid.pos[-1, 5, :2]) < 0.05
    _, car = drives("rover", 0.0)
    assert abs(car.yaw[-1, 5]) < 0.01


def drive_corners(speeds, *, has_estimator):
    """Three legs with right turns at each speed; position by truth or estimate, the leg and the speed, per frame."""
    rig = RoverRig(len(speeds), has_estimator=has_estimator)
    rig.run(1)
    rig.track()
    legs, kept = [0] * len(speeds), []

    def each(rig, _):
        rows = rig.rig.rows["autopilot.ekf.rows"]["estimate"] if has_estimator else rig.truth
        places = rows["pos_ned"][:, :2].copy()
        for i, speed in enumerate(speeds):
            radius = 1.0 if speed < 3.0 else 3.0
            is_near = np.linalg.norm(places[i] - CORNERS[legs[i]]) < radius
            if legs[i] == 0 or (is_near and legs[i] < 3):
                legs[i] += 1
                is_last = legs[i] == 3
                to(
                    rig.ports[i],
                    *CORNERS[legs[i]],
                    start=CORNERS[legs[i] - 1],
                    cruise_speed=speed,
                    exit_speed=0.0 if is_last else min(speed, sqrt(LATERAL_M_S2 * radius)),
                    pass_radius=0.0 if is_last else radius,
                )
        kept.append((places, list(legs)))

    rig.run(int(1.3 * 3.0 * SIDE_M / min(speeds) / 0.02) + 250, each)
    places, legs_seen = zip(*kept, strict=True)
    return np.array(places), np.array(legs_seen), rig.track()


@pytest.mark.parametrize("has_estimator", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_lines_are_kept_and_corners_hardly_overshot(has_estimator):
    speeds = [2.0, 3.0, 5.0]
    places, legs, track = drive_corners(speeds, has_estimator=has_estimator)
    for i in range(len(speeds)):
        off = []
        for leg in (1, 2, 3):
            ahead = (np.array(CORNERS[leg]) - CORNERS[leg - 1]) / SIDE_M
            offset = places[legs[:, i] == leg, i] - CORNERS[leg - 1]
            across = ahead[0] * offset[:, 1] - ahead[1] * offset[:, 0]
            along = offset @ ahead
            off.extend(np.abs(across[(along > 6.0) & (along < SIDE_M - 4.0)]))
            if leg > 1 and not has_estimator:
                assert -across.min() < 0.4
        assert np.percentile(off, 95.0) < 0.3
        assert np.linalg.norm(places[-1, i] - CORNERS[3]) < 0.5
        assert abs(track.speed[-1, i]) < 0.01


def test_a_rover_pushed_away_drives_back_and_stands():
    rig = RoverRig(4)
    for port in rig.ports:
        to(port, 5.0, 0.0)
    rig.run(300)
    rig.track()
    for i, push in enumerate([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, 0.2)]):
        rig.rig.rows["body"]["pos_ned"][i][:2] += push
    rig.run(500)
    track = rig.track()
    for i in range(4):
        assert np.linalg.norm(track.pos[-1, i, :2] - (5.0, 0.0)) < 0.4
        assert track.command[-1, i, 2] == 1.0
    assert np.abs(track.speed[:, 3]).max() < 0.05  # within what is held: it stays


def test_a_rover_that_stands_does_not_drive_after_its_estimate():
    """Each row has noise of its own; some of them wander by more than what is held."""
    rig = RoverRig(8, has_estimator=True)
    estimate = rig.rig.rows["autopilot.ekf.rows"]["estimate"]
    begins = estimate["pos_ned"][:, :2].copy()
    for port, place in zip(rig.ports, begins, strict=True):
        to(port, *place)
    wandered = []
    rig.run(3000, lambda _rig, _frame: wandered.append(np.linalg.norm(estimate["pos_ned"][:, :2] - begins, axis=1)))
    assert np.max(wandered) > rig.table["HG_RO_HOLD_RAD"]
    assert np.abs(rig.track().speed).max() < 0.05


def test_disarmed_the_motor_is_off_and_the_brake_on():
    rig = RoverRig(1)
    rig.ports[0].drive(speed=2.0, yaw=0.0)
    rig.run(150)
    rig.ports[0].set_flags(is_armed=False, is_landed=True)
    rig.run(150)
    track = rig.track()
    assert list(track.command[150, 0]) == [0.0, 0.0, 1.0]
    assert abs(track.speed[-1, 0]) < 0.01
