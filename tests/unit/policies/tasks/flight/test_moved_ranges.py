"""Ranges measured a while ago, as they would be from here: beside what the scanner measures from here."""

import math

import numpy as np
import pytest
import warp as wp

from common.attitude import quat_of
from common.range_sectors import GROUND_RING, RANGES, SCANNER
from sim.sensors.scanner import scan_once
from sim.world.batch import grown_world
from sim.world.forest_world import FOREST
from tests.unit.policies.tasks.flight.moving import moved

FORWARD = (1.0, 0.0, 0.0)  # ahead, right [m] and turn [rad] since the scan: 0.2 s of the fastest flight
ASIDE = (0.3, -0.8, 0.0)
TURNING = (0.7, 0.2, 0.5)


@pytest.fixture(scope="module")
def forest():
    return grown_world(FOREST.model_copy(update={"hill_height_m": 0.0, "trees_per_ha": 600.0}), 5)


def scanned(world, pose):
    ranges = wp.zeros((1, RANGES), dtype=float)
    attitude = wp.quat(*quat_of(pose[2], 0.0))
    inputs = [world.kernel, wp.vec3(pose[0], pose[1], -2.0), attitude, attitude, 0.0, 1, 25]
    wp.launch(scan_once, dim=1, inputs=inputs, outputs=[ranges])
    return ranges.numpy()[0]


def later(was, ahead, right, turn):
    north, east, heading = was
    cosine, sine = math.cos(heading), math.sin(heading)
    return north + ahead * cosine - right * sine, east + ahead * sine + right * cosine, heading + turn


def free_poses(world, count=40):
    """Places with room round them, and headings."""
    found = []
    for north, east, heading in np.random.default_rng(4).uniform((-30, -30, -3), (30, 30, 3), (400, 3)):
        if scanned(world, (north, east, heading))[: SCANNER.sectors].min() > 1.5:
            found.append((float(north), float(east), float(heading)))
    return found[:count]


@pytest.mark.parametrize("layout", [SCANNER, GROUND_RING])
def test_who_has_not_moved_is_shown_what_was_measured(layout):
    measured = np.random.default_rng(1).uniform(0.3, 1.2 * layout.range_m, layout.sectors).clip(max=layout.range_m)
    here = (12.0, -7.0, 2.5)
    assert moved(measured, here, here, layout) == pytest.approx(measured, abs=1e-4)


@pytest.mark.parametrize("way", [FORWARD, ASIDE, TURNING])
def test_forest_is_shown_nearly_as_the_scanner_measures_it_from_here(forest, way):
    n = SCANNER.sectors
    shown_off, kept_off = [], []
    for was in free_poses(forest):
        now = later(was, *way)
        measured, true = scanned(forest, was)[:n], scanned(forest, now)[:n]
        shown = moved(measured, was, now)
        near = true < 6.0
        shown_off.extend(np.abs(shown - true)[near])
        kept_off.extend(np.abs(measured - true)[near])
    assert np.median(shown_off) < 0.12  # a sector tells the nearest of what is in it, not where in it
    assert np.median(shown_off) < 0.4 * np.median(kept_off)
    assert np.mean(np.array(shown_off) > 0.5) < 0.6 * np.mean(np.array(kept_off) > 0.5)


@pytest.mark.parametrize("way", [FORWARD, ASIDE, TURNING])
def test_nothing_near_is_lost(forest, way):
    """Of what was within sight then and near now, something is shown within a sector of where it is, as near."""
    n, missed, count = SCANNER.sectors, 0, 0
    for was in free_poses(forest):
        now = later(was, *way)
        true, shown = scanned(forest, now)[:n], moved(scanned(forest, was)[:n], was, now)
        for k in range(3, n - 3):
            if true[k] < 3.0:
                count += 1
                missed += shown[k - 1 : k + 2].min() > true[k] + 0.4
    assert count > 100
    assert missed < 0.03 * count  # crowns that were hidden then


def test_ring_all_round_turns_through_its_seam():
    measured = np.full(GROUND_RING.sectors, GROUND_RING.range_m)
    measured[71] = 4.0
    turned = moved(measured, (0.0, 0.0, 0.0), (0.0, 0.0, -math.radians(10.0)), GROUND_RING)
    assert np.flatnonzero(turned < GROUND_RING.range_m).tolist() == [1]
    assert turned[1] == pytest.approx(4.0, abs=1e-4)


def test_a_wall_that_is_come_near_to_fills_more_sectors():
    measured = np.full(GROUND_RING.sectors, GROUND_RING.range_m)
    measured[0] = 2.0  # a plate 0.17 m wide
    near = moved(measured, (0.0, 0.0, 0.0), (1.6, 0.0, 0.0), GROUND_RING)
    assert set(np.flatnonzero(near < GROUND_RING.range_m)) == {70, 71, 0, 1, 2}
    assert near[0] == pytest.approx(0.4, abs=1e-4)


def test_what_is_behind_a_scanner_that_does_not_look_there_is_not_shown():
    measured = np.full(RANGES, SCANNER.range_m)
    measured[SCANNER.sectors // 2] = 1.0
    passed = moved(measured, (0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    assert (passed[: SCANNER.sectors] == SCANNER.range_m).all()
