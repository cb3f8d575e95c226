"""The fast camera: colours, depth and classes of many small images, thousands a second on one core, or on a GPU.

In: lenses, which kernels write, one per camera; the worlds; the person each camera looks for. Out: 8-bit sRGB, depth
along the optical axis and classes, in arrays that stay where they are. For training and onboard cameras at 10 Hz; the
exact and slower renderer is `sim.sensors.camera`. Camera frame rdf.
"""

from math import ceil, pi, radians, tan
from typing import Any, Protocol

import numpy as np
import warp as wp

from sim.launches import Workers
from sim.sensors.camera import Lens
from sim.sensors.fast_camera.camera_view import View
from sim.sensors.fast_camera.colours import make_paints
from sim.sensors.fast_camera.columns import Columns, lay_columns
from sim.sensors.fast_camera.ground import make_ground, pack_cells
from sim.sensors.fast_camera.light import STRIPS, light_corners, light_strips, pack_light
from sim.sensors.fast_camera.optics import Optics, expose
from sim.sensors.fast_camera.prepare import prepare_views
from sim.sensors.fast_camera.rows import Outputs, draw_rows
from sim.sensors.fast_camera.solid_rows import draw_solids
from sim.sensors.fast_camera.solids import Sights, Solid
from sim.sensors.solid_paint import make_paint
from sim.world.clothes import Clothes, usual_clothes
from sim.world.custom.solids import SolidsMap
from sim.world.people import Person
from sim.world.trees import CROWN_RADIUS_FRACTION
from sim.world.world import World, WorldConfig, WorldMap

RANGE_M = 80.0
SAMPLES = 40  # distances per column at the default range
_LIMBS = 24  # solids of a person
_CROWDED = 2.0  # trees stand closer in places than on average


_Pass = tuple[Any, tuple[int, ...], list[Any]]  # kernel, threads per camera, and its inputs but the first camera


class Worlds(Protocol):
    """Many worlds of one configuration, as `sim.world.batch.WorldBatch`."""

    @property
    def config(self) -> WorldConfig:
        """Of all of them."""

    @property
    def solids(self) -> SolidsMap:
        """Of a world file, the same in all of them."""

    @property
    def kernels(self) -> Any:
        """Array of `World`, shape (worlds,)."""


