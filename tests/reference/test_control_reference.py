"""The controller's kernels against plain NumPy and SciPy written from the equations."""

import control
import numpy as np
import pytest
import warp as wp
from scipy.optimize import brentq, linprog
from scipy.spatial.transform import Rotation

from autopilot.control.profile import AxisLimits, distance_via, ramp_distance, ramp_to, step_to_position
from autopilot.vehicles.multirotor.allocation import command_for_speed, speed_fraction
from autopilot.vehicles.multirotor.attitude import attitude_error
from autopilot.vehicles.multirotor.control_airframe import control_airframe, effectiveness
from autopilot.vehicles.multirotor.tuning import Cascade, default_gains, motor_time_s
from common.airframe import load_airframe
from tests.unit.autopilot.vehicles.multirotor.mixer import mix
from tests.unit.autopilot.vehicles.multirotor.rig import Rig


def limits(speed: float = 5.0, accel_up: float = 4.0, accel_down: float = 3.0, jerk: float = 20.0) -> AxisLimits:
    row = AxisLimits()
    row.speed_positive = row.speed_negative = speed
    row.accel_positive, row.accel_negative, row.jerk = accel_up, accel_down, jerk
    return row


def integrated_ramp(vel: float, accel: float, goal: float, row: AxisLimits) -> tuple[float, float, float]:
    """Distance, end velocity and end acceleration of a ramp, by integration in steps of 10 us."""
    ramp = ramp_to(vel, accel, goal, row)
    moved, dt = 0.0, 1e-5
    segments = ((ramp.jerk_in, ramp.time_in_s), (0.0, ramp.time_hold_s), (ramp.jerk_out, ramp.time_out_s))
    for jerk, duration in segments:
        steps = max(round(duration / dt), 1)
        step = duration / steps
        times = (np.arange(steps) + 0.5) * step
        moved += float(np.sum(vel + accel * times + 0.5 * jerk * times**2) * step)
        vel += accel * duration + 0.5 * jerk * duration**2
        accel += jerk * duration
    return moved, vel, accel


@pytest.mark.parametrize(
    ("vel", "accel", "goal"),
    [(0.0, 0.0, 5.0), (0.0, 0.0, 0.3), (3.0, -2.0, -1.0), (2.0, 3.5, 0.0), (-4.0, 1.0, 4.0), (1.0, -3.0, 0.9)],
)
def test_ramp_distance_is_the_integral_of_its_segments(vel: float, accel: float, goal: float) -> None:
    moved, end_vel, end_accel = integrated_ramp(vel, accel, goal, limits())
    assert ramp_distance(vel, accel, goal, limits()) == pytest.approx(moved, abs=1e-6)
    assert end_vel == pytest.approx(goal, abs=1e-6)  # square roots are float32
    assert end_accel == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("distance", [0.02, 0.5, 3.0, 8.0])
def test_cruise_speed_is_the_root_of_the_distance_covered(distance: float) -> None:
    row = limits()
    speed = brentq(lambda v: distance_via(v, 0.0, 0.0, 0.0, row) - distance, 0.0, 20.0)
    vel, accel, moved, peak = 0.0, 0.0, 0.0, 0.0
    for _ in range(600):
        motion = step_to_position(distance - moved, vel, accel, 0.0, row, 0.02)
        moved, vel, accel = moved + motion.moved, motion.vel, motion.accel
        peak = max(peak, vel)
    assert moved == pytest.approx(distance, abs=1e-6)
    assert peak == pytest.approx(min(speed, 5.0), abs=0.05)


@wp.kernel
def way_to(distance: float, vel: float, accel: float, row: AxisLimits, way: wp.array[wp.vec3]):
    """Position, velocity and acceleration of each step, 20 ms apart."""
    moved = float(0.0)
    for k in range(way.shape[0]):
        motion = step_to_position(distance - moved, vel, accel, 0.0, row, 0.02)
        moved = moved + motion.moved
        vel = motion.vel
        accel = motion.accel
        way[k] = wp.vec3(moved, vel, accel)


