"""Worlds to drive in, grown in batches from a seed each: a course through hills, and a car park on a hillside."""

from sim.world.world import WorldConfig

COURSE = WorldConfig(
    size_m=80.0,
    cell_m=2.0,
    hill_height_m=1.8,
    hill_wavelength_m=60.0,
    octaves=2,
    clearing_radius_m=1.0,
    clearing_blend_m=8.0,
    trees_per_ha=80.0,
    tree_height_min_m=6.0,
    tree_height_max_m=12.0,
    has_walls=True,
    wall_height_m=2.0,
    wall_count=16,
    mover_count=4,
)
"""Walls, kerbs, trees and movers on slopes of up to 10 degrees or so."""

CAR_PARK = COURSE.model_copy(
    update={
        "size_m": 50.0,
        "hill_height_m": 1.0,
        "trees_per_ha": 0.0,
        "wall_count": 0,
        "mover_count": 2,
        "spot_count": 5,
    }
)
"""Two rows of five spots on a yard that slopes by up to 5 degrees or so, and carts in the aisle."""
