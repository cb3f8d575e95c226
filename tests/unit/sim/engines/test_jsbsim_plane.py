"""An aircraft of JSBSim's as a plane's body: truth in our frames, wheels on our ground, our wind round it."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from common.geodesy import DEFAULT_HOME
from common.kernels import TICK_S
from mission.cli import app
from mission.flight import Flight, FlightConfig
from sim.bodies.rigid_body import density_ratio_at
from tests.unit.sim.engine_rig import PLAIN, STEEP, put, rig_on, run

pytest.importorskip("jsbsim")
from sim.engines.jsbsim_plane_engine import JsbsimPlaneEngine

CESSNA = partial(JsbsimPlaneEngine, aircraft="c172p")
STANDING_M = 1.33
HOME_DENSITY = 1.225 * density_ratio_at(DEFAULT_HOME.alt_m)


def plane_on(world, wind_m_s=0.0, aileron=0.0, elevator=0.0, throttle=0.0, rudder=0.0, brake=0.0):
    command = (aileron, elevator, throttle, rudder, 0.0, brake)
    return rig_on(world, CESSNA, commands=command, airframe="c172", wind_m_s=wind_m_s)


def fly(speed=40.0, seconds=1.0, **controls):
    """In the air, level; the rows of truth of each tick."""
    rig = plane_on(PLAIN, **controls)
    put(rig, 0.0, 0.0, 300.0)
    rig.arrays.body.numpy()["vel_ned"][0] = (speed, 0.0, 0.0)
    return np.array([run(rig, TICK_S).copy() for _ in range(round(seconds / TICK_S))])


def test_it_stands_on_its_wheels_where_the_ground_is():
    rig = plane_on(STEEP, brake=1.0)
    for place in ((0.0, 0.0), (20.0, -15.0)):
        put(rig, *place, STANDING_M)
        rest = run(rig, 10.0).copy()
        later = run(rig, 5.0)
        assert later["height_agl_m"] == pytest.approx(STANDING_M, abs=0.02)
        assert np.linalg.norm(later["pos_ned"] - rest["pos_ned"]) < 0.02
        assert np.linalg.norm(later["accel_frd"]) == pytest.approx(9.80665, rel=2e-3)
        assert (later["is_on_ground"], later["is_crashed"]) == (1, 0)


def test_what_its_imu_feels_is_how_it_moves():
    """Strapdown: the sums of specific force and rate lead from the first velocity and attitude to the last."""
    rows = fly(seconds=3.0, aileron=0.7, elevator=0.1, throttle=0.8, rudder=0.1)
    turn, vel = Rotation.from_quat(rows[0]["q_ned_from_frd"]), rows[0]["vel_ned"].astype(float)
    for row in rows[1:]:
        half = Rotation.from_rotvec(0.5 * TICK_S * row["gyro_frd"])
        vel += TICK_S * ((turn * half).apply(row["accel_frd"]) + np.array([0.0, 0.0, 9.80665]))
        turn = turn * half * half
    assert np.degrees(turn.as_euler("ZYX")[2]) > 25.0  # it did turn
    assert vel == pytest.approx(rows[-1]["vel_ned"], abs=0.1)
    assert np.degrees((turn.inv() * Rotation.from_quat(rows[-1]["q_ned_from_frd"])).magnitude()) < 0.5


@pytest.mark.parametrize(("control", "axis"), [("aileron", 0), ("elevator", 1), ("rudder", 2)])
def test_positive_commands_roll_right_pitch_up_and_yaw_right(control, axis):
    rates = [fly(seconds=0.5, throttle=0.6, **{control: sign * 0.3})[-1]["omega_frd"][axis] for sign in (-1.0, 1.0)]
    assert rates[1] > rates[0] + 0.05


def test_full_throttle_turns_the_propeller_and_pulls():
    idle, full = (fly(seconds=2.0, throttle=throttle)[-1] for throttle in (0.0, 1.0))
    assert full["motor_speed"][2] > idle["motor_speed"][2] > 50.0
    assert full["accel_frd"][0] > idle["accel_frd"][0] + 1.5


@pytest.mark.parametrize("wind_m_s", [0.0, 10.0])
def test_standing_in_the_wind_the_pitot_tube_measures_it(wind_m_s):
    """It stands nose north, and the wind comes from there; leaning by its gear it sees the cosine."""
    rig = plane_on(PLAIN, wind_m_s=wind_m_s, brake=1.0)
    row = run(rig, 8.0)
    assert row["pitot_pa"] == pytest.approx(0.5 * HOME_DENSITY * wind_m_s**2, rel=0.02, abs=0.01)
    assert np.linalg.norm(row["vel_ned"]) < 0.05


@pytest.mark.parametrize(("sink", "is_crashed"), [(1.0, 0), (5.0, 1)])
def test_a_hard_landing_is_a_crash(sink, is_crashed):
    rig = plane_on(PLAIN)
    put(rig, 0.0, 0.0, STANDING_M + 0.4)
    rig.arrays.body.numpy()["vel_ned"][0] = (30.0, 0.0, sink)
    row = run(rig, 1.0)
    assert row["is_crashed"] == is_crashed
    assert row["impact_speed"] == pytest.approx(sink, abs=1.0)


def test_the_same_twice_is_the_same_bits():
    assert fly(throttle=0.7, aileron=0.1)[-1].tobytes() == fly(throttle=0.7, aileron=0.1)[-1].tobytes()


def test_what_is_no_plane_or_unknown_is_refused():
    with pytest.raises(ValueError, match="the engine jsbsim moves it"):
        Flight(FlightConfig(airframe="c172"))
    with pytest.raises(ValueError, match="is a plane"):
        rig_on(PLAIN, CESSNA)
    with pytest.raises(ValueError, match="no aircraft 'kite'"):
        rig_on(PLAIN, partial(JsbsimPlaneEngine, aircraft="kite"), airframe="c172")


@pytest.mark.parametrize(
    ("engine", "airframe", "says"),
    [
        ("native", "c172", "it is JSBSim's c172p; add --engine jsbsim"),
        ("pybullet", "c172", "it does not move c172"),
        ("jsbsim", "plane", "it does not move plane"),
    ],
)
def test_the_command_line_says_which_engine_moves_what(engine, airframe, says):
    result = CliRunner().invoke(app, ["fly", "--engine", engine, "--airframe", airframe])
    assert result.exit_code == 2
    assert says in result.stderr
