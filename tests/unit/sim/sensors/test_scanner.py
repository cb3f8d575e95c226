"""The scanner: what an error of the attitude that it is levelled by does."""

import numpy as np
import pytest
import warp as wp

from common.attitude import product, quat_of
from common.range_sectors import BEAM_ELEVATIONS_DEG, RANGE_M, RANGES, SECTORS
from sim.sensors.scanner import BAND_M, scan_once
from sim.world.batch import grown_world
from sim.world.forest_world import FOREST, WALLED_FOREST
from sim.world.world import WorldConfig, build_world

LEVEL = quat_of(0.0, 0.0)


@pytest.fixture(scope="module")
def plain():
    return build_world(WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0))


@pytest.fixture(scope="module")
def forest():
    return grown_world(FOREST.model_copy(update={"hill_height_m": 0.0}), 5)


def scanned(world, q_true=LEVEL, q_est=LEVEL, pos_ned=(0.0, 0.0, -2.0), noise=0.0):
    ranges = wp.zeros((1, RANGES), dtype=float)
    inputs = [world.kernel, wp.vec3(*pos_ned), wp.quat(*q_true), wp.quat(*q_est), noise, 1, 25]
    wp.launch(scan_once, dim=1, inputs=inputs, outputs=[ranges])
    return ranges.numpy()[0].copy()


def test_beams_meet_level_ground_where_they_should(plain):
    for k, elevation_deg in enumerate(BEAM_ELEVATIONS_DEG[:2]):
        expected = 2.0 / np.sin(np.radians(-elevation_deg))
        assert scanned(plain)[SECTORS + k] == pytest.approx(expected, rel=1e-3)


def test_a_lean_that_is_known_changes_nothing(plain, forest):
    leaning = quat_of(0.0, np.radians(-20.0))
    for world in (plain, forest):
        assert scanned(world, leaning, leaning) == pytest.approx(scanned(world), abs=1e-3)


def test_a_lean_that_is_not_known_tilts_the_beams(plain):
    error_deg = 3.0
    nose_up = quat_of(0.0, np.radians(error_deg))  # believed level
    expected = 2.0 / np.sin(np.radians(30.0 - error_deg))
    assert scanned(plain, nose_up)[SECTORS] == pytest.approx(expected, rel=1e-3)


def test_a_heading_that_is_wrong_does_not_turn_what_is_measured_from_the_body(forest):
    wrong = quat_of(np.radians(40.0), 0.0)
    assert scanned(forest, LEVEL, wrong) == pytest.approx(scanned(forest), abs=1e-3)
    both = product(quat_of(np.radians(30.0), 0.0), quat_of(0.0, np.radians(-10.0)))
    turned = product(wrong, both)  # a lean with the same wrong heading
    assert scanned(forest, both, turned) == pytest.approx(scanned(forest, both, both), abs=1e-3)


def test_a_tilted_band_reaches_the_crowns_ahead_and_misses_nothing_else(forest):
    level = scanned(forest)[:SECTORS]
    tilted = scanned(forest, quat_of(0.0, np.radians(15.0)))[:SECTORS]  # believed level: looks up ahead
    assert (level < RANGE_M).any()
    ahead = slice(SECTORS // 2 - 4, SECTORS // 2 + 4)
    assert (tilted[ahead] <= level[ahead] + 1e-3).all()
    assert (tilted[ahead] < level[ahead] - 0.3).any()


def test_noise_is_two_percent_and_now_and_then_nothing(forest):
    exact, noisy = scanned(forest), scanned(forest, noise=1.0)
    hit = (exact < RANGE_M) & (noisy < RANGE_M)
    assert 0.005 < np.std(noisy[hit] / exact[hit]) < 0.04


def cast(boxes, north, east, height, angles):
    """Distances [m] to boxes along level rays, inf for none."""
    nearest = np.full(len(angles), np.inf)
    for box in boxes:
        if height - BAND_M > box["high"]:
            continue
        axes = np.array([[box["cos_yaw"], box["sin_yaw"]], [-box["sin_yaw"], box["cos_yaw"]]])
        start = axes @ np.array((north - box["north"], east - box["east"]))
        along = np.array((np.cos(angles), np.sin(angles)))
        half = np.array((box["half_length"], box["half_width"]))
        ends = (np.array((-half, half))[:, :, None] - start[:, None]) / (axes @ along)
        entry, leaving = ends.min(axis=0).max(axis=0), ends.max(axis=0).min(axis=0)
        is_met = (entry <= leaving) & (leaving > 0.0)
        nearest[is_met] = np.minimum(nearest[is_met], np.maximum(entry[is_met], 0.0))
    return nearest


def test_no_wall_is_missed_that_fine_rays_meet_and_none_seen_where_none_stands():
    """Of a grown world without trees: against a hundred rays a sector, cast here. A thin wall shows its end as well."""
    walls = grown_world(WALLED_FOREST.model_copy(update={"trees_per_ha": 0.0, "hill_height_m": 0.0}), 7)
    height, rng = 0.3, np.random.default_rng(3)
    fine = np.radians(-120.0 + 5.0 * (np.arange(100 * SECTORS) + 0.5) / 100.0)
    seen = missed = invented = 0
    for north, east in rng.uniform(-45.0, 45.0, (40, 2)):
        ranges_m = scanned(walls, pos_ned=(north, east, -height))[:SECTORS]
        nearest = cast(walls.boxes.rows, north, east, height, fine).reshape(SECTORS, 100).min(axis=1)
        is_there, is_shown = nearest < RANGE_M - 0.5, ranges_m < RANGE_M
        missed += int((is_there & ~is_shown).sum())
        invented += int((is_shown & ~np.isfinite(nearest)).sum())
        seen += int(is_shown.sum())
    assert seen > 200
    assert missed <= 0.005 * seen  # slivers whose corner is out of reach
    assert invented <= 0.01 * seen  # between two of the fine rays


def test_walls_are_as_far_as_they_are():
    walls = grown_world(WALLED_FOREST.model_copy(update={"trees_per_ha": 0.0, "hill_height_m": 0.0}), 7)
    height = 0.3
    rays = np.radians(-120.0 + 5.0 * (np.arange(3 * SECTORS) + 0.5) / 3.0)
    for north, east in ((0.0, 0.0), (12.0, -20.0), (-25.0, 8.0), (30.0, 30.0), (-10.0, -35.0), (20.0, 5.0)):
        ranges_m = scanned(walls, pos_ned=(north, east, -height))[:SECTORS]
        expected = np.minimum(
            cast(walls.boxes.rows, north, east, height, rays).reshape(SECTORS, 3).min(axis=1), RANGE_M
        )
        assert (ranges_m < expected + 1e-3).all()
        assert np.median(np.abs(ranges_m - expected)) < 1e-3
