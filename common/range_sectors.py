"""Which way a scanning range finder looks: what its sensor measures, and what a policy that sees by it is shown.

Sectors as MAVLink's OBSTACLE_DISTANCE carries them, level, clockwise from left of the nose; and beams along the nose.
"""

SECTORS = 48
SECTOR_DEG = 5.0
FIRST_EDGE_DEG = -0.5 * SECTORS * SECTOR_DEG  # left edge of the first sector, from the nose
BEAM_ELEVATIONS_DEG = (-30.0, -12.0, 12.0, 30.0)
RANGES = SECTORS + len(BEAM_ELEVATIONS_DEG)
RANGE_M = 14.0  # guess: a small scanner or depth camera under leaves
