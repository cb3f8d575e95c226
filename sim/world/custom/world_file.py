"""`WorldFile`: a world of one's own, as a file or a Python program describes it; `build_world` builds it.

Positions are ned [m] from home. One of two numbers stands on the ground at that place.
"""

import re
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, ValidationInfo, model_validator

from sim.world.world_config import WorldConfig

FARTHEST_M = 20_000.0
_Metres = Annotated[FiniteFloat, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Length = Annotated[FiniteFloat, Field(ge=0.001, le=FARTHEST_M)]
Heading = Annotated[FiniteFloat, Field(ge=-360.0, le=360.0)]


def _position(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if len(numbers) not in (2, 3):
        raise ValueError(
            f"must be north, east and down [m], or north and east on the ground, not {len(numbers)} numbers"
        )
    return numbers


def _size(numbers: tuple[float, ...]) -> tuple[float, float, float]:
    if len(numbers) != 3:
        raise ValueError(f"must be length, width and height [m], not {len(numbers)} numbers")
    return numbers


def _colour(text: str) -> str:
    if not re.fullmatch("#[0-9a-fA-F]{6}", text):
        raise ValueError(f"must be a colour as '#rrggbb', such as '#a8a49e', not {text}")
    return text


def _line(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if len(points) < 2 or any(start == end for start, end in pairwise(points)):
        raise ValueError("must be two points or more, north and east [m], none twice in a row")
    return points


def _beside(file: Path, info: ValidationInfo) -> Path:
    """A file's path is relative to the folder of the file that names it."""
    folder = (info.context or {}).get("folder")
    return file if folder is None else Path(folder) / file


Position = Annotated[tuple[_Metres, ...], AfterValidator(_position)]
Size = Annotated[tuple[Length, ...], AfterValidator(_size)]
Colour = Annotated[str, AfterValidator(_colour)]
Line = Annotated[tuple[tuple[_Metres, _Metres], ...], AfterValidator(_line)]
File = Annotated[Path, AfterValidator(_beside)]


class WorldError(ValueError):
    """A world that cannot be built; the message is one sentence, `loc` the key of the file that it is about."""

    def __init__(self, loc: tuple[int | str, ...], sentence: str) -> None:
        super().__init__(f"{key_of(loc)}: {sentence}")
        self.loc, self.sentence = loc, sentence


def key_of(loc: tuple[int | str, ...]) -> str:
    """The path of a key as people write it: meshes[0].file."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in loc)
    return text.removeprefix(".")


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class Heightmap(_Part):
    """Heights of the ground as an image, north up, home at its middle; the ground at home is at height 0."""

    file: File
    """A PNG of one channel with 8 or 16 bits, or a GeoTIFF of heights in metres."""
    metres_per_pixel: Annotated[float, Field(ge=0.01, le=1_000.0)] | None = None
    """Distance between neighbouring pixels [m]; a GeoTIFF has its own."""
    height_min_m: _Metres | None = None
    """Height that 0 stands for [m]; a GeoTIFF holds metres."""
    height_max_m: _Metres | None = None
    """Height that the largest value, 255 or 65535, stands for [m]."""


class BoxSolid(_Part):
    """A box with a level floor."""

    position_ned_m: Position
    """Middle of its bottom [m]: north, east and down, or north and east to stand on the ground."""
    size_m: Size
    """Length along its heading, width, height [m]."""
    heading_deg: Heading = 0.0
    """Of its length, clockwise from north."""
    colour: Colour = "#a8a49e"
    """#rrggbb."""
    texture: File | None = None
    """An image for each of its sides."""


class WallSolid(_Part):
    """A wall along a line on the map, as high above the ground everywhere as it has to be."""

    points_ne_m: Line
    """Its corners, north and east [m]."""
    height_m: Length
    """Of its level top above the highest ground along each stretch [m]."""
    thickness_m: Length = 0.2
    """[m]"""
    colour: Colour = "#a8a49e"
    """#rrggbb."""
    texture: File | None = None
    """An image for each of its sides."""


class CylinderSolid(_Part):
    """An upright cylinder: a mast, a tank, a chimney. Its sides are within half a millimetre of the round ones."""

    position_ned_m: Position
    """Middle of its bottom [m]: north, east and down, or north and east to stand on the ground."""
    radius_m: Annotated[Length, Field(le=1_000.0)]
    """[m]"""
    height_m: Length
    """[m]"""
    colour: Colour = "#a8a49e"
    """#rrggbb."""


class MeshSolid(_Part):
    """Triangles from a file: STL, OBJ, PLY or glTF (.gltf, .glb)."""

    file: File
    """The file."""
    position_ned_m: Position = (0.0, 0.0)
    """Where the file's origin is [m]: north, east and down, or north and east to be on the ground."""
    heading_deg: Heading = 0.0
    """Where its front points, clockwise from north: the file's x axis, or z where y is up."""
    scale: Annotated[float, Field(ge=1.0e-6, le=1.0e6)] = 1.0
    """Metres per unit of the file: 0.001 for millimetres."""
    up: Literal["z", "y"] | None = None
    """The file's axis that points up; y in glTF, else z, unless it is given."""
    thin: bool = False
    """Surfaces without an inside are meant: a mesh with holes is refused otherwise."""
    colour: Colour | None = None
    """#rrggbb, instead of the file's own."""
    texture: File | None = None
    """An image, laid on by the file's texture coordinates, instead of its own."""


class PadSolid(_Part):
    """A round landing pad with a mark that cameras see."""

    position_ned_m: Position
    """Middle of its bottom [m]: north, east and down, or north and east to stand on the ground."""
    radius_m: Annotated[Length, Field(le=100.0)] = 1.5
    """[m]"""
    height_m: Length = 0.05
    """Of its top above its bottom [m]."""
    heading_deg: Heading = 0.0
    """Of the mark's top, clockwise from north."""
    texture: File | None = None
    """An image for its top instead of a ring and an H, such as a fiducial marker."""


class WorldFile(WorldConfig):
    """A world of one's own: a plain unless it says otherwise, and what stands on it."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    size_m: float = Field(default=400.0, ge=50.0, le=10_000.0)
    """Side of the square map centred on home [m]; a heightmap has its own."""
    hill_height_m: float = Field(default=0.0, ge=0.0, le=300.0)
    """Bound of the hills above and valleys below home [m]; 0 makes a plain."""
    trees_per_ha: float = Field(default=0.0, ge=0.0, le=1_000.0)
    """Trees per hectare outside the clearing; 0 plants none."""
    heightmap: Heightmap | None = None
    """Heights of the ground from a file."""
    boxes: tuple[BoxSolid, ...] = ()
    """Boxes."""
    walls: tuple[WallSolid, ...] = ()
    """Walls along lines."""
    cylinders: tuple[CylinderSolid, ...] = ()
    """Upright cylinders."""
    meshes: tuple[MeshSolid, ...] = ()
    """Triangles from files."""
    pads: tuple[PadSolid, ...] = ()
    """Landing pads."""

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> Self:
        if self.has_boxes:
            raise ValueError("wall_count, mover_count and spot_count belong to worlds that are grown in batches")
        if self.heightmap is not None and self.hill_height_m > 0.0:
            raise ValueError("has a heightmap and hill_height_m: only one of them can make the ground")
        return self
