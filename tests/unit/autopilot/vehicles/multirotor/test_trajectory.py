import numpy as np
import pytest

from tests.unit.autopilot.vehicles.multirotor.generator import FRAME_S, Generator

NAN = float("nan")


def test_trajectory_to_a_position_is_straight_and_ends_exactly_there() -> None:
    generator = Generator()
    generator.ask(pos_ned=(6.0, 8.0, 0.0))
    pos = generator.run(8.0)["pos_ned"][0]
    assert np.abs(pos[:, 0] * 0.8 - pos[:, 1] * 0.6).max() < 1e-5  # float32 rounding at 10 m
    np.testing.assert_allclose(pos[-1], (6.0, 8.0, 0.0), atol=1e-6)


def test_trajectory_of_a_five_metre_step_takes_the_time_optimal_duration() -> None:
    generator = Generator()
    generator.ask(pos_ned=(5.0, 0.0, 0.0))
    pos = generator.run(4.0)["pos_ned"][0]
    arrived = FRAME_S * (1 + np.flatnonzero(np.abs(pos[:, 0] - 5.0) > 1e-3)[-1])
    # distance = v (v / a + a / j) at peak speed v below the cruise speed, duration = 2 (v / a + a / j), a = 4, j = 20
    ramp = 4.0 / 20.0
    speed = 4.0 * (-ramp + np.sqrt(ramp**2 + 4.0 * 5.0 / 4.0)) / 2.0
    assert arrived == pytest.approx(2.0 * (speed / 4.0 + ramp), abs=0.1)  # the last millimetre is slow


def test_cruise_climb_and_descend_speeds_of_the_setpoint_are_kept() -> None:
    generator = Generator()
    generator.ask(pos_ned=(60.0, 0.0, -20.0), cruise_speed=7.0, climb_speed=1.2)
    vel = generator.run(10.0)["vel_ned"][0]
    assert vel[:, 0].max() == pytest.approx(7.0, abs=1e-4)
    assert vel[:, 2].min() == pytest.approx(-1.2, abs=1e-4)
    generator.ask(pos_ned=(60.0, 0.0, 20.0), descend_speed=0.7)
    assert generator.run(5.0)["vel_ned"][0, :, 2].max() == pytest.approx(0.7, abs=1e-4)


def test_zero_velocity_brakes_and_then_holds_the_place() -> None:
    generator = Generator()
    generator.ask(vel_ned=(4.0, 0.0, -1.0))
    generator.run(3.0)
    generator.ask(vel_ned=(0.0, 0.0, 0.0))
    log = generator.run(4.0)
    assert log["is_locked_xy"][0, 0] == 0
    assert log["is_locked_xy"][0, -1] == 1
    assert log["is_locked_z"][0, -1] == 1
    held = log["pos_ned"][0, -1]
    generator.estimates.numpy()["pos_ned"] += 0.5  # blown away: the place held stays
    generator.states.numpy()["pos_ned"] = held
    np.testing.assert_array_equal(generator.run(0.02)["pos_ned"][0, -1], held)


def test_velocity_in_the_horizontal_mixes_with_a_height() -> None:
    generator = Generator()
    generator.ask(pos_ned=(NAN, NAN, -3.0), vel_ned=(1.0, -2.0, NAN))
    log = generator.run(6.0)
    np.testing.assert_allclose(log["vel_ned"][0, -1], (1.0, -2.0, 0.0), atol=1e-6)
    assert log["pos_ned"][0, -1, 2] == pytest.approx(-3.0, abs=1e-6)


def test_position_on_one_axis_mixes_with_velocity_on_the_other() -> None:
    generator = Generator()
    generator.ask(pos_ned=(2.0, NAN, 0.0), vel_ned=(NAN, 1.5, NAN))
    log = generator.run(6.0)
    assert log["pos_ned"][0, -1, 0] == pytest.approx(2.0, abs=1e-6)
    assert log["vel_ned"][0, -1, 1] == pytest.approx(1.5, abs=1e-6)


def test_acceleration_alone_is_followed_within_its_limit() -> None:
    generator = Generator()
    generator.ask(pos_ned=(NAN, NAN, 0.0), accel_ned=(1.0, -30.0, NAN))
    accel = generator.run(1.0)["accel_ned"][0]
    np.testing.assert_allclose(accel[-1], np.array([1.0, -30.0, 0.0]) * 4.0 / np.hypot(1.0, 30.0), atol=1e-5)


@pytest.mark.parametrize("rate", [10.0, 1000.0, -3.0e38])
def test_yaw_turns_no_faster_than_the_vehicle(rate: float) -> None:
    generator = Generator()
    generator.ask(vel_ned=(0.0, 0.0, 0.0), yaw_rate=rate)
    turned = generator.run(2.0)["yaw_rate"][0]
    assert np.abs(turned).max() == pytest.approx(np.radians(200.0), rel=1e-3)  # MC_YAWRATE_MAX
    assert np.sign(turned[-1]) == np.sign(rate)


