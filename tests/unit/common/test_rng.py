"""Draws: named by their four counters, independent of each other, of the right distribution."""

import numpy as np
import pytest
import warp as wp

from common.rng import normal, normal3, normal6, uniform

wp.set_module_options({"enable_backward": False})

COUNT = 20_000
NAMES = ("seed", "vehicle", "tick", "stream")


@wp.kernel
def _draw(
    names: wp.array(dtype=wp.vec4i),
    ones: wp.array(dtype=float),
    uniforms: wp.array(dtype=float),
    threes: wp.array(dtype=wp.vec3),
    sixes: wp.array2d(dtype=wp.vec3),
):
    i = wp.tid()
    name = names[i]
    ones[i] = normal(name[0], name[1], name[2], name[3])
    uniforms[i] = uniform(name[0], name[1], name[2], name[3])
    threes[i] = normal3(name[0], name[1], name[2], name[3])
    first, second = normal6(name[0], name[1], name[2], name[3])
    sixes[i, 0] = first
    sixes[i, 1] = second


def draw(names):
    """Draws of each kind, one column per number, for rows of (seed, vehicle, tick, stream)."""
    names = np.atleast_2d(names).astype(np.int32)
    count = len(names)
    outputs = [
        wp.zeros(count, dtype=float),
        wp.zeros(count, dtype=float),
        wp.zeros(count, dtype=wp.vec3),
        wp.zeros((count, 2), dtype=wp.vec3),
    ]
    wp.launch(_draw, count, inputs=[wp.array(names, dtype=wp.vec4i)], outputs=outputs)
    ones, uniforms, threes, sixes = (output.numpy().reshape(count, -1).astype(float) for output in outputs)
    return {"normal": ones, "uniform": uniforms, "normal3": threes, "normal6": sixes}


def counted(name, count=COUNT):
    """Names that differ in one counter only."""
    names = np.tile([7, 3, 1000, 20], (count, 1))
    names[:, NAMES.index(name)] = np.arange(count)
    return names


@pytest.fixture(scope="module")
def by_tick():
    return draw(counted("tick"))


def test_equal_names_give_equal_draws_in_any_company_and_order():
    names = counted("tick", 100)
    together, reversed_, alone = draw(names), draw(names[::-1]), draw(names[42])
    for kind, values in together.items():
        np.testing.assert_array_equal(reversed_[kind][::-1], values)
        np.testing.assert_array_equal(alone[kind][0], values[42])


@pytest.mark.parametrize("name", NAMES)
def test_draws_whose_names_differ_in_one_counter_are_independent(name):
    values = draw(counted(name))
    assert len(np.unique(values["normal3"][:, 0])) > 0.99 * COUNT
    for kind in ("normal", "normal3", "normal6"):
        columns = values[kind]
        for lag in (1, 2, 7):
            correlation = (columns[:-lag] * columns[lag:]).mean(axis=0)
            assert (np.abs(correlation) < 4.5 / np.sqrt(COUNT)).all()


def test_counters_are_not_interchangeable():
    values = draw([[1, 2, 3, 4], [2, 1, 3, 4], [1, 3, 2, 4], [1, 2, 4, 3], [4, 3, 2, 1]])["normal"][:, 0]
    assert len(np.unique(values)) == 5


@pytest.mark.parametrize("kind", ["normal", "normal3", "normal6"])
def test_normal_draws_have_the_moments_of_the_standard_normal(by_tick, kind):
    """Bounds of 4.5 deviations of the moments of COUNT draws; fifteen moments of several columns are looked at."""
    values = by_tick[kind]
    root = 4.5 / np.sqrt(COUNT)
    assert (np.abs(values.mean(axis=0)) < root).all()
    assert (np.abs((values**2).mean(axis=0) - 1.0) < root * np.sqrt(2.0)).all()
    assert (np.abs((values**3).mean(axis=0)) < root * np.sqrt(15.0)).all()
    assert (np.abs((values**4).mean(axis=0) - 3.0) < root * np.sqrt(96.0)).all()
    assert np.abs(np.corrcoef(values.T) - np.eye(values.shape[1])).max() < root
    assert np.isfinite(values).all()


def test_uniform_draws_fill_the_unit_interval_evenly(by_tick):
    values = by_tick["uniform"][:, 0]
    assert values.min() >= 0.0
    assert values.max() < 1.0
    counts, _ = np.histogram(values, bins=20, range=(0.0, 1.0))
    expected = COUNT / 20
    assert ((counts - expected) ** 2 / expected).sum() < 43.8  # chi-square of 19, 99.9 %