@pytest.mark.parametrize("spare", [1e-4, 1e-3, 0.02, 0.2])
@pytest.mark.parametrize(("vel", "accel"), [(3.0, -3.0), (1.0, -2.0), (2.0, 1.5), (4.9, -1.0), (0.3, -0.5)])
def test_who_has_to_brake_brakes_once(vel: float, accel: float, spare: float) -> None:
    """However much farther the goal is than the shortest stop."""
    row = limits()
    distance = ramp_distance(vel, accel, 0.0, row) + spare
    way = wp.zeros(300, dtype=wp.vec3, device="cpu")
    wp.launch(way_to, dim=1, inputs=[distance, vel, accel, row, way], device="cpu")
    moved, speed, change = way.numpy().astype(float).T
    assert moved[-1] == pytest.approx(distance, abs=1e-4)
    assert max(moved) < distance + 1e-4
    assert max(np.abs(np.diff(moved))) < 0.02 * max(vel, *speed) + 1e-4
    hardest = int(np.argmin(change))
    assert min(change) > -row.accel_negative - 1e-3
    assert min(np.diff(change[hardest:])) > -0.05  # once it has let go of the brake it does not brake harder again


def test_attitude_error_agrees_with_rotation_vectors() -> None:
    for here, there in zip(Rotation.random(200, random_state=1), Rotation.random(200, random_state=2), strict=True):
        error = np.array(attitude_error(wp.quat(*here.as_quat()), wp.quat(*there.as_quat())))
        wanted = here.inv().apply(there.apply([0.0, 0.0, 1.0]))
        axis = np.cross([0.0, 0.0, 1.0], wanted)
        tilt = axis / np.linalg.norm(axis) * np.arccos(np.clip(wanted[2], -1.0, 1.0))
        turn = (Rotation.from_rotvec(tilt).inv() * here.inv() * there).as_rotvec()
        np.testing.assert_allclose(error[:2], tilt[:2], atol=2e-4)
        assert np.cos(error[2] - turn[2]) == pytest.approx(1.0, abs=1e-6)


def test_desaturation_keeps_as_much_yaw_as_linear_programming_finds() -> None:
    airframe = load_airframe("x500")
    forward = effectiveness(airframe)
    rng = np.random.default_rng(4)
    torques = rng.uniform((-0.8, -0.8, -1.0), (0.8, 0.8, 1.0), (60, 3))
    low, high = 0.2, 8.5
    results = mix(airframe, torques, np.full(60, 15.0), low, high)[0]
    for torque, result in zip(torques, results, strict=True):
        demand = [torque[0], torque[1], 15.0]
        best = linprog(-np.sign(torque[2]) * forward[2], A_eq=forward[[0, 1, 3]], b_eq=demand, bounds=[(low, high)] * 4)
        if best.success:  # otherwise thrust must give way
            expected = np.sign(torque[2]) * min(abs(torque[2]), -best.fun)
            np.testing.assert_allclose(result["torque_frd"], [*torque[:2], expected], atol=1e-4)


@pytest.mark.parametrize("curve", [0.0, 0.3, 0.6, 1.0])
def test_command_is_the_inverse_of_the_motor_curve(curve: float) -> None:
    for command in np.linspace(0.0, 1.0, 21):
        fraction = curve * command + (1.0 - curve) * np.sqrt(command)
        assert speed_fraction(float(command), curve) == pytest.approx(fraction, abs=1e-6)
        assert command_for_speed(float(fraction), curve) == pytest.approx(command, abs=1e-6)


def test_control_airframe_carries_the_file() -> None:
    airframe = load_airframe("x500")
    row = control_airframe(airframe)
    forward = effectiveness(airframe)
    inverse = np.stack(
        [np.array(mix)[:4] for mix in (row.mix_roll, row.mix_pitch, row.mix_yaw, row.mix_thrust)], axis=1
    )
    np.testing.assert_allclose(forward @ inverse, np.eye(4), atol=1e-5)
    assert row.motor_time_s == pytest.approx(motor_time_s(airframe))
    assert row.full_voltage_v == pytest.approx(16.8)


def test_closed_loop_answers_a_small_step_as_the_linear_design_does() -> None:
    """The rate loop flown agrees with the model behind the margins, on a step of roll rate."""
    airframe = load_airframe("x500")
    rig = Rig()
    rig.run(0.4)
    rig.set(kind=3, omega_frd=(0.05, 0.0, 0.0), thrust=rig.hover_share)
    flown = rig.run(0.4)[0]["omega_frd"][0, :, 0] / 0.05
    closed = Cascade(airframe, default_gains()).rate("tilt")[1]
    time_s = np.arange(100) * 0.004
    model = control.step_response(closed, time_s).outputs
    assert np.abs(flown - model).max() < 0.15  # delay and lag of the rig differ by half a tick and rise from fall
    assert flown.max() == pytest.approx(model.max(), abs=0.08)