class QuickCamera:
    """So many cameras in one world or in many.

    Args:
        worlds: what is seen, its arrays on `device`.
        count: number of cameras.
        width: of each image [pixels].
        height: of each image [pixels].
        hfov_deg: horizontal field of view the lenses begin with.
        people: array of `Person`, shape (count,) or (count, people): row i is seen by camera i alone, stature 0 is
            nobody; None for none.
        clothes: array of `Clothes` of the same shape; None: the usual ones for all.
        i_world: the world of each camera; None: the only one, or camera i looks at world i.
        range_m: fog hides what is farther; farther ground and trees are not drawn.
        has_optics: whether `optics` spoil the images; they are perfect otherwise.
        threads: the cameras are split into as many launches; the images do not depend on it.
        device: a Warp device.

    Attributes:
        lenses: array of `sim.sensors.camera.Lens`, shape (count,), for kernels to write.
        optics: array of `sim.sensors.fast_camera.optics.Optics`, likewise; shape (0,) without optics.
        rgb: uint8, (count, height, width, 3).
        depth_m: float32, (count, height, width), along the optical axis; `sim.sensors.camera.SKY_DEPTH_M` for the sky.
        kind: uint8, (count, height, width): SKY, GROUND, TRUNK, CROWN, WALL, PERSON, VEHICLE, SOLID of
            `sim.sensors.ray`. From inside a tree or person all pixels are that, at depth 0.
        i_world: array of int, shape (count,).
    """

    def __init__(
        self,
        worlds: Worlds | WorldMap,
        count: int,
        *,
        width: int = 64,
        height: int = 64,
        hfov_deg: float = 90.0,
        people: Any = None,
        clothes: Any = None,
        i_world: Any = None,
        range_m: float = RANGE_M,
        has_optics: bool = False,
        threads: int = 1,
        device: str = "cpu",
    ) -> None:
        config, self._seen = worlds.config, worlds  # kernels' structs do not keep their arrays alive
        if isinstance(worlds, WorldMap):
            self._worlds = wp.array([worlds.kernel], dtype=World, device=device)
        else:
            self._worlds = worlds.kernels
        world_count = len(self._worlds)
        self.i_world = wp.array(_worlds_of(i_world, count, world_count), dtype=wp.int32, device=device)
        self.lenses = wp.array(_first_lens(hfov_deg, count), dtype=Lens, device=device)
        self.rgb = wp.zeros((count, height, width, 3), dtype=wp.uint8, device=device)
        self.depth_m = wp.zeros((count, height, width), dtype=wp.float32, device=device)
        self.kind = wp.zeros((count, height, width), dtype=wp.uint8, device=device)
        self._ground = ground = make_ground(config, world_count, device)
        self._everyone = wp.full(count, value=True, dtype=wp.bool, device=device)
        self.optics = wp.zeros(count if has_optics else 0, dtype=Optics, device=device)
        perfect = (wp.zeros_like(self.rgb), wp.zeros_like(self.depth_m)) if has_optics else (self.rgb, self.depth_m)
        outputs = _outputs(*perfect, self.kind)
        views = wp.zeros(count, dtype=View, device=device)
        columns = _columns(count, width, range_m, device)
        self._who = _people(people, clothes, count, device)
        sights = _sights(count, config, range_m, self._who[0].shape[1], device)
        size, paints = wp.vec2i(width, height), make_paints(device)
        chosen = self._everyone
        seen = [self._worlds, self.i_world, self.lenses, *self._who, chosen, ground, range_m, size, views]
        drawn = [ground, paints, views, chosen, columns, sights, range_m, outputs]
        images = [array.flatten() for array in (*perfect, self.rgb, self.depth_m)]
        passes: list[_Pass] = [
            (prepare_views, (), [*seen, columns, sights]),
            (lay_columns, (columns.room,), [ground, views, chosen, columns]),
            (draw_rows, (height,), drawn),
        ]
        if worlds.solids.parts:
            self._paint = make_paint(worlds.solids, device)
            shaded = [self._worlds, self.i_world, self._paint, paints, views, chosen, range_m, outputs]
            passes.append((draw_solids, (height,), shaded))
        if has_optics:
            passes.append((expose, (height,), [self.lenses, chosen, self.optics, size, *images]))
        self._workers = Workers(count, threads)
        self._commands = [
            [_recorded(a_pass, chosen, first, rows, device) for a_pass in passes]
            for first, rows in self._workers.chunks
        ]
        self._every_world = wp.full(world_count, value=True, dtype=wp.bool, device=device)
        self._pack = _pack_commands(self._worlds, self._every_world, ground, device)
        self.refresh()

    def refresh(self, is_chosen: Any = None) -> None:
        """Packs worlds that are new: array of bool, shape (worlds,); None for all."""
        chosen = self._every_world if is_chosen is None else is_chosen
        for command in self._pack:
            command.set_param_at_index(1, chosen)
            command.launch()

    def render(self, is_chosen: Any = None) -> None:
        """Takes the images of the chosen cameras: array of bool, shape (count,); None for all."""
        chosen = self._everyone if is_chosen is None else is_chosen

        def render_chunk(k: int) -> None:
            for command, i_chosen in self._commands[k]:
                command.set_param_at_index(i_chosen, chosen)
                command.launch()

        self._workers.run(render_chunk)


def _recorded(a_pass: _Pass, chosen: Any, first: int, count: int, device: str) -> tuple[Any, int]:
    """A launch for some cameras, and the index of its parameter that says which of them are chosen."""
    kernel, dim, inputs = a_pass
    i_chosen = 1 + next(k for k, value in enumerate(inputs) if value is chosen)
    return wp.launch(kernel, (count, *dim), [first, *inputs], device=device, record_cmd=True), i_chosen


