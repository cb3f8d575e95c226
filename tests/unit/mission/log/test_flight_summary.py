"""Figures of synthetic histories whose answers are known."""

import json
from math import cos, inf, isnan, nan, sin

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.client import Running, ScriptError
from mission.flight import Flight, FlightConfig
from mission.log.flight_recorder import History
from mission.log.flight_summary import (
    clearance_min_m,
    cross_track_m,
    estimator_errors,
    planned_path,
    segment_distance_m,
    summarise,
)
from mission.plan.plan_file import DEFAULT_PLAN, Plan, PlanItem, read_plan
from sim.world.batch import grown_world
from sim.world.driving_worlds import COURSE
from sim.world.world import WorldConfig, build_world


def history_of(frames, **changes):
    """Frames in which nothing happens, with changes."""
    level = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 1))
    fields = {
        "time_us": np.arange(1, frames + 1) * 20_000,
        "pos_ned_true": np.zeros((frames, 3)),
        "vel_ned_true": np.zeros((frames, 3)),
        "q_true": level,
        "pos_ned_est": np.zeros((frames, 3)),
        "vel_ned_est": np.zeros((frames, 3)),
        "q_est": level,
        "is_armed": np.ones(frames, bool),
        "mode": np.full(frames, int(Mode.MISSION)),
        "mission_seq": np.zeros(frames, int),
        "battery_remaining": np.ones(frames),
        "airspeed": np.full(frames, np.nan),
    }
    return History(**fields | changes)


def turned(angle, axis):
    """Quaternions (x, y, z, w) that turn by an angle about ned axis 0, 1 or 2."""
    q = np.zeros((10, 4))
    q[:, axis], q[:, 3] = sin(angle / 2), cos(angle / 2)
    return q


@pytest.mark.parametrize(
    ("point", "distance"),
    [((5.0, 3.0, 0.0), 3.0), ((-4.0, 3.0, 0.0), 5.0), ((13.0, 0.0, 4.0), 5.0), ((7.0, 0.0, 0.0), 0.0)],
)
def test_distance_to_a_segment(point, distance):
    measured = segment_distance_m(np.array([point]), np.zeros(3), np.array([10.0, 0.0, 0.0]))
    assert measured == pytest.approx([distance])


def test_distance_to_a_segment_without_length():
    assert segment_distance_m(np.array([[3.0, 4.0, 0.0]]), np.zeros(3), np.zeros(3)) == pytest.approx([5.0])


def test_cross_track_is_measured_to_the_present_leg_and_the_one_before():
    path = [(-1, np.zeros(3)), (0, np.array([0.0, 0.0, -10.0])), (2, np.array([50.0, 0.0, -10.0]))]
    pos = np.array([[1.0, 0.0, -5.0], [25.0, 2.0, -10.0], [0.0, 1.5, -2.0], [99.0, 0.0, 0.0]])
    distances = cross_track_m(pos, np.array([0, 2, 2, 1]), path)
    assert distances[1:3] == pytest.approx([2.0, 1.5])
    assert isnan(distances[0])  # the take-off is no leg
    assert isnan(distances[3])  # item 1 is no place


def test_cross_track_is_not_measured_where_the_way_is_no_straight_line():
    path = [(-1, np.zeros(3)), (0, np.array([0.0, 0.0, -10.0])), (1, np.array([50.0, 0.0, -10.0]))]
    path.append((2, np.array([90.0, 0.0, -10.0])))
    pos = np.array([[0.0, 0.0, -10.0], [25.0, 9.0, -10.0], [70.0, 1.0, -10.0]])
    distances = cross_track_m(pos, np.array([0, 1, 2]), path, {1})
    assert isnan(distances[1])
    assert distances[2] == pytest.approx(1.0)


def test_cross_track_follows_a_jump_back():
    path = [(-1, np.zeros(3)), (1, np.array([0.0, 0.0, -10.0])), (2, np.array([50.0, 0.0, -10.0]))]
    path.append((3, np.array([50.0, 50.0, -10.0])))
    pos = np.zeros((5, 3))
    pos[:, 2] = -10.0
    pos[1:, :2] = [(25.0, 0.0), (50.0, 25.0), (50.0, 24.0), (50.0, 3.0)]
    assert cross_track_m(pos, np.array([1, 2, 3, 2, 2]), path)[1:] == pytest.approx(np.zeros(4))


def test_perfect_estimates_have_no_error():
    errors = estimator_errors(history_of(10), np.ones(10, bool))
    assert (*errors.pos_ned_m, *errors.vel_ned_m_s, errors.tilt_deg, errors.yaw_deg) == (0.0,) * 8


def test_errors_are_root_mean_squares_per_axis():
    offset = np.zeros((10, 3))
    offset[:5, 0], offset[:, 2] = 2.0, -1.0
    errors = estimator_errors(history_of(10, pos_ned_est=offset, vel_ned_est=0.5 * offset), np.ones(10, bool))
    assert errors.pos_ned_m == pytest.approx((np.sqrt(2.0), 0.0, 1.0))
    assert errors.vel_ned_m_s == pytest.approx((np.sqrt(0.5), 0.0, 0.5))


