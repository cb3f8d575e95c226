"""Which way a scanning range finder looks: what its sensor measures, and what a policy that sees by it is shown.

Sectors as MAVLink's OBSTACLE_DISTANCE carries them, level, clockwise from left of the nose; and beams along the nose.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RangeLayout:
    """Which ranges there are, in their order: those of sectors, then those of tilted beams."""

    sectors: int
    sector_deg: float
    first_edge_deg: float  # left edge of the first sector, from the nose, clockwise
    range_m: float  # no return
    beam_elevations_deg: tuple[float, ...] = ()


SECTORS = 48
SECTOR_DEG = 5.0
FIRST_EDGE_DEG = -0.5 * SECTORS * SECTOR_DEG  # left edge of the first sector, from the nose
BEAM_ELEVATIONS_DEG = (-30.0, -12.0, 12.0, 30.0)
RANGES = SECTORS + len(BEAM_ELEVATIONS_DEG)
RANGE_M = 14.0  # guess: a small scanner or depth camera under leaves
SCANNER = RangeLayout(SECTORS, SECTOR_DEG, FIRST_EDGE_DEG, RANGE_M, BEAM_ELEVATIONS_DEG)
"""Of a drone among trees (sim/sensors/scanner.py)."""
GROUND_RING = RangeLayout(72, 5.0, -2.5, 10.0)
"""Of a rover, all round, the first sector's middle at its nose (sim/sensors/ground_ring.py)."""