def test_nothing_finite_holds_the_place() -> None:
    generator = Generator()
    generator.ask()
    log = generator.run(0.2)
    np.testing.assert_array_equal(log["pos_ned"][0, -1], (0.0, 0.0, 0.0))
    assert log["is_locked_xy"][0, -1] == 1


def test_moving_goal_is_met_and_followed_without_lag() -> None:
    generator = Generator()
    errors = []
    for frame in range(600):
        time_s = frame // 5 * 0.1  # renewed at 10 Hz
        goal = np.array([3.0 + 2.0 * time_s, -1.0 * time_s, -2.0])
        generator.ask(pos_ned=goal, vel_ned=(2.0, -1.0, 0.0))
        pos = generator.run(FRAME_S)["pos_ned"][0, -1]
        now = np.array([3.0, 0.0, -2.0]) + np.array([2.0, -1.0, 0.0]) * (frame + 1) * FRAME_S
        errors.append(np.linalg.norm(pos - now))
    assert max(errors[250:]) < 0.05


def test_moving_goal_not_renewed_stands_still() -> None:
    generator = Generator()
    generator.ask(pos_ned=(3.0, 0.0, 0.0), vel_ned=(1.0, 0.0, 0.0))
    log = generator.run(8.0)
    np.testing.assert_allclose(log["pos_ned"][0, -1], (3.0, 0.0, 0.0), atol=1e-5)
    np.testing.assert_array_equal(log["vel_ned"][0, -1], (0.0, 0.0, 0.0))


def test_path_is_kept_and_its_corner_rounded_within_the_acceptance_radius() -> None:
    generator = Generator()
    corners = [np.array(corner) for corner in ((0.0, 0.0, 0.0), (20.0, 0.0, -2.0), (20.0, 20.0, -2.0))]
    generator.ask(pos_ned=corners[1], path_start_ned=corners[0])
    for _ in range(1000):
        log = generator.run(FRAME_S)
        pos = log["pos_ned"][0, -1]
        along = pos @ (corners[1] / np.linalg.norm(corners[1]))
        assert np.linalg.norm(pos - along * corners[1] / np.linalg.norm(corners[1])) < 1e-4
        if np.linalg.norm(pos - corners[1]) < 2.0:
            break
    assert np.linalg.norm(log["vel_ned"][0, -1]) > 2.0
    generator.ask(pos_ned=corners[2], path_start_ned=corners[1])
    pos = generator.run(9.0)["pos_ned"][0]
    assert (pos[:, 0] - 20.0).max() < 0.3
    assert np.abs(pos[pos[:, 1] > 5.0, 0] - 20.0).max() < 0.02
    np.testing.assert_allclose(pos[-1], corners[2], atol=1e-5)


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.0, 0.1, 0.0)])
def test_vertical_path_is_flown(start: tuple[float, float, float]) -> None:
    generator = Generator()
    generator.ask(pos_ned=(0.0, 0.0, -10.0), path_start_ned=start)
    log = generator.run(10.0)
    np.testing.assert_allclose(log["pos_ned"][0, -1], (0.0, 0.0, -10.0), atol=1e-5)
    assert np.isfinite(log["vel_ned"]).all()


def test_exit_speed_is_the_speed_at_the_end_of_a_leg() -> None:
    generator = Generator()
    generator.ask(pos_ned=(20.0, 0.0, 0.0), path_start_ned=(0.0, 0.0, 0.0), exit_speed=2.5)
    log = generator.run(10.0)
    at_end = np.flatnonzero(log["pos_ned"][0, :, 0] < 20.0)[-1]
    first_pass = np.flatnonzero(log["pos_ned"][0, :, 0] >= 20.0)[0]
    assert log["vel_ned"][0, first_pass - 1, 0] == pytest.approx(2.5, abs=0.2)
    assert at_end > 0


def test_reset_of_the_estimate_shifts_the_trajectory_without_a_kick() -> None:
    generator = Generator()
    generator.ask(vel_ned=(0.0, 0.0, 0.0), yaw=0.2)
    before = generator.run(2.0)
    rows = generator.estimates.numpy()
    jump = np.array([1.5, -0.7, 0.3])
    rows["pos_ned"] += jump
    rows["pos_reset_ned"] = jump
    rows["yaw_reset"] = 0.3
    rows["reset_count"] += 1
    generator.ask(vel_ned=(0.0, 0.0, 0.0))
    after = generator.run(0.02)
    np.testing.assert_allclose(after["pos_ned"][0, -1], before["pos_ned"][0, -1] + jump, atol=1e-6)
    np.testing.assert_array_equal(after["accel_ned"][0, -1], (0.0, 0.0, 0.0))
    assert after["yaw"][0, -1] == pytest.approx(before["yaw"][0, -1] + 0.3, abs=1e-3)


