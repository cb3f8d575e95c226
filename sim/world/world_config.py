"""What a world is grown from: seed, size, hills, trees, walls."""

from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

MAX_CELLS = 1024  # per side: 4 MB of heights


class WorldConfig(BaseModel):
    """What a world is made from. The defaults keep every tree within 120 m of home below 15 m above the home plane."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    seed: int = Field(default=1, ge=0, le=2**32 - 1)
    """Seed of terrain and trees: same seed and settings, same bytes."""
    size_m: float = Field(default=1000.0, ge=50.0, le=10_000.0)
    """Side of the square map centred on home [m]."""
    cell_m: float = Field(default=4.0, ge=0.5, le=50.0)
    """Distance between grid points of the terrain [m], rounded so that the map holds whole cells."""
    hill_height_m: float = Field(default=12.0, ge=0.0, le=300.0)
    """Bound of the hills above and valleys below home [m]; 0 makes a plain."""
    hill_wavelength_m: float = Field(default=250.0, ge=20.0, le=5_000.0)
    """Wavelength of the broadest hills [m]."""
    octaves: int = Field(default=6, ge=1, le=8)
    """Layers of hills, each half the wavelength of the one before."""
    clearing_radius_m: float = Field(default=20.0, ge=0.0, le=1_000.0)
    """Radius round home that is exactly level and free of trees [m]."""
    clearing_blend_m: float = Field(default=230.0, ge=1.0, le=5_000.0)
    """Width of the ring round the clearing in which the hills grow to full height [m]."""
    trees_per_ha: float = Field(default=60.0, ge=0.0, le=1_000.0)
    """Trees per hectare outside the clearing; 0 plants none."""
    treeless_radius_m: float = Field(default=0.0, ge=0.0, le=1_000.0)
    """Radius round home that is free of trees, if it is more than the clearing's, hills or not [m]; not in worlds grown
    in batches."""
    tree_height_min_m: float = Field(default=5.0, ge=1.0, le=60.0)
    """Height of the lowest trees [m]."""
    tree_height_max_m: float = Field(default=10.0, ge=1.0, le=60.0)
    """Height of the highest trees [m]."""
    has_walls: bool = False
    """Whether walls stand along the edges of the map."""
    wall_height_m: float = Field(default=10.0, ge=1.0, le=200.0)
    """Height of the walls above the highest ground at the edges of the map [m]."""
    wall_count: int = Field(default=0, ge=0, le=100)
    """Free-standing walls, a fifth of them kerbs, scattered over the map; in worlds grown in batches alone."""
    mover_count: int = Field(default=0, ge=0, le=20)
    """Obstacles that run to and fro, in a car park along its aisle; in worlds grown in batches alone."""
    spot_count: int = Field(default=0, ge=0, le=20)
    """Spots in each of the two rows of a car park beside home, 0: none; in worlds grown in batches alone."""

    @property
    def has_boxes(self) -> bool:
        """Whether walls, movers or a car park stand in it: it is grown in a batch then."""
        return self.wall_count + self.mover_count + self.spot_count > 0

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells = self.size_m / self.cell_m
        if cells > MAX_CELLS:
            raise ValueError(f"size_m / cell_m makes {cells:.0f} cells per side, at most {MAX_CELLS} are allowed")
        if self.tree_height_min_m > self.tree_height_max_m:
            raise ValueError("tree_height_min_m is larger than tree_height_max_m")
        return self