@pytest.mark.parametrize(("axis", "is_tilt"), [(0, True), (1, True), (2, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])  # q and -q are the same attitude
def test_attitude_error_is_tilt_or_yaw_by_its_axis(axis, is_tilt, sign):
    errors = estimator_errors(history_of(10, q_est=sign * turned(0.02, axis)), np.ones(10, bool))
    degrees = np.degrees(0.02)
    assert (errors.tilt_deg, errors.yaw_deg) == pytest.approx((degrees, 0.0) if is_tilt else (0.0, degrees), rel=1e-3)


def test_only_the_chosen_frames_count():
    offset = np.zeros((10, 3))
    offset[5:] = 100.0
    frames = np.arange(10) < 5
    assert estimator_errors(history_of(10, pos_ned_est=offset), frames).pos_ned_m == (0.0, 0.0, 0.0)
    assert isnan(estimator_errors(history_of(10), np.zeros(10, bool)).tilt_deg)


def test_clearance_is_to_the_nearest_trunk_while_armed():
    world = build_world(WorldConfig(trees_per_ha=60.0))
    pos = np.array([[40.0, 40.0, -3.0]] * 20)
    expected = float(np.min(world.obstacle_distance(pos[:1])))
    assert clearance_min_m(history_of(20, pos_ned_true=pos), world) == pytest.approx(expected)
    assert isnan(clearance_min_m(history_of(20, is_armed=np.zeros(20, bool)), world))
    open_world = build_world(WorldConfig(trees_per_ha=0.0))
    assert clearance_min_m(history_of(20), open_world) == inf


def item(seq, command, north=0.0, east=0.0, height=10.0, frame=3):
    latitude, longitude, _ = geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)
    return PlanItem(seq, frame, command, (0.0, 0.0, 0.0, nan), latitude, longitude, height)


def test_planned_path_names_the_places_in_order():
    speed = PlanItem(1, 2, 178, (1.0, 5.0, -1.0, 0.0), 0.0, 0.0, 0.0)
    plan = Plan((item(0, 22), speed, item(2, 16, 20.0, 5.0), item(3, 16, 20.0, 9.0, 500.0, frame=0), item(4, 20)))
    path = planned_path(plan, DEFAULT_HOME)
    assert [seq for seq, _ in path] == [-1, 0, 2, 3, 4]
    np.testing.assert_allclose(path[1][1], [0.0, 0.0, -10.0], atol=1e-3)
    np.testing.assert_allclose(path[2][1], [20.0, 5.0, -10.0], atol=1e-3)
    np.testing.assert_allclose(path[3][1], [20.0, 9.0, DEFAULT_HOME.alt_m - 500.0], atol=1e-3)
    np.testing.assert_allclose(path[4][1], [0.0, 0.0, 0.0])  # the return leads home


def test_landing_without_a_place_is_where_the_path_has_led():
    here = PlanItem(1, 3, 21, (0.0, 0.0, 0.0, nan), 0.0, 0.0, 0.0)
    path = planned_path(Plan((item(0, 16, 30.0, -4.0), here)), DEFAULT_HOME)
    np.testing.assert_allclose(path[-1][1], [30.0, -4.0, 0.0], atol=1e-3)


def test_default_plan_begins_and_ends_in_the_clearing():
    path = planned_path(read_plan(DEFAULT_PLAN), DEFAULT_HOME)
    assert len(path) >= 5
    assert np.hypot(*path[-1][1][:2]) < 15.0


@pytest.fixture
def flight():
    flight = Flight(FlightConfig(world=WorldConfig(trees_per_ha=0.0)))
    flight.frame()
    yield flight
    flight.close()


def script_that(error=None):
    async def script():
        if error:
            raise ScriptError(error)

    running = Running(script())
    running.step()
    return running


def test_result_is_that_of_the_script(flight):
    history = history_of(10)
    assert summarise(flight, history, script_that(), []).result == "mission completed"
    failed = summarise(flight, history, script_that("no answer"), [])
    assert (failed.result, failed.is_success) == ("failed: no answer", False)
    idle = summarise(flight, history, None, [])
    assert (idle.result, idle.is_success) == ("no mission", True)


def test_a_crash_is_no_success_whatever_the_script_says(flight):
    flight.rig.rows["truth"]["is_crashed"][0] = 1
    summary = summarise(flight, history_of(10), script_that(), [])
    assert (summary.result, summary.is_success) == ("crashed", False)


def test_landing_error_is_from_the_last_place_and_only_after_a_landing(flight):
    path = [(-1, np.zeros(3)), (0, np.array([3.0, 4.0, 0.0]))]
    landed = history_of(10, is_armed=np.arange(10) < 9)
    assert summarise(flight, landed, script_that(), path).landing_error_true_m == pytest.approx(5.0)
    assert isnan(summarise(flight, history_of(10), script_that(), path).landing_error_true_m)
    never_armed = history_of(10, is_armed=np.zeros(10, bool))
    assert isnan(summarise(flight, never_armed, script_that(), path).landing_error_true_m)


def test_json_has_null_for_what_is_not_known(flight):
    never_armed = history_of(10, is_armed=np.zeros(10, bool))
    text = json.dumps(summarise(flight, never_armed, None, []).as_json(), allow_nan=False)
    figures = json.loads(text)
    assert figures["cross_track_p95_m"] is None
    assert figures["simulated_s"] == pytest.approx(0.2)
    assert figures["innovations_in_band"]["gnss_pos"] is None


def test_clearance_to_a_box_that_moves_is_to_where_it_was_then():
    world = grown_world(COURSE.model_copy(update={"trees_per_ha": 0.0}), 3)
    mover = int(np.flatnonzero(world.boxes.rows["period_ticks"])[0])
    frames = np.arange(1, 1001)
    nearest_m = []
    for frame in (1, 501):  # it moves away from one, towards the other
        history = history_of(1000, is_armed=frames == frame)
        tick = 5 * frame
        there = np.array([*world.boxes.middle(tick)[mover], -float(world.boxes.rows[mover]["low"]) - 0.1])
        history.pos_ned_true[:] = there
        nearest_m.append(clearance_min_m(history, world))
    assert max(nearest_m) < 0.0  # inside the box, both times
