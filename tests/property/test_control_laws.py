"""Laws of the controller: allocation gives back what it leaves, trajectories keep their limits and arrive."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from autopilot.vehicles.multirotor.control_airframe import effectiveness
from common.airframe import load_airframe
from tests.unit.autopilot.vehicles.multirotor.generator import FRAME_S, Generator
from tests.unit.autopilot.vehicles.multirotor.mixer import mix, with_rotors

LAWS = settings(max_examples=60, deadline=None)
X500 = load_airframe("x500")
ACCEL_XY, ACCEL_UP, ACCEL_DOWN, JERK = 4.0, 4.0, 3.0, 20.0  # defaults of MPC_ACC_* and MPC_JERK_MAX
SPEED_XY, SPEED_UP, SPEED_DOWN = 5.0, 3.0, 1.5  # of MPC_XY_CRUISE, MPC_Z_V_AUTO_*
ROUNDING = 1.0 + 1.0e-3  # float32 differences over 20 ms

torques = st.tuples(*(st.floats(-3.0, 3.0, width=32) for _ in range(3)))
offsets = st.tuples(*(st.floats(-40.0, 40.0, width=32) for _ in range(3)))


@LAWS
@given(count=st.sampled_from([3, 4, 5, 6, 8]), torque=torques, collective=st.floats(0.0, 60.0, width=32))
def test_allocation_stays_within_limits_and_leaves_exactly_the_remainder(
    count: int, torque: tuple[float, float, float], collective: float
) -> None:
    airframe = with_rotors(X500, count)
    low, high = 0.2, 8.5
    result = mix(airframe, [torque], [collective], low, high)[0][0]
    thrusts = result["thrust_n"][:count].astype(float)
    assert thrusts.min() >= low
    assert thrusts.max() <= high
    achieved = effectiveness(airframe) @ thrusts
    np.testing.assert_allclose(result["torque_short_frd"], np.array(torque) - achieved[:3], atol=2e-5)
    np.testing.assert_allclose(result["collective_short_n"], collective - achieved[3], atol=2e-5)


@LAWS
@given(thrusts=st.lists(st.floats(0.3, 8.4), min_size=4, max_size=4))
def test_allocation_inverts_what_rotors_can_make(thrusts: list[float]) -> None:
    demand = effectiveness(X500) @ np.array(thrusts)
    result = mix(X500, [demand[:3]], [demand[3]], 0.2, 8.5)[0][0]
    np.testing.assert_allclose(result["thrust_n"][:4], thrusts, atol=2e-4)
    np.testing.assert_allclose(result["torque_short_frd"], 0.0, atol=2e-5)


@LAWS
@given(first=offsets, second=offsets, after_s=st.floats(0.1, 6.0))
def test_trajectory_keeps_its_limits_and_reaches_its_goal(
    first: tuple[float, float, float], second: tuple[float, float, float], after_s: float
) -> None:
    generator = Generator()
    generator.ask(pos_ned=first)
    before = generator.run(after_s)[0]
    generator.ask(pos_ned=second)
    log = np.concatenate([before, generator.run(70.0)[0]])
    vel, accel = log["vel_ned"].astype(float), log["accel_ned"].astype(float)
    jerk = np.diff(accel, axis=0) / FRAME_S
    # along and across the way each have the limit, so a vector that has both may reach sqrt(2) times it
    assert np.linalg.norm(accel[:, :2], axis=1).max() <= np.sqrt(2.0) * ACCEL_XY * ROUNDING
    assert np.linalg.norm(jerk[:, :2], axis=1).max() <= np.sqrt(2.0) * JERK * ROUNDING
    assert np.linalg.norm(vel[:, :2], axis=1).max() <= np.sqrt(2.0) * SPEED_XY * ROUNDING
    assert vel[:, 2].max() <= SPEED_DOWN * ROUNDING
    assert vel[:, 2].min() >= -SPEED_UP * ROUNDING
    assert accel[:, 2].max() <= ACCEL_DOWN * ROUNDING
    assert accel[:, 2].min() >= -ACCEL_UP * ROUNDING
    assert np.abs(jerk[:, 2]).max() <= JERK * ROUNDING
    np.testing.assert_allclose(log["pos_ned"][-1], second, atol=1e-4)
    np.testing.assert_array_equal(vel[-1], (0.0, 0.0, 0.0))


@LAWS
@given(goal=offsets)
def test_trajectory_from_rest_keeps_the_limits_of_its_way(goal: tuple[float, float, float]) -> None:
    assume(np.hypot(goal[0], goal[1]) > 0.06)  # nearer goals keep the direction of the last way
    generator = Generator()
    generator.ask(pos_ned=goal)
    log = generator.run(45.0)[0]
    accel = log["accel_ned"].astype(float)
    assert np.linalg.norm(accel[:, :2], axis=1).max() <= ACCEL_XY * ROUNDING
    assert np.linalg.norm(np.diff(accel[:, :2], axis=0), axis=1).max() / FRAME_S <= JERK * ROUNDING
    assert np.linalg.norm(log["vel_ned"][:, :2], axis=1).max() <= SPEED_XY * ROUNDING
    beyond = (np.abs(log["pos_ned"]) - np.abs(np.array(goal))).max()
    assert beyond < 1e-3  # no overshoot


@LAWS
@given(
    goal=offsets,
    after_s=st.floats(0.1, 6.0),
    away=offsets,
    jump=offsets,
    cruise=st.floats(0.5, 12.0),
    is_path=st.booleans(),
)
def test_velocity_points_back_to_a_trajectory_out_of_reach_within_the_speed_limits(
    goal: tuple[float, float, float],
    after_s: float,
    away: tuple[float, float, float],
    jump: tuple[float, float, float],
    cruise: float,
    is_path: bool,
) -> None:
    offset = np.array(away)
    is_far_xy = is_far_z = np.linalg.norm(offset) > 2.1  # MPC_XY_ERR_MAX
    if not is_path:
        is_far_xy, is_far_z = np.hypot(*offset[:2]) > 2.1, abs(offset[2]) > 2.1
    generator = Generator()
    start = (0.0, 0.0, 0.0) if is_path else (np.nan,) * 3
    generator.ask(pos_ned=goal, path_start_ned=start, cruise_speed=cruise)
    generator.run(after_s)
    estimates = generator.estimates.numpy()
    estimates["pos_ned"] += offset
    estimates["vel_reset_ned"] = jump
    estimates["reset_count"] += 1
    for _ in range(3):
        command = generator.command()[0].astype(float)
        back = generator.states.numpy()["pos_ned"][0] - estimates["pos_ned"][0]
        assert not is_far_xy or command[:2] @ back[:2] > 0.0 or np.hypot(*offset[:2]) < 1.0e-3
        assert not is_far_z or command[2] * back[2] > 0.0 or abs(offset[2]) < 1.0e-3
        assert np.hypot(command[0], command[1]) <= 12.0 * ROUNDING  # MPC_XY_VEL_MAX
        assert -SPEED_UP * ROUNDING <= command[2] <= SPEED_DOWN * ROUNDING


@LAWS
@given(start=offsets, way=offsets)
def test_path_is_a_straight_line(start: tuple[float, float, float], way: tuple[float, float, float]) -> None:
    begin, end = np.array(start), np.array(start) + np.array(way)
    length = np.linalg.norm(way)
    generator = Generator()
    generator.estimates.numpy()["pos_ned"] = begin
    generator.ask(pos_ned=end, path_start_ned=begin)
    pos = generator.run(70.0)[0]["pos_ned"].astype(float) - begin
    np.testing.assert_allclose(pos[-1], way, atol=1e-3)
    if length > 0.2:
        along = np.array(way) / length
        cross = np.linalg.norm(pos - np.outer(pos @ along, along), axis=1)
        assert cross.max() < 1e-3  # float32 at up to 80 m from the origin, and where the line is steep


@LAWS
@given(first=offsets, second=offsets)
def test_velocity_setpoints_are_reached_within_limits(
    first: tuple[float, float, float], second: tuple[float, float, float]
) -> None:
    generator = Generator()
    goals = [np.array(goal) * (0.2, 0.2, 0.03) for goal in (first, second)]
    generator.ask(vel_ned=goals[0])
    before = generator.run(1.0)[0]
    generator.ask(vel_ned=goals[1])
    log = np.concatenate([before, generator.run(9.0)[0]])
    accel = log["accel_ned"].astype(float)
    assert np.linalg.norm(accel[:, :2], axis=1).max() <= np.sqrt(2.0) * ACCEL_XY * ROUNDING
    assert np.abs(np.diff(accel[:, 2])).max() / FRAME_S <= JERK * ROUNDING
    np.testing.assert_allclose(log["vel_ned"][-1], goals[1], atol=1e-4)
