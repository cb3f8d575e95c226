"""The forests that are navigated through: the same in training of Navigate and in flights."""

from sim.world.world import WorldConfig

TREES_PER_HA_MAX = 600.0
FOREST = WorldConfig(
    size_m=192.0,
    cell_m=4.0,
    hill_height_m=4.0,
    hill_wavelength_m=120.0,
    clearing_radius_m=5.0,
    clearing_blend_m=60.0,
    trees_per_ha=TREES_PER_HA_MAX,
    tree_height_min_m=10.0,
    tree_height_max_m=14.0,
)
"""Worlds of even seeds are trained in, those of odd seeds are held out."""

WALLED_FOREST = FOREST.model_copy(
    update={
        "size_m": 112.0,
        "hill_height_m": 3.0,
        "clearing_radius_m": 3.0,
        "clearing_blend_m": 30.0,
        "trees_per_ha": 400.0,
        "wall_count": 30,
    }
)
"""That a rover drives through: free-standing walls and kerbs between the trees."""
