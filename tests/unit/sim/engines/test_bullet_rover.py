"""A rover in Bullet's world beside the same rover in the native engine: courses, slopes, walls, trunks."""

import numpy as np
import pytest

from sim.engines.native import NativeEngine
from sim.world.world import WorldConfig
from tests.unit.sim.engine_rig import PLAIN, STEEP, put, rig_on, run, with_boxes

pytest.importorskip("pybullet")
from sim.engines.bullet import BulletEngine

FOREST = WorldConfig(trees_per_ha=150.0, hill_height_m=0.0, size_m=100.0, clearing_radius_m=2.0)
ENGINES = (NativeEngine, BulletEngine)
COURSE = [
    (4.0, (0.0, 0.35)), (10.0, (0.4, 0.35)), (16.0, (-0.5, 0.3)), (18.0, (0.0, 0.5)), (20.0, (0.0, 0.0, 0.5)),
    (26.0, (0.2, -0.2)), (np.inf, (-0.2, 0.4)),
]  # fmt: skip
SKID_COURSE = [
    (4.0, (0.4, 0.4)), (12.0, (0.5, 0.4)), (18.0, (0.35, 0.5)), (20.0, (0.0, 0.0)), (26.0, (-0.4, -0.3)),
    (np.inf, (0.5, 0.5)),
]  # fmt: skip


def standing_m(rig):
    return float(rig.arrays.model.numpy()["standing_m"][0])


def track(engine, airframe, commands, seconds, world=PLAIN):
    """Position and attitude every 20 ms, shape (frames, 7)."""
    rig = rig_on(world, engine, commands, airframe)
    rows = []
    for _ in range(round(seconds / 0.02)):
        row = run(rig, 0.02)
        rows.append(np.concatenate([row["pos_ned"], row["q_ned_from_frd"]]).astype(float))
    return np.array(rows)


def radius_of(points):
    """Of the circle that fits points best, shape (points, 2)."""
    x, y = points.T
    east, north, rest = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2, rcond=None)[0]
    return np.sqrt(rest + east**2 + north**2)


@pytest.mark.parametrize(("airframe", "command"), [("rover", (0.6, 0.3)), ("rover-skid", (0.5, 0.35))])
def test_its_circles_are_as_wide(airframe, command):
    radii = [radius_of(track(engine, airframe, command, 20.0)[500:, :2]) for engine in ENGINES]
    assert 0.5 < radii[0] < 10.0
    assert radii[1] == pytest.approx(radii[0], rel=0.001)


@pytest.mark.parametrize(("airframe", "course"), [("rover", COURSE), ("rover-skid", SKID_COURSE)])
def test_30_s_of_a_course_end_in_the_same_place(airframe, course):
    """Bends to both sides, a stop and a way back, on hills; 5 cm at most between them."""
    native, bullet = (track(engine, airframe, course, 30.0, STEEP) for engine in ENGINES)
    assert np.ptp(native[:, :2], axis=0).max() > 10.0
    assert np.ptp(native[:, 2]) > 0.3
    assert np.linalg.norm(native[:, :3] - bullet[:, :3], axis=1).max() < 0.01
    assert np.abs(np.sum(native[:, 3:] * bullet[:, 3:], axis=1)).min() > np.cos(np.radians(0.1))  # 0.2 deg


@pytest.mark.parametrize("place", [(0.0, 0.0), (20.0, -15.0), (-31.0, 12.0)])
@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_it_stands_braked_on_a_slope(place, airframe):
    rests = []
    for engine in ENGINES:
        rig = rig_on(STEEP, engine, (0.0, 0.0, 1.0), airframe)
        put(rig, *place, standing_m(rig) + 0.02)
        rests.append(run(rig, 4.0))
        later = run(rig, 30.0)
        assert np.linalg.norm(later["pos_ned"] - rests[-1]["pos_ned"]) < 1e-3
        assert np.linalg.norm(later["accel_frd"]) == pytest.approx(9.80665, rel=1e-3)
        assert (later["is_on_ground"], later["is_crashed"]) == (1, 0)
    assert np.linalg.norm(rests[0]["pos_ned"] - rests[1]["pos_ned"]) < 0.02


def run_into(engine, world, speed, north_m, east_m, airframe="rover"):
    """Truth after it has rolled to the north for two seconds from a place, at a speed; and how long its nose is."""
    rig = rig_on(world, engine, (0.0, 0.0, 0.0), airframe)
    model = rig.arrays.model.numpy()
    model["motor_n_s_m"] = 0.0
    put(rig, north_m, east_m, standing_m(rig))
    run(rig, 0.5)
    body = rig.arrays.body.numpy()
    body["vel_ned"][0] = (speed, 0.0, 0.0)
    body["wheel_speed"][0] = speed / float(model["radius_m"][0])
    return run(rig, 2.0), float(model["hull_front_m"][0])


@pytest.mark.parametrize("speed", [1.5, 3.0, 6.0])
def test_a_wall_stops_it(speed):
    """Bullet's hull is rigid and stays there; the native one yields and throws it back."""
    face = 3.0
    wall = with_boxes((face + 0.1, 0.0, 1.0, 0.0, 0.1, 3.0, -1.0, 1.0, 0.0, 0, 0))
    impacts = []
    for engine in ENGINES:
        row, front_m = run_into(engine, wall, speed, 1.0, 0.0)
        thrown_back_m = face - front_m - row["pos_ned"][0]
        assert -0.01 < thrown_back_m < (0.05 if engine is BulletEngine else 0.6)
        assert abs(row["vel_ned"][0]) < 0.2
        impacts.append(row["impact_speed"])
        assert speed - 0.4 < impacts[-1] < speed
        assert row["is_crashed"] == int(speed > 4.0)
    assert impacts[1] == pytest.approx(impacts[0], abs=0.01)


@pytest.mark.parametrize("aside_m", [0.0, 0.15])
def test_a_trunk_stops_it(aside_m):
    for engine in ENGINES:
        rig = rig_on(FOREST, engine, airframe="rover")
        tree = rig.world.trees[0]
        radius, north, east = (float(tree[name]) for name in ("trunk_radius", "north", "east"))
        row, front_m = run_into(engine, rig.world, 3.0, north - 2.0, east + aside_m)
        assert row["pos_ned"][0] < north
        assert row["impact_speed"] == pytest.approx(2.87, abs=0.05)
        gap_m = np.hypot(row["pos_ned"][0] - north, row["pos_ned"][1] - east) - radius
        assert gap_m > 0.5 * front_m


def test_who_lies_on_its_roof_stays_there():
    """And its hull touches the ground, of which its wheels know nothing."""
    for engine in ENGINES:
        rig = rig_on(PLAIN, engine, airframe="rover")
        put(rig, 0.0, 0.0, 0.4)
        rig.arrays.body.numpy()["q_ned_from_frd"][0] = (1.0, 0.0, 0.0, 0.0)
        row = run(rig, 3.0)
        top_m = float(rig.arrays.model.numpy()["hull_top_m"][0])
        assert -row["pos_ned"][2] == pytest.approx(top_m, abs=0.02)
        assert np.linalg.norm(row["vel_ned"]) < 1e-2
        assert (row["is_on_ground"], row["is_crashed"]) == (0, 1)


def test_the_same_twice_is_the_same_bits():
    tracks = [track(BulletEngine, "rover", COURSE, 10.0, STEEP) for _ in range(2)]
    assert np.array_equal(*tracks)
