"""Where an owner is followed, and how often they stop: the same in training and in flights.

Light to import: flights need it before they need a policy.
"""

from sim.world.world import WorldConfig

FOLLOW_WORLD = WorldConfig(
    size_m=256.0,
    cell_m=4.0,
    hill_height_m=8.0,
    hill_wavelength_m=120.0,
    clearing_radius_m=5.0,
    clearing_blend_m=60.0,
    trees_per_ha=100.0,
    tree_height_min_m=8.0,
    tree_height_max_m=15.0,
    has_walls=True,
)
"""Hills and trees a person can walk in."""
STOP_FRACTION = 0.15  # of the owner's plans; guess
