"""Poisson-disc points: random, yet never closer together than a given spacing. Trees stand on them."""

from functools import lru_cache
from math import ceil, sqrt

import numpy as np

from sim.world.terrain import FloatArray

TRIALS = 12  # darts thrown at each empty cell
FAR = 1.0e9  # [m] where the point of an empty cell lies
COVERAGE = 0.64  # points per spacing² reached with these trials; measured, the limit is about 0.7 (Wei 2008)


@lru_cache(maxsize=8)  # one flight after another has the same trees
def poisson_disc(seed: int, side_m: float, spacing_m: float, keep_out_m: float) -> FloatArray:
    """Seeded points [m] at least `spacing_m` apart that fill a square, shape (points, 2), north and east; read-only.

    Parallel dart throwing on a grid whose cells hold at most one point (Wei 2008, "Parallel Poisson disk sampling"):
    cells three apart cannot disturb each other, so each ninth of the grid is filled at once.

    Args:
        seed: same seed, same bytes.
        side_m: side of the square centred on home [m]; no points if negative.
        spacing_m: smallest distance between two points [m].
        keep_out_m: radius round home without points [m].
    """
    rng = np.random.default_rng([seed, 2])  # 2: stream of the tree positions
    if side_m <= 0.0:
        return np.zeros((0, 2))
    cell_m = spacing_m / sqrt(2.0)
    count = ceil(side_m / cell_m)
    side = count + 4  # two empty cells all round spare the edge cases
    north, east = np.full(side * side, FAR), np.full(side * side, FAR)
    neighbours = [d_row * side + d_column for d_row in range(-2, 3) for d_column in range(-2, 3)]
    for _ in range(TRIALS):
        for phase in rng.permutation(9):
            rows, columns = np.meshgrid(np.arange(phase // 3, count, 3), np.arange(phase % 3, count, 3), indexing="ij")
            darts = (np.stack([rows, columns], axis=-1) + rng.random((*rows.shape, 2))) * cell_m
            x, y = darts[..., 0], darts[..., 1]
            cells = (rows + 2) * side + columns + 2
            is_good = (north[cells] == FAR) & (x < side_m) & (y < side_m)
            is_good &= (x - 0.5 * side_m) ** 2 + (y - 0.5 * side_m) ** 2 > keep_out_m**2
            cells, x, y = cells[is_good], x[is_good], y[is_good]
            is_free = np.ones(len(cells), dtype=bool)
            for neighbour in neighbours:
                other = cells + neighbour
                is_free &= (x - north[other]) ** 2 + (y - east[other]) ** 2 >= spacing_m**2
            north[cells[is_free]], east[cells[is_free]] = x[is_free], y[is_free]
    points = np.stack([north, east], axis=-1).reshape(side, side, 2)[2:-2, 2:-2].reshape(-1, 2)
    found = np.asarray(points[points[:, 0] != FAR] - 0.5 * side_m)
    found.setflags(write=False)
    return found
