"""Poisson-disc points: random, yet never closer together than a given spacing. Trees stand on them."""

from math import ceil, sqrt

import numpy as np

from sim.world.terrain import FloatArray

TRIALS = 12  # darts thrown at each empty cell
COVERAGE = 0.64  # points per spacing² reached with these trials; measured, the limit is about 0.7 (Wei 2008)


def poisson_disc(seed: int, side_m: float, spacing_m: float, keep_out_m: float) -> FloatArray:
    """Seeded points [m] at least `spacing_m` apart that fill a square, shape (points, 2), north and east.

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
    far = 1.0e9
    points = np.full((count + 4, count + 4, 2), far)  # two empty cells all round spare the edge cases
    for _ in range(TRIALS):
        for phase in rng.permutation(9):
            rows, columns = np.meshgrid(np.arange(phase // 3, count, 3), np.arange(phase % 3, count, 3), indexing="ij")
            darts = (np.stack([rows, columns], axis=-1) + rng.random((*rows.shape, 2))) * cell_m
            rows, columns = rows + 2, columns + 2
            from_home = darts - 0.5 * side_m
            is_good = (points[rows, columns, 0] == far) & (darts < side_m).all(axis=-1)
            is_good &= (from_home**2).sum(axis=-1) > keep_out_m**2
            rows, columns, darts = rows[is_good], columns[is_good], darts[is_good]
            is_free = np.ones(len(darts), dtype=bool)
            for d_row in range(-2, 3):
                for d_column in range(-2, 3):
                    other = points[rows + d_row, columns + d_column]
                    is_free &= ((darts - other) ** 2).sum(axis=-1) >= spacing_m**2
            points[rows[is_free], columns[is_free]] = darts[is_free]
    inner = points[2:-2, 2:-2].reshape(-1, 2)
    return np.asarray(inner[inner[:, 0] != far] - 0.5 * side_m)
