"""PyBullet as an engine: what a vehicle touches, stands on and is put back to; and what it refuses."""

import numpy as np
import pytest
from typer.testing import CliRunner

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import TICK_S
from mission.cli import app
from mission.flight import Flight, FlightConfig
from sim.bodies.vehicles import class_of
from sim.engines.native import NativeEngine
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import WorldConfig, build_world

pytest.importorskip("pybullet")

PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0, size_m=100.0)
STEEP = WorldConfig(
    trees_per_ha=0.0, hill_height_m=7.0, hill_wavelength_m=60.0, octaves=1, size_m=200.0, clearing_radius_m=0.0,
    clearing_blend_m=1.0, seed=5,
)  # fmt: skip


class Idle:
    """A board that asks for the same all the time."""

    def __init__(self, command=0.0):
        self._command = np.full(8, command, np.float32)

    def boot(self, is_chosen):
        pass

    def exchange(self, samples, truth, commands):  # noqa: ARG002
        commands.numpy()[:] = self._command


def rig_on(world, command=0.0, airframe="x500", engine=None):
    from sim.engines.bullet import BulletEngine

    vehicle, body = class_of(load_airframe(airframe))
    return SteppedRig(
        load_airframe(airframe), build_world(world), sensor_model(0.0, DEFAULT_HOME), wind_model(0.0),
        home=DEFAULT_HOME, engine=engine or BulletEngine, board=lambda _: Idle(command), body=body, law=vehicle.law,
    )  # fmt: skip


def run(rig, seconds):
    rig.advance(round(seconds / TICK_S))
    return rig.truth_row()


def drop(rig, north, east, up_m):
    """Puts the vehicle level and still over the ground."""
    body = rig.arrays.body.numpy()
    body["pos_ned"][0] = (north, east, -float(rig.world.height(north, east)) - up_m)
    body["vel_ned"] = 0.0


@pytest.mark.parametrize("place", [(0.0, 0.0), (20.0, -15.0), (-31.0, 12.0)])
def test_it_stands_on_a_slope_where_the_native_engine_does_and_does_not_creep(place):
    """Put down from two centimetres: within 2 cm of each other, and then a millimetre in half a minute."""
    rests = []
    for engine in (NativeEngine, None):
        rig = rig_on(STEEP, engine=engine)
        drop(rig, *place, 0.25)
        rests.append(run(rig, 4.0).copy())
        later = run(rig, 30.0)
        assert np.linalg.norm(later["pos_ned"] - rests[-1]["pos_ned"]) < 1e-3
        assert np.linalg.norm(later["vel_ned"]) < 1e-3
        assert np.linalg.norm(later["accel_frd"]) == pytest.approx(9.80665, rel=1e-3)
        assert (later["is_on_ground"], later["is_crashed"]) == (1, 0)
    assert abs(rests[0]["pos_ned"][2] - rests[1]["pos_ned"][2]) < 0.02
    assert np.linalg.norm(rests[0]["pos_ned"] - rests[1]["pos_ned"]) < 0.06  # it slides a little as it lands


def test_the_slopes_are_some():
    world = build_world(STEEP)
    tilts = [np.degrees(np.arccos(-world.normal_ned(*place)[2])) for place in ((20.0, -15.0), (-31.0, 12.0))]
    assert max(tilts) > 8.0


def test_it_falls_as_with_the_native_engine():
    speeds = []
    for engine in (NativeEngine, None):
        rig = rig_on(PLAIN, engine=engine)
        drop(rig, 0.0, 0.0, 30.0)
        speeds.append(float(run(rig, 1.5)["vel_ned"][2]))
    assert speeds[0] > 12.0
    assert speeds[1] == pytest.approx(speeds[0], abs=0.01)


def test_who_falls_from_high_has_crashed():
    rig = rig_on(PLAIN)
    drop(rig, 0.0, 0.0, 8.0)
    row = run(rig, 3.0)
    assert row["is_crashed"] == 1
    assert row["impact_speed"] > 8.0


