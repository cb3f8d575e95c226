"""PyBullet as an engine: what a vehicle touches, stands on and is put back to; and what it refuses."""

from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import TICK_S
from mission.cli import app
from sim.bodies.multirotor_model import multirotor_model
from sim.engines.native import NativeEngine
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import WorldConfig, build_world
from tests.reference.engine_flight import hover_speed
from tests.unit.sim.engine_rig import PLAIN, STEEP, put, rig_on, run, with_boxes
from tests.unit.sim.sled import SLED_BODY, SLED_LAW

pytest.importorskip("pybullet")
from sim.engines.bullet import BulletEngine

FOREST = WorldConfig(trees_per_ha=150.0, hill_height_m=0.0, size_m=100.0, clearing_radius_m=2.0)


@pytest.mark.parametrize("place", [(0.0, 0.0), (20.0, -15.0), (-31.0, 12.0)])
def test_it_stands_on_a_slope_where_the_native_engine_does_and_does_not_creep(place):
    """Put down from two centimetres: within a millimetre of each other, and then a millimetre in half a minute."""
    rests = []
    for engine in (NativeEngine, BulletEngine):
        rig = rig_on(STEEP, engine)
        put(rig, *place, 0.25)
        rests.append(run(rig, 4.0))
        later = run(rig, 30.0)
        assert np.linalg.norm(later["pos_ned"] - rests[-1]["pos_ned"]) < 1e-3
        assert np.linalg.norm(later["vel_ned"]) < 1e-3
        assert np.linalg.norm(later["accel_frd"]) == pytest.approx(9.80665, rel=1e-3)
        assert (later["is_on_ground"], later["is_crashed"]) == (1, 0)
    assert np.linalg.norm(rests[0]["pos_ned"] - rests[1]["pos_ned"]) < 1e-3
    assert np.abs(rests[0]["q_ned_from_frd"] - rests[1]["q_ned_from_frd"]).max() < 1e-4


def test_who_stands_on_level_ground_stands_upright():
    rig = rig_on(PLAIN, BulletEngine)
    row = run(rig, 30.0)
    assert np.hypot(*row["q_ned_from_frd"][:2]) < 1e-5
    assert np.linalg.norm(row["pos_ned"][:2]) < 1e-5
    assert row["accel_frd"] == pytest.approx([0.0, 0.0, -9.80665], abs=1e-3)


def test_the_slopes_are_some():
    world = build_world(STEEP)
    tilts = [np.degrees(np.arccos(-world.normal_ned(*place)[2])) for place in ((20.0, -15.0), (-31.0, 12.0))]
    assert max(tilts) > 8.0


def test_it_falls_as_with_the_native_engine():
    speeds = []
    for engine in (NativeEngine, BulletEngine):
        rig = rig_on(PLAIN, engine)
        put(rig, 0.0, 0.0, 30.0)
        speeds.append(float(run(rig, 1.5)["vel_ned"][2]))
    assert speeds[0] > 12.0
    assert speeds[1] == pytest.approx(speeds[0], abs=0.01)


def test_who_falls_from_high_has_crashed():
    rig = rig_on(PLAIN, BulletEngine)
    put(rig, 0.0, 0.0, 8.0)
    row = run(rig, 3.0)
    assert row["is_crashed"] == 1
    assert row["impact_speed"] > 8.0


@pytest.mark.parametrize("speed", [0.0, 28.0, 60.0])
def test_nothing_falls_through_the_ground(speed):
    for k in range(6):
        rig = rig_on(PLAIN, BulletEngine)
        put(rig, 3.1 * k - 8.0, 1.7 * k, 60.0 if speed == 0.0 else 5.0 + 0.11 * k)
        rig.arrays.body.numpy()["vel_ned"][0] = (0.0, 0.0, speed)
        row = run(rig, 6.0 if speed == 0.0 else 1.0)
        assert row["is_crashed"] == 1
        assert row["impact_speed"] > 5.0
        assert row["height_agl_m"] >= 0.0
        assert np.linalg.norm(row["vel_ned"]) < 3.0


