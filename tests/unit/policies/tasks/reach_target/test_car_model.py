import numpy as np
import pytest

from bench.vehicle import (
    NUMBER,
    braking,
    braking_gently,
    car,
    cornering,
    drive,
    gentle_acceleration,
    rest_height,
    set_rolling,
    sprint,
    turn_radius,
)
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.reach_target.car_model import car_of, suspension_load
from policies.tasks.reach_target.reach_target_params import ReachParams
from policies.tasks.task_params import Sampler


def heading(q):
    x, y, z, w = q
    return np.array([2 * (x * z + w * y), 1 - 2 * (x * x + y * y)])


def quat_of_yaw(yaw):
    return np.array([0.0, np.sin(yaw / 2), 0.0, np.cos(yaw / 2)], np.float32)


def energy(task):
    """Of the first car: motion, turning, height, springs and wheels [J]."""
    n, world = NUMBER, task.world
    pos, vel, spin = world.pos.numpy()[0], world.vel.numpy()[0], world.spin.numpy()[0]
    sizes = np.array([n["chassis_width_m"], n["chassis_height_m"], n["chassis_length_m"]])
    inertia = n["mass_kg"] / 12.0 * (np.sum(sizes**2) - sizes**2)
    squeeze = n["wheel_radius_m"] + n["suspension_travel_m"] - (pos[1] + n["axle_height_m"])
    wheel = 0.5 * n["wheel_mass_kg"] * n["wheel_radius_m"] ** 2
    return (
        0.5 * n["mass_kg"] * vel @ vel
        + 0.5 * inertia @ world.omega_car.numpy()[0] ** 2
        + n["mass_kg"] * n["gravity_m_s2"] * pos[1]
        + 4 * 0.5 * n["spring_n_m"] * max(squeeze, 0.0) ** 2
        + 0.5 * wheel * spin @ spin
    )


def test_at_rest_the_springs_carry_the_weight_and_nothing_moves():
    check = rest_height()
    assert check.measured == pytest.approx(check.closed_form, abs=1e-4)
    task = car()
    before = task.world.pos.numpy()[0].copy()
    drive(task, (0.7, 0.0, 1.0), 20.0)
    assert task.world.pos.numpy()[0] == pytest.approx(before, abs=1e-4)
    assert np.abs(task.world.vel.numpy()[0]).max() < 1e-5


def test_torque_and_brakes_accelerate_as_the_masses_say():
    for check in (gentle_acceleration(), braking_gently()):
        assert check.measured == pytest.approx(check.closed_form, rel=0.03)


def test_full_brakes_stop_within_what_lifting_rear_wheels_leave_of_them():
    check = braking()
    assert check.closed_form < check.measured < 2.0 * check.closed_form


def test_ten_metres_per_second_come_in_under_two_seconds():
    best = 10.0 * (NUMBER["mass_kg"] + 40.0) / (4.0 * NUMBER["motor_torque_nm"] / NUMBER["wheel_radius_m"])
    assert best < sprint().measured < 2.0


def test_the_slow_turn_has_the_kinematic_radius():
    check = turn_radius()
    assert check.measured == pytest.approx(check.closed_form, rel=0.1)  # parallel front wheels turn wider than one


def test_no_corner_is_taken_faster_than_the_tyres_hold():
    check = cornering()
    assert 0.5 * check.closed_form < check.measured < 1.02 * check.closed_form


def test_without_drive_energy_only_leaves():
    task = car()
    set_rolling(task, 12.0)
    task.world.vel.assign(np.array([[4.0, 0.0, 11.0]], np.float32))  # sliding sideways too
    task.world.omega_car.assign(np.array([[0.0, 1.5, 0.0]], np.float32))
    energies = [energy(task)]
    for _ in range(30):
        drive(task, (0.4, 0.0, 0.0), 0.2)
        energies.append(energy(task))
    assert (np.diff(energies) < 1e-4 * energies[0]).all()  # springs of a leaning car are booked as level ones
    assert energies[-1] < 0.9 * energies[0]