def _outputs(rgb: Any, depth_m: Any, kind: Any) -> Any:
    """The images as the rows write them."""
    outputs = Outputs()
    outputs.rgb, outputs.depth_m, outputs.kind = rgb.flatten(), depth_m.flatten(), kind.flatten()
    outputs.front = wp.zeros(kind.size, dtype=wp.int32, device=kind.device)
    outputs.height, outputs.width = kind.shape[1:]
    return outputs


def _worlds_of(i_world: Any, count: int, world_count: int) -> Any:
    """Which world each camera looks at."""
    if i_world is not None:
        return i_world
    if world_count not in (1, count):
        raise ValueError(f"{count} cameras and {world_count} worlds: say which camera looks at which world")
    return np.arange(count) % world_count


def _pack_commands(worlds: Any, chosen: Any, ground: Any, device: str) -> list[Any]:
    """Launches that pack the chosen worlds, which are the second input of each."""
    world_count = len(worlds)
    strips = 1 if worlds.device.is_cpu else STRIPS  # each thread goes through all trees
    launches: list[tuple[Any, int, list[Any]]] = [
        (pack_cells, ground.side, [worlds, chosen, ground]),
        (light_corners, ground.side + 1, [worlds, chosen, ground]),
        (light_strips, strips, [worlds, chosen, ground, strips]),
        (pack_light, ground.texels, [ground, chosen]),
    ]
    return [
        wp.launch(kernel, (world_count, threads), inputs, device=device, record_cmd=True)
        for kernel, threads, inputs in launches
    ]


def _first_lens(hfov_deg: float, count: int) -> Any:
    """Rows of `Lens` at the origin that look north."""
    kernel_type: Any = Lens
    rows = np.zeros(count, kernel_type.numpy_dtype())
    rows["q_ned_from_rdf"] = (0.5, 0.5, 0.5, 0.5)
    rows["half_width"] = tan(0.5 * radians(hfov_deg))
    rows["exposure"] = 1.0
    rows["balance"] = 1.0
    return rows


def _columns(count: int, width: int, range_m: float, device: str) -> Any:
    columns = Columns()
    columns.room = max(16, 2 * width)
    columns.samples = round(SAMPLES * max(1.0, (range_m / RANGE_M) ** 0.4))
    columns.slopes = wp.zeros(count * columns.room * columns.samples, dtype=wp.float32, device=device)
    columns.distances = wp.zeros(count * columns.samples, dtype=wp.float32, device=device)
    return columns


def _people(people: Any, clothes: Any, count: int, device: str) -> tuple[Any, Any]:
    """Who is seen, and what they wear, (count, people) each."""
    people = _in_rows(people, count, Person, device)
    if clothes is None and people.shape[1]:
        usual = [usual_clothes()] * (count * people.shape[1])
        clothes = wp.array(usual, dtype=Clothes, device=device)
    return people, _in_rows(clothes, count, Clothes, device)


def _in_rows(rows: Any, count: int, kind: Any, device: str) -> Any:
    """An array of structs, (count, people): of one for each camera, of several or of none."""
    if rows is None:
        return wp.zeros((count, 0), dtype=kind, device=device)
    return rows.reshape((count, -1))


def _sights(count: int, config: WorldConfig, range_m: float, people: int, device: str) -> Any:
    sights = Sights()
    room = sights.room = _solids_room(config, range_m) + _LIMBS * people
    sights.crown_max_m = CROWN_RADIUS_FRACTION[1] * config.tree_height_max_m
    sights.solids = wp.zeros(count * room, dtype=Solid, device=device)
    sights.boxes = wp.zeros(count * room, dtype=wp.vec4i, device=device)
    return sights


def _solids_room(config: WorldConfig, range_m: float) -> int:
    """How many solids a camera can list: two per tree in a third of the circle of its range, and the vehicles."""
    area_ha = min(pi * range_m**2 / 3.0, config.size_m**2) * 1.0e-4
    return 32 + ceil(2.0 * _CROWDED * config.trees_per_ha * area_ha)
