"""JSBSim as an engine: what a vehicle touches, stands on and is put back to, and how little it differs from ours."""

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.flight import Flight, FlightConfig
from sim.engines.native import NativeEngine
from sim.world.world import WorldConfig
from tests.unit.sim.engine_rig import PLAIN, STEEP, put, rig_on, run

pytest.importorskip("jsbsim")
from sim.engines.jsbsim_engine import JsbsimEngine

SLOPES = [(0.0, 0.0), (20.0, -15.0), (-31.0, 12.0)]  # of 6 to 9 degrees


def short_flight(engine):
    """Modes and places [m] of each frame of a take-off, a goto and a landing, without sensor noise."""
    flight = Flight(FlightConfig(engine=engine, noise=0.0, world=PLAIN))
    modes, places = [], []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(6.0)
        await drone.goto_ned(8.0, 3.0, -7.0)
        await drone.land()

    running = flight.drone.start(script(flight.drone))
    while not running.is_done:
        flight.frame()
        modes.append(int(flight.controller.state.mode))
        places.append(flight.rig.truth_row()["pos_ned"].copy())
    assert running.error is None
    flight.close()
    return np.array(modes), np.array(places)


BOTH = (NativeEngine, JsbsimEngine)


@pytest.mark.parametrize("place", SLOPES)
def test_it_stands_on_a_slope_where_the_native_engine_does_and_does_not_creep(place):
    rests = []
    for engine in BOTH:
        rig = rig_on(STEEP, engine)
        put(rig, *place, 0.25)
        rests.append(run(rig, 4.0).copy())
        later = run(rig, 30.0)
        assert np.linalg.norm(later["pos_ned"] - rests[-1]["pos_ned"]) < 1e-3
        assert np.linalg.norm(later["vel_ned"]) < 1e-3
        assert np.linalg.norm(later["accel_frd"]) == pytest.approx(9.80665, rel=1e-3)
        assert (later["is_on_ground"], later["is_crashed"]) == (1, 0)
    assert np.linalg.norm(rests[0]["pos_ned"] - rests[1]["pos_ned"]) < 0.02


def test_it_tumbles_falls_and_crashes_as_with_the_native_engine():
    """Thrown spinning about all axes, from high: Euler's equations, drag and the rotors' momentum, then the ground."""
    rows = []
    for engine in BOTH:
        rig = rig_on(PLAIN, engine, commands=0.3)
        put(rig, 0.0, 0.0, 30.0)
        body = rig.arrays.body.numpy()
        body["omega_frd"][0], body["vel_ned"][0] = (4.0, -3.0, 6.0), (5.0, -2.0, 1.0)
        rows.append([run(rig, 0.8).copy(), run(rig, 4.0).copy()])
    (ours, our_end), (theirs, their_end) = rows
    assert np.linalg.norm(ours["omega_frd"]) > 2.0
    assert theirs["pos_ned"] == pytest.approx(ours["pos_ned"], abs=5e-3)
    assert theirs["omega_frd"] == pytest.approx(ours["omega_frd"], abs=0.05)
    assert abs(float(np.dot(theirs["q_ned_from_frd"], ours["q_ned_from_frd"]))) > 1.0 - 1e-5
    assert (our_end["is_crashed"], their_end["is_crashed"]) == (1, 1)
    assert their_end["impact_speed"] == pytest.approx(our_end["impact_speed"], rel=0.02)


def test_a_tree_stops_it():
    """Thrown at a trunk it comes no farther, and has struck it as fast as it was."""
    rig = rig_on(WorldConfig(trees_per_ha=150.0, hill_height_m=0.0, size_m=100.0, clearing_radius_m=2.0), JsbsimEngine)
    tree = rig.world.trees[0]
    put(rig, float(tree["north"]) - 2.0, float(tree["east"]), 1.5)
    rig.arrays.body.numpy()["vel_ned"][0] = (6.0, 0.0, -1.0)
    row = run(rig, 0.5)
    reach_m = float(tree["trunk_radius"]) + float(rig.arrays.model.numpy()["contact"]["hull_radius_m"][0])
    assert float(tree["north"]) - float(row["pos_ned"][0]) > reach_m - 0.1
    assert row["impact_speed"] == pytest.approx(6.0, abs=0.8)