def test_a_landing_aslant_is_as_hard_as_with_the_native_engine():
    speeds = []
    for engine in (NativeEngine, BulletEngine):
        rig = rig_on(PLAIN, engine)
        put(rig, 0.0, 0.0, 0.6)
        body = rig.arrays.body.numpy()
        body["q_ned_from_frd"][0] = (np.sin(np.radians(2.5)), 0.0, 0.0, np.cos(np.radians(2.5)))
        body["vel_ned"][0] = (0.0, 0.0, 2.3)
        speeds.append(float(run(rig, 1.0)["impact_speed"]))
    assert speeds[1] == pytest.approx(speeds[0], rel=0.15)


def test_a_trunk_stops_it():
    """Thrown at a trunk it comes no farther, and has struck it as fast as it was."""
    rig = rig_on(FOREST, BulletEngine)
    tree = rig.world.trees[0]
    reach_m = float(tree["trunk_radius"]) + float(rig.arrays.model.numpy()["contact"]["hull_radius_m"][0])
    body = rig.arrays.body.numpy()
    put(rig, float(tree["north"]) - 2.0, float(tree["east"]), 1.5)
    body["vel_ned"][0] = (6.0, 0.0, -1.0)
    run(rig, 0.5)
    row = rig.truth_row()
    assert float(tree["north"]) - float(row["pos_ned"][0]) > reach_m - 0.1
    assert row["impact_speed"] == pytest.approx(6.0, abs=0.8)


def test_the_same_twice_is_the_same_bits():
    flights = []
    for _ in range(2):
        rig = rig_on(STEEP, BulletEngine, 0.75)
        put(rig, 5.0, 5.0, 2.0)
        run(rig, 2.0)
        flights.append(rig.truth_row().tobytes())
    assert flights[0] == flights[1]


def test_boot_and_snapshot_put_it_back():
    rig = rig_on(PLAIN, BulletEngine, 0.8)
    run(rig, TICK_S)  # what a board has commanded is in no snapshot
    before = rig.snapshot()
    first = run(rig, 1.0)
    rig.restore(before)
    rig.restore(before)
    again = run(rig, 1.0)
    assert first["pos_ned"][2] < -1.0
    assert again["pos_ned"] == pytest.approx(first["pos_ned"], abs=1e-5)
    rig.boot()
    assert np.linalg.norm(run(rig, 0.02)["pos_ned"][:2]) < 0.01


def hovering(world, engine, places, **options):
    """Vehicles that hover 3 m over places, open loop."""
    airframe = load_airframe("x500")
    model = multirotor_model(airframe, DEFAULT_HOME.alt_m)
    speed = hover_speed(airframe, float(model.home_density_ratio))
    share, curve = speed / float(model.max_speed_rad_s), float(model.command_curve)
    command = ((np.sqrt((1.0 - curve) ** 2 + 4.0 * curve * share) - 1.0 + curve) / (2.0 * curve)) ** 2
    rig = rig_on(world, engine, [(np.inf, [command] * 4)], vehicle_count=len(places), **options)
    for i, place in enumerate(places):
        put(rig, *place, 3.0, i_vehicle=i)
    rig.arrays.body.numpy()["rotor_speed"][:, :4] = speed
    return rig


@pytest.mark.parametrize("speed_m_s", [0.5, 2.0, 4.0])
def test_a_box_that_moves_takes_along_who_hovers(speed_m_s):
    """It is let through by neither engine, and pushed on about as fast as the box is."""
    way_m = 6.0
    period_ticks = round(2.0 * way_m / speed_m_s / TICK_S)
    cart = (0.0, 0.0, 1.0, 0.0, 0.5, 2.0, -1.0, 5.0, 0.5 * way_m, period_ticks, 0)  # comes from 3 m ahead
    for engine in (NativeEngine, BulletEngine):
        rig = hovering(with_boxes(cart), engine, [(0.0, 0.0)])
        hull_m = float(rig.arrays.model.numpy()["contact"]["hull_radius_m"][0])
        meeting_s = (0.5 * way_m - 0.5 - hull_m) / speed_m_s
        assert abs(run(rig, meeting_s - 0.02)["vel_ned"][0]) < 1e-3
        gaps_m = []
        for _ in range(16):
            row = run(rig, 0.012)
            face = rig.world.boxes.middle(int(rig.arrays.tick.numpy()[0]))[0][0] - 0.5
            gaps_m.append(face - row["pos_ned"][0])
        assert min(gaps_m) > hull_m - 0.1
        assert max(gaps_m) < hull_m + 0.1
        assert row["vel_ned"][0] == pytest.approx(-speed_m_s, rel=0.3)