@pytest.mark.parametrize("speed", [0.0, 28.0, 60.0])
def test_nothing_falls_through_the_ground(speed):
    for k in range(6):
        rig = rig_on(PLAIN)
        drop(rig, 3.1 * k - 8.0, 1.7 * k, 60.0 if speed == 0.0 else 5.0 + 0.11 * k)
        rig.arrays.body.numpy()["vel_ned"][0] = (0.0, 0.0, speed)
        row = run(rig, 6.0 if speed == 0.0 else 1.0)
        assert row["is_crashed"] == 1
        assert row["impact_speed"] > 5.0
        assert row["height_agl_m"] >= 0.0
        assert np.linalg.norm(row["vel_ned"]) < 3.0


def test_a_landing_aslant_is_as_hard_as_with_the_native_engine():
    speeds = []
    for engine in (NativeEngine, None):
        rig = rig_on(PLAIN, engine=engine)
        drop(rig, 0.0, 0.0, 0.6)
        body = rig.arrays.body.numpy()
        body["q_ned_from_frd"][0] = (np.sin(np.radians(2.5)), 0.0, 0.0, np.cos(np.radians(2.5)))
        body["vel_ned"][0] = (0.0, 0.0, 2.3)
        speeds.append(float(run(rig, 1.0)["impact_speed"]))
    assert speeds[1] == pytest.approx(speeds[0], rel=0.15)


def test_a_trunk_stops_it():
    """Thrown at a trunk it comes no farther, and has struck it as fast as it was."""
    rig = rig_on(WorldConfig(trees_per_ha=150.0, hill_height_m=0.0, size_m=100.0, clearing_radius_m=2.0))
    tree = rig.world.trees[0]
    reach_m = float(tree["trunk_radius"]) + float(rig.arrays.model.numpy()["contact"]["hull_radius_m"][0])
    body = rig.arrays.body.numpy()
    drop(rig, float(tree["north"]) - 2.0, float(tree["east"]), 1.5)
    body["vel_ned"][0] = (6.0, 0.0, -1.0)
    run(rig, 0.5)
    row = rig.truth_row()
    assert float(tree["north"]) - float(row["pos_ned"][0]) > reach_m - 0.1
    assert row["impact_speed"] == pytest.approx(6.0, abs=0.8)


def test_the_same_twice_is_the_same_bits():
    flights = []
    for _ in range(2):
        rig = rig_on(STEEP, command=0.75)
        drop(rig, 5.0, 5.0, 2.0)
        run(rig, 2.0)
        flights.append(rig.truth_row().tobytes())
    assert flights[0] == flights[1]


def test_boot_and_snapshot_put_it_back():
    rig = rig_on(PLAIN, command=0.8)
    before = rig.snapshot()
    first = run(rig, 1.0)
    rig.restore(before)
    rig.restore(before)
    again = run(rig, 1.0)
    assert again["pos_ned"] == pytest.approx(first["pos_ned"], abs=1e-3)
    rig.boot()
    assert np.linalg.norm(run(rig, 0.02)["pos_ned"][:2]) < 0.01


def changes(modes):
    """Frames in which a mode begins, and the modes."""
    frames = np.flatnonzero(np.diff(modes)) + 1
    return frames, [modes[k] for k in frames]


def test_a_flight_by_either_engine_is_the_same_flight():
    """Without noise, each on its own estimate: the same modes, within three frames, and much the same places."""
    tracks = {}
    for engine in ("native", "pybullet"):
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
        tracks[engine] = modes, np.array(places)
    native, bullet = tracks["native"], tracks["pybullet"]
    (at, ours), (bullet_at, theirs) = changes(native[0]), changes(bullet[0])
    assert ours == theirs
    assert np.abs(at - bullet_at).max() <= 3
    count = min(len(native[1]), len(bullet[1]))
    off_m = np.linalg.norm(native[1][:count] - bullet[1][:count], axis=1)
    assert off_m.max() < 0.15


def test_what_it_does_not_move_is_refused():
    with pytest.raises(ValueError, match="moves multirotors"):
        rig_on(PLAIN, airframe="rover")
    result = CliRunner().invoke(app, ["fly", "--engine", "pybullet", "--airframe", "rover"])
    assert result.exit_code == 2
    assert "--engine pybullet: it moves multirotors, and rover is none" in result.stderr
    assert CliRunner().invoke(app, ["fly", "--engine", "none"]).exit_code == 2