def test_mirrored_actions_give_the_mirrored_path():
    paths = []
    for sign in (1.0, -1.0):
        task = car()
        drive(task, (0.6 * sign, 0.8, 0.0), 3.0)
        paths.append(drive(task, (-0.9 * sign, 0.3, 0.2), 3.0))
    mirror = np.array([-1.0, 1.0, 1.0, -1.0, 1.0, 1.0])
    assert paths[0] == pytest.approx(mirror * paths[1], abs=2e-2)  # float32 over 600 sub-steps of sliding
    assert abs(paths[0][-1, 0]) > 1.0


def test_a_turned_start_turns_the_path():
    paths = []
    for yaw in (0.0, np.pi / 2):
        task = car()
        task.world.q.assign(quat_of_yaw(yaw)[None])
        drive(task, (0.5, 0.6, 0.0), 2.0)
        paths.append(drive(task, (-0.5, 0.6, 0.0), 2.0))
    turned = paths[0][:, [2, 1, 0, 5, 4, 3]] * [1.0, 1.0, -1.0, 1.0, 1.0, -1.0]  # +z to +x, +x to -z
    assert paths[1] == pytest.approx(turned, abs=2e-2)


def test_all_cars_of_a_batch_drive_alike():
    task = car(5)
    drive(task, (0.4, 0.9, 0.0), 3.0)
    pos = task.world.pos.numpy()
    assert (pos == pos[0]).all()
    alone = car(1)
    drive(alone, (0.4, 0.9, 0.0), 3.0)
    assert alone.world.pos.numpy()[0].tobytes() == pos[0].tobytes()


def test_wheels_in_the_air_spin_up_by_their_own_inertia():
    task = car()
    task.world.pos.assign(np.array([[0.0, 100.0, 0.0]], np.float32))
    drive(task, (0.0, 1.0, 0.0), 0.2)
    inertia = 0.5 * NUMBER["wheel_mass_kg"] * NUMBER["wheel_radius_m"] ** 2
    assert task.world.spin.numpy()[0] == pytest.approx(NUMBER["motor_torque_nm"] / inertia * 0.2, rel=0.02)
    assert task.world.vel.numpy()[0] == pytest.approx([0.0, -9.81 * 0.2, 0.0], abs=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_wild_driving_with_wild_numbers_stays_finite(seed):
    task = build_task("ReachTarget", 256, task_settings("ReachTarget", {"preset": "as-documented"}))
    task.set_params(
        {
            "mass_kg": Sampler(intervals=((800.0, 2500.0),)),
            "spring_n_m": Sampler(intervals=((20000.0, 60000.0),)),
            "side_stiffness": Sampler(intervals=((0.5, 2.0),)),
            "wheel_mass_kg": Sampler(intervals=((5.0, 60.0),)),
        }
    )
    task.reset(seed)
    rng = np.random.default_rng(seed)
    for _ in range(150):
        task.buffers.continuous.assign(rng.uniform(-1, 1, (256, 3)).astype(np.float32))
        task.step()
    assert np.isfinite(task.buffers.observations.numpy()).all()
    assert np.linalg.norm(task.world.vel.numpy(), axis=1).max() < 100.0


def test_the_platform_never_pushes_a_wheel_harder_than_the_car_weighs():
    params = ReachParams()
    for name, value in NUMBER.items():
        setattr(params, name, value)
    vehicle = car_of(params)
    weight = NUMBER["mass_kg"] * NUMBER["gravity_m_s2"]
    assert suspension_load(vehicle, 0.05, 0.0) == pytest.approx(0.05 * NUMBER["spring_n_m"])
    assert suspension_load(vehicle, 0.6, -5.0) == pytest.approx(weight)  # a wheel that came back over an edge
    assert suspension_load(vehicle, 0.05, 5.0) == 0.0
