"""What mechanics says of a body whoever moves it: Euler's equations, what an IMU feels, friction, rest, a new start."""

from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from common.kernels import TICK_S
from sim.engines.native import NativeEngine
from tests.unit.sim.engine_rig import PLAIN, put, rig_on, run

pytest.importorskip("pybullet")
pytest.importorskip("jsbsim")
from sim.engines.bullet import BulletEngine
from sim.engines.jsbsim_engine import JsbsimEngine
from sim.engines.jsbsim_plane_engine import JsbsimPlaneEngine

GRAVITY = 9.80665
CESSNA = partial(JsbsimPlaneEngine, aircraft="c172p")
MULTIROTOR = pytest.mark.parametrize("engine", [NativeEngine, BulletEngine, JsbsimEngine])
EVERY = pytest.mark.parametrize(
    ("engine", "airframe", "commands"),
    [
        (NativeEngine, "x500", (0.8,) * 4), (BulletEngine, "x500", (0.8,) * 4), (JsbsimEngine, "x500", (0.8,) * 4),
        (NativeEngine, "rover", (0.2, 0.5)), (BulletEngine, "rover", (0.2, 0.5)), (CESSNA, "c172", (0.0, 0.0, 1.0)),
    ],
)  # fmt: skip


def turned(inertia, omega, seconds):
    """Rate and attitude of a free body by Euler's equations, from level (SciPy, eighth order)."""

    def slope(_, y):
        turn, rate = Rotation.from_quat(y[:4]), y[4:]
        x, y_, z, w = turn.as_quat()
        spin = 0.5 * np.array([[w, -z, y_], [z, w, -x], [-y_, x, w], [-x, -y_, -z]]) @ rate
        return np.concatenate([spin, -np.cross(rate, inertia * rate) / inertia])

    start = np.array([0.0, 0.0, 0.0, 1.0, *omega])
    end = solve_ivp(slope, (0.0, seconds), start, "DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    return end[4:], Rotation.from_quat(end[:4])


@MULTIROTOR
@pytest.mark.parametrize("omega", [(4.0, -3.0, 6.0), (0.1, 8.0, 0.1)])
def test_a_free_body_tumbles_by_eulers_equations(engine, omega):
    """Without air: energy and momentum stay, and after 10 s it is turned as the equations say."""
    rig = rig_on(PLAIN, engine)
    model = rig.arrays.model.numpy()
    for drag in ("drag_area_frd", "angular_drag_n_m_s2", "rotor_drag_n_s2_m", "inflow_n_s2_m"):
        model[drag] = 0.0
    inertia = model["inertia_frd"][0].astype(float)
    put(rig, 0.0, 0.0, 600.0)
    rig.arrays.body.numpy()["omega_frd"][0] = omega
    end = run(rig, 10.0)
    rate, attitude = end["omega_frd"].astype(float), Rotation.from_quat(end["q_ned_from_frd"])
    expected_rate, expected = turned(inertia, omega, 10.0)
    assert rate @ (inertia * rate) == pytest.approx(np.dot(omega, inertia * omega), rel=3e-5)
    assert attitude.apply(inertia * rate) == pytest.approx(inertia * omega, abs=3e-5 * np.linalg.norm(inertia * omega))
    assert rate == pytest.approx(expected_rate, abs=5e-3)
    assert np.degrees((attitude.inv() * expected).magnitude()) < 0.1


@MULTIROTOR
def test_what_its_imu_feels_is_how_it_moves(engine):
    """Strapdown: the sums of specific force and rate lead from the first velocity and attitude to the last."""
    rig = rig_on(PLAIN, engine, (0.6, 0.5, 0.5, 0.6))  # which rolls it ever faster
    put(rig, 0.0, 0.0, 300.0)
    rig.arrays.body.numpy()["omega_frd"][0] = (0.0, 4.0, 0.0)
    rows = [run(rig, TICK_S) for _ in range(500)]
    turn, vel = Rotation.from_quat(rows[0]["q_ned_from_frd"]), rows[0]["vel_ned"].astype(float)
    for row in rows[1:]:
        half = Rotation.from_rotvec(0.5 * TICK_S * row["gyro_frd"])
        vel += TICK_S * ((turn * half).apply(row["accel_frd"]) + np.array([0.0, 0.0, GRAVITY]))
        turn = turn * half * half
    assert np.linalg.norm(rows[-1]["omega_frd"]) > 10.0
    assert vel == pytest.approx(rows[-1]["vel_ned"], abs=2e-3)  # 1 mg would be 20e-3
    assert np.degrees((turn.inv() * Rotation.from_quat(rows[-1]["q_ned_from_frd"])).magnitude()) < 0.03


@EVERY
def test_who_is_let_go_of_falls_from_rest(engine, airframe, commands):
    rig = rig_on(PLAIN, engine, tuple(0.0 for _ in commands), airframe)
    run(rig, 0.1)
    put(rig, 0.0, 0.0, 50.0)
    body = rig.arrays.body.numpy()
    body["omega_frd"][0], body["is_held"] = 0.0, 1
    held = run(rig, 0.1)
    assert held["vel_ned"].tolist() == [0.0, 0.0, 0.0]
    body["is_held"] = 0
    assert run(rig, TICK_S)["vel_ned"][2] == pytest.approx(GRAVITY * TICK_S, rel=0.001)


@EVERY
def test_a_vehicle_that_boots_again_goes_as_the_first_time(engine, airframe, commands):
    """Of contacts, engine, gear, springs and tank nothing is left: the same bits."""
    rig = rig_on(PLAIN, engine, commands, airframe)
    ends = []
    for _ in range(2):
        rig.boot(np.ones(1))
        ends.append(run(rig, 2.0).tobytes())
        run(rig, 1.0)
    assert ends[0] == ends[1]


def test_beside_one_that_is_held_another_falls_as_it_does_alone():
    """With JSBSim; with Bullet it is in test_bullet.py."""
    alone = rig_on(PLAIN, JsbsimEngine)
    rig = rig_on(PLAIN, JsbsimEngine, vehicle_count=2)
    rig.arrays.body.numpy()["is_held"][1] = 1
    for each in (alone, rig):
        put(each, 0.0, 0.0, 30.0)
        each.arrays.body.numpy()["omega_frd"][0] = (1.0, 2.0, 3.0)
    assert run(rig, 1.0).tobytes() == run(alone, 1.0).tobytes()


def test_a_hull_slides_as_far_as_friction_lets_it():
    """A rover on its roof: v² / (2 mu g)."""
    rig = rig_on(PLAIN, BulletEngine, airframe="rover")
    put(rig, 0.0, 0.0, float(rig.arrays.model.numpy()["hull_top_m"][0]) + 0.001)
    body = rig.arrays.body.numpy()
    body["q_ned_from_frd"][0] = (1.0, 0.0, 0.0, 0.0)
    start_m = float(run(rig, 0.5)["pos_ned"][0])
    body["vel_ned"][0] = (3.0, 0.0, 0.0)
    end = run(rig, 3.0)
    assert np.linalg.norm(end["vel_ned"]) < 1e-3
    assert end["pos_ned"][0] - start_m == pytest.approx(3.0**2 / (2.0 * 0.4 * GRAVITY), rel=0.03)