def fallen_on(engine):
    """Two vehicles, the second 0.6 m over the first, which stands; it falls for a second."""
    rig = rig_on(PLAIN, engine, vehicle_count=2)
    put(rig, 0.0, 0.0, 0.6 + standing_m(rig), i_vehicle=1)
    run(rig, 1.0)
    return rig.arrays.truth.numpy().copy()


def standing_m(rig):
    return float(rig.arrays.model.numpy()["contact"]["leg_frd"][0, 2])


def test_vehicles_touch_each_other_where_they_are_asked_to():
    apart, touching = fallen_on(BulletEngine), fallen_on(partial(BulletEngine, has_contacts=True))
    assert abs(apart["pos_ned"][0, 2] - apart["pos_ned"][1, 2]) < 0.01  # through each other
    assert touching["pos_ned"][0, 2] - touching["pos_ned"][1, 2] > 0.1  # one lies on the other
    assert touching["impact_speed"][1] == pytest.approx(np.sqrt(2.0 * 9.80665 * 0.45), rel=0.3)
    assert touching["impact_speed"][0] == pytest.approx(touching["impact_speed"][1], rel=1e-3)  # the same blow


def test_two_that_fly_into_each_other_bounce_apart_alike():
    """Of the same mass, towards each other: their momentum stays nothing, and neither gets through."""
    rig = hovering(PLAIN, partial(BulletEngine, has_contacts=True), [(0.0, 0.0), (2.0, 0.0)])
    rig.arrays.body.numpy()["vel_ned"][:, 0] = (2.0, -2.0)
    run(rig, 0.3)
    closing_m_s = -float(np.diff(rig.arrays.truth.numpy()["vel_ned"][:, 0])[0])
    run(rig, 0.06)  # they meet after 0.31 s; then what they touch with, above their centres, turns them away
    rows = rig.arrays.truth.numpy()
    assert rows["pos_ned"][1, 0] - rows["pos_ned"][0, 0] > 0.6
    assert rows["vel_ned"][:, 0].sum() == pytest.approx(0.0, abs=0.05)
    assert np.abs(rows["vel_ned"][:, 0]).max() < 0.6
    assert closing_m_s > 3.5
    assert rows["impact_speed"] == pytest.approx([closing_m_s] * 2, abs=0.1)


def test_only_who_is_held_is_held():
    """Beside one in somebody's hands another flies as it does alone."""
    alone = hovering(PLAIN, BulletEngine, [(0.0, 0.0)])
    rig = hovering(PLAIN, BulletEngine, [(0.0, 0.0), (4.0, 0.0)])
    body = rig.arrays.body.numpy()
    body["is_held"][1] = 1
    body["omega_frd"][1] = (0.0, 0.0, 0.5)
    expected = run(alone, 2.0)
    row = run(rig, 2.0)
    assert row.tobytes() == expected.tobytes()
    held = rig.truth_row(1)
    assert held["pos_ned"] == pytest.approx([4.0, 0.0, -3.0])
    assert 2.0 * np.arctan2(held["q_ned_from_frd"][2], held["q_ned_from_frd"][3]) == pytest.approx(1.0, abs=1e-3)
    body["is_held"][1], body["omega_frd"][1] = 0, 0.0
    later = run(rig, 0.4)
    assert np.linalg.norm(later["pos_ned"] - row["pos_ned"]) < 0.5
    assert np.linalg.norm(rig.truth_row(1)["vel_ned"]) > 0.05  # it has been let go


def test_what_it_does_not_move_is_refused():
    with pytest.raises(ValueError, match="does not move vehicles of this class"):
        SteppedRig(
            load_airframe("x500"), build_world(PLAIN), sensor_model(0.0, DEFAULT_HOME), wind_model(0.0),
            home=DEFAULT_HOME, engine=BulletEngine, body=SLED_BODY, law=SLED_LAW,
        )  # fmt: skip
    assert CliRunner().invoke(app, ["fly", "--engine", "none"]).exit_code == 2