def test_far_from_home_down_is_down():
    """The planet is flat enough: who stands a kilometre from home leans on nothing."""
    rig = rig_on(PLAIN, JsbsimEngine)
    put(rig, 0.0, 0.0, 50.0)
    rig.arrays.body.numpy()["vel_ned"][0] = (60.0, -40.0, -20.0)
    native = rig_on(PLAIN, NativeEngine)
    native.restore(rig.snapshot())
    for each in (rig, native):
        run(each, 3.0)
    assert rig.truth_row()["vel_ned"] == pytest.approx(native.truth_row()["vel_ned"], abs=5e-3)
    assert rig.truth_row()["pos_ned"] == pytest.approx(native.truth_row()["pos_ned"], abs=2e-2)


def test_each_vehicle_goes_its_own_way_and_boots_alone():
    rig = rig_on(PLAIN, JsbsimEngine, vehicle_count=2)
    put(rig, 3.0, 4.0, 20.0, i_vehicle=0)
    put(rig, -5.0, 6.0, 10.0, i_vehicle=1)
    run(rig, 0.5)
    places = rig.arrays.truth.numpy()["pos_ned"]
    assert places[0] == pytest.approx([3.0, 4.0, -18.78], abs=0.02)
    assert places[1] == pytest.approx([-5.0, 6.0, -8.78], abs=0.02)
    rig.boot(np.array([1, 0]))
    run(rig, 0.1)
    assert np.linalg.norm(places[0][:2]) < 0.01
    assert places[1][:2] == pytest.approx([-5.0, 6.0], abs=0.01)


def test_the_same_twice_is_the_same_bits_and_a_snapshot_puts_it_back():
    ends = []
    for _ in range(2):
        rig = rig_on(STEEP, JsbsimEngine, commands=0.75)
        put(rig, 5.0, 5.0, 2.0)
        run(rig, 0.1)
        before = rig.snapshot()
        for _ in range(2):
            rig.restore(before)
            ends.append(run(rig, 1.0).copy())
    assert ends[0].tobytes() == ends[2].tobytes()
    assert ends[1].tobytes() == ends[3].tobytes()
    assert ends[1]["pos_ned"] == pytest.approx(ends[0]["pos_ned"], abs=1e-5)  # JSBSim has doubles, our rows have not


def test_what_is_held_in_hands_stays_there_and_goes_on_afterwards():
    rig = rig_on(PLAIN, JsbsimEngine)
    put(rig, 1.0, 2.0, 1.0)
    body = rig.arrays.body.numpy()
    body["is_held"], body["omega_frd"][0] = 1, (1.0, 0.0, 0.0)
    row = run(rig, 0.5).copy()
    assert row["pos_ned"] == pytest.approx([1.0, 2.0, body["pos_ned"][0, 2]])
    assert 2.0 * np.arcsin(row["q_ned_from_frd"][0]) == pytest.approx(0.5, abs=1e-3)
    body["is_held"], body["omega_frd"][0] = 0, 0.0
    assert run(rig, 0.2)["vel_ned"][2] == pytest.approx(0.2 * 9.80665, rel=0.01)


def test_a_flight_by_either_engine_is_the_same_flight():
    """Each on its own estimate: the same modes in the same frames but for three, and much the same places."""
    (modes, places), (their_modes, their_places) = short_flight("native"), short_flight("jsbsim")
    at, their_at = np.flatnonzero(np.diff(modes)) + 1, np.flatnonzero(np.diff(their_modes)) + 1
    assert modes[at].tolist() == their_modes[their_at].tolist()
    assert np.abs(at - their_at).max() <= 3
    count = min(len(places), len(their_places))
    assert np.linalg.norm(places[:count] - their_places[:count], axis=1).max() < 0.15


def test_what_it_does_not_move_is_refused():
    with pytest.raises(ValueError, match="moves multirotors"):
        rig_on(PLAIN, JsbsimEngine, airframe="rover")
    result = CliRunner().invoke(app, ["fly", "--engine", "jsbsim", "--airframe", "rover"])
    assert result.exit_code == 2
    assert "--engine jsbsim: it does not move rover" in result.stderr