def test_reset_of_the_estimate_keeps_the_trajectory_within_the_speed_limits() -> None:
    generator = Generator()
    generator.ask(pos_ned=(200.0, 0.0, 0.0))
    generator.run(3.0)
    for _ in range(3):
        generator.estimates.numpy()["vel_reset_ned"] = (6.0, 5.0, -4.0)
        generator.estimates.numpy()["reset_count"] += 1
        log = generator.run(FRAME_S)
    vel = log["vel_ned"][0, -1]
    assert np.hypot(vel[0], vel[1]) < 12.1  # MPC_XY_VEL_MAX
    assert vel[2] > -3.1  # MPC_Z_VEL_MAX_UP


def test_trajectory_waits_for_a_vehicle_left_behind() -> None:
    generator = Generator()
    generator.ask(pos_ned=(30.0, 0.0, 0.0))
    generator.run(2.0)
    first = generator.states.numpy()["pos_ned"][0].copy()
    generator.estimates.numpy()["pos_ned"][0, 0] = first[0] - 2.0
    generator.command()
    np.testing.assert_array_equal(generator.states.numpy()["pos_ned"][0], first)
    generator.estimates.numpy()["pos_ned"][0, 0] = first[0] - 1.5
    generator.command()
    slow = generator.states.numpy()["pos_ned"][0] - first
    generator.estimates.numpy()["pos_ned"][0, 0] = first[0]
    generator.command()
    quick = generator.states.numpy()["pos_ned"][0] - slow - first
    assert slow[0] == pytest.approx(0.5 * quick[0], rel=0.05)


def test_vehicle_blown_away_draws_the_trajectory_along_and_flies_on_from_there() -> None:
    generator = Generator()
    generator.ask(pos_ned=(40.0, 0.0, 0.0), path_start_ned=(0.0, 0.0, 0.0))
    generator.run(3.0)
    generator.estimates.numpy()["pos_ned"][0, 1] += 15.0
    position = generator.estimates.numpy()["pos_ned"][0].copy()
    generator.command()
    drawn = generator.states.numpy()[0]
    assert np.linalg.norm(drawn["pos_ned"] - position) == pytest.approx(2.0, abs=1e-3)  # MPC_XY_ERR_MAX
    np.testing.assert_array_equal(drawn["vel_ned"], 0.0)
    log = generator.run(20.0)
    vel, accel = log["vel_ned"][0].astype(float), log["accel_ned"][0].astype(float)
    assert np.linalg.norm(vel[0]) < 0.1  # from rest
    assert np.linalg.norm(np.diff(accel, axis=0), axis=1).max() <= np.sqrt(2.0) * 8.0 * FRAME_S * 1.001  # MPC_JERK_AUTO
    np.testing.assert_allclose(log["pos_ned"][0, -1], (40.0, 0.0, 0.0), atol=1e-4)


def test_climb_goes_on_while_the_vehicle_is_blown_aside() -> None:
    generator = Generator()
    generator.ask(pos_ned=(0.0, 0.0, -10.0))
    generator.run(2.0)
    generator.estimates.numpy()["pos_ned"][0, 1] += 5.0
    assert generator.command()[0, 2] == pytest.approx(-3.0, abs=0.01)


def test_velocity_setpoint_is_obeyed_while_the_height_lags() -> None:
    generator = Generator()
    generator.ask(pos_ned=(NAN, NAN, -10.0), vel_ned=(4.0, 0.0, NAN))
    generator.run(3.0)
    generator.ask(pos_ned=(NAN, NAN, -10.0), vel_ned=(0.0, 0.0, NAN))
    generator.estimates.numpy()["pos_ned"][0, 2] += 3.0
    for _ in range(100):
        command = generator.command()
    np.testing.assert_allclose(command[0, :2], 0.0, atol=0.01)


def test_yaw_turns_the_short_way_within_rate_and_acceleration() -> None:
    generator = Generator()
    generator.ask(yaw=np.radians(170.0))
    generator.run(6.0)
    generator.ask(yaw=np.radians(-170.0))
    log = generator.run(3.0)
    assert (log["yaw_rate"][0] >= -1e-3).all()
    assert log["yaw"][0, -1] == pytest.approx(np.radians(-170.0), abs=1e-3)
    generator.ask(yaw=np.radians(20.0))
    log = generator.run(8.0)
    assert np.abs(log["yaw_rate"]).max() <= np.radians(60.0) + 1e-5
    assert np.abs(np.diff(log["yaw_rate"][0])).max() <= np.radians(90.0) * FRAME_S + 1e-5
    assert log["yaw"][0, -1] == pytest.approx(np.radians(20.0), abs=1e-3)


def test_yaw_rate_alone_is_followed_and_then_held() -> None:
    generator = Generator()
    generator.ask(yaw_rate=0.5)
    log = generator.run(4.0)
    assert log["yaw_rate"][0, -1] == pytest.approx(0.5, abs=1e-5)
    assert log["yaw"][0, -1] == pytest.approx(4.0 * 0.5, abs=0.1)
    generator.ask()
    assert generator.run(3.0)["yaw_rate"][0, -1] == pytest.approx(0.0, abs=1e-3)
