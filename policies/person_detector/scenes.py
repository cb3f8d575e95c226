"""Images to train and judge the person detector by: people, or nobody, before the cameras of low-flying vehicles.

In: a seed. Out: images as a companion gets them, and for each cell of the detector's map whether a person's chest is
in it, how far away, and whether it counts. Worlds are those of following: seeds that four divides train, odd seeds
judge. The networks that ship, detector and depth, had any even seed, those of validation among them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import inverse, product, quat_of_roll_pitch_yaw, rotated
from common.warp_start import start_warp
from policies.person_detector.detector import CELLS, RANGE_M, STRIDE
from policies.tasks.follow_me.cast import PEOPLE_MAX
from policies.tasks.follow_me.observe import HFOV_DEG, IMAGE_SIZE, camera_mount, pack_images
from policies.tasks.follow_me.owner_visibility import GAIN_MAX
from policies.tasks.follow_me.world import FOLLOW_WORLD
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.ray import PERSON
from sim.world.batch import WorldBatch
from sim.world.clothes import Clothes, any_clothes, usual_clothes
from sim.world.people import CHEST_M, STATURE_M, Person
from sim.world.world import World, ground_height

wp.set_module_options({"enable_backward": False})

WORLDS = 64
_ROUNDS = 16  # of images in the same worlds
_NOBODY = 0.3  # share of images
_EMPTY, _SOMEBODY, _UNSURE = 0, 1, 2
HEIGHTS_M = (0.6, 4.0)  # of lenses above the ground
_SPREAD_M = 90.0  # from the middle of the world, where images are taken
_AT_HOME, _HOME_M = 0.2, 6.0  # share of images taken near the pad, on which somebody may be thought to stand
_POINTS_LEAST = 2  # of chest, head and knees that must be seen
_BODY_M = 0.35  # beside somebody's middle, where they hide others


@dataclass(frozen=True, slots=True)
class Scenes:
    """So many images."""

    images: NDArray[np.uint8]  # (images, height, width, 4)
    cells: NDArray[np.int8]  # (images, CELLS, CELLS): 0 nobody, 1 somebody, 2 does not count
    ranges_m: NDArray[np.float32]  # likewise, of whom is there

    @property
    def has_person(self) -> NDArray[np.bool_]:
        """Of each image, whether somebody is clearly in it."""
        return np.asarray((self.cells == _SOMEBODY).any(axis=(1, 2)))

    @property
    def is_empty(self) -> NDArray[np.bool_]:
        """Of each image, whether nothing of anybody is in it."""
        return np.asarray((self.cells == _EMPTY).all(axis=(1, 2)))


@wp.kernel(enable_backward=False)
def _dress(seed: int, is_usual: wp.array2d(dtype=int), usual: Clothes, clothes: wp.array2d(dtype=Clothes)) -> None:
    i, k = wp.tid()
    clothes[i, k] = any_clothes(seed, i, k)
    if is_usual[i, k] == 1:
        clothes[i, k] = usual


@wp.kernel(enable_backward=False)
def _heights(worlds: wp.array[World], points: wp.array2d(dtype=wp.vec2), out: wp.array2d(dtype=float)) -> None:
    i, k = wp.tid()
    out[i, k] = ground_height(worlds[i], points[i, k][0], points[i, k][1])


class Stage:
    """So many vehicles at once, each in a world of its own, with people before them.

    Args:
        seed: of everything.
        is_test: in worlds that no other split has.
        count: of vehicles and worlds.
        heights_m: of the lenses above the ground, from and to.
        device: a Warp device.
    """

    def __init__(
        self,
        seed: int,
        *,
        is_test: bool = False,
        count: int = WORLDS,
        heights_m: tuple[float, float] = HEIGHTS_M,
        device: str = "cpu",
    ) -> None:
        self.rng = np.random.default_rng([seed, int(is_test)])
        self.count = count
        self._is_test, self._turns, self._heights_m = is_test, 0, heights_m
        start_warp()  # makes the CPU the default, once
        with wp.ScopedDevice(device):
            self._worlds = WorldBatch(FOLLOW_WORLD, count, device, trees_per_ha_max=300.0)
            self._people = wp.zeros((count, PEOPLE_MAX), dtype=Person)
            self._clothes = wp.zeros((count, PEOPLE_MAX), dtype=Clothes)
            size: dict[str, Any] = {"width": IMAGE_SIZE, "height": IMAGE_SIZE, "hfov_deg": HFOV_DEG}
            who = {"people": self._people, "clothes": self._clothes}
            self.camera = QuickCamera(self._worlds, count, **size, **who, has_optics=True, device=device)
            self._everyone = wp.full(count, value=True, dtype=wp.bool)
            self._packed = wp.zeros((count, IMAGE_SIZE, IMAGE_SIZE, 4), dtype=wp.uint8)
        self._device = device
        self.height_m = np.zeros(count)
        """Of the lenses above the ground below them."""

    @property
    def people(self) -> Any:
        """Who is there, (count, PEOPLE_MAX) of `Person`."""
        return self._people.numpy()

    def place(self) -> None:
        """Everybody is somewhere else; from time to time in other worlds."""
        with wp.ScopedDevice(self._device):
            if self._turns % _ROUNDS == 0:
                _grow(self._worlds, self.rng, is_test=self._is_test)
                self.camera.refresh()
            self._turns += 1
            self.height_m = _place(self._worlds, self.camera, self._people, self._clothes, self._heights_m, self.rng)

    def images(self) -> NDArray[np.uint8]:
        """What the cameras see, as a companion gets it: (count, height, width, 4)."""
        with wp.ScopedDevice(self._device):
            self.camera.render()
            inputs = [self.camera.rgb, self.camera.depth_m, self._everyone, self._packed]
            wp.launch(pack_images, (self.count, IMAGE_SIZE), inputs)
            return np.asarray(self._packed.numpy().copy())


def scenes(count: int, seed: int, *, is_test: bool = False, heights_m: tuple[float, float] = HEIGHTS_M) -> Scenes:
    """At least so many images; of worlds that no other split has."""
    stage, parts = Stage(seed, is_test=is_test, heights_m=heights_m), []
    for _ in range(-(-count // WORLDS)):
        stage.place()
        parts.append((stage.images(), *_labels(stage.camera, stage.people)))
    images, cells, ranges_m = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Scenes(images, cells, ranges_m)


def _grow(worlds: WorldBatch, rng: np.random.Generator, *, is_test: bool) -> None:
    params: Any = worlds.params.numpy()
    n = len(params)
    params["hill_height_m"] = rng.uniform(2.0, 12.0, n)
    params["trees_per_ha"] = rng.uniform(30.0, 250.0, n)
    worlds.params.assign(params)
    seeds = _seeds(rng.integers(2**29, size=n), is_test=is_test)
    worlds.grow(wp.full(n, value=True, dtype=wp.bool), wp.array(seeds, dtype=int))


def _seeds(drawn: NDArray[np.int64], *, is_test: bool) -> NDArray[np.int64]:
    """The worlds' seeds, as `draw_seed` has them of a split."""
    return 2 * drawn + 1 if is_test else 4 * (drawn // 2)


def _place(
    worlds: WorldBatch,
    camera: QuickCamera,
    people: Any,
    clothes: Any,
    heights_m: tuple[float, float],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Puts vehicles into their worlds, people before them, and the light and the lens on: their heights [m]."""
    n, k = people.shape
    spread_m = np.where(rng.random(n) < _AT_HOME, _HOME_M, _SPREAD_M)[:, None]
    where = spread_m * rng.uniform(-1.0, 1.0, (n, 2))
    yaw = rng.uniform(-np.pi, np.pi, n)
    far_m = 0.7 + 13.0 * rng.random((n, k)) ** 2
    aside = yaw[:, None] + rng.uniform(-0.8, 0.8, (n, k))
    feet = where[:, None] + far_m[..., None] * np.stack([np.cos(aside), np.sin(aside)], -1)
    points = np.concatenate([where[:, None], feet], axis=1).astype(np.float32)
    heights = wp.zeros((n, k + 1), dtype=float)
    wp.launch(_heights, (n, k + 1), [worlds.kernels, wp.array(points, dtype=wp.vec2), heights])
    ground = heights.numpy()
    row: Any = people.numpy()
    row["pos_ned"] = np.concatenate([feet, -ground[:, 1:, None]], -1)
    row["stature_m"] = rng.uniform(1.0, 1.95, (n, k)) * np.where(rng.random((n, k)) < 0.1, 0.6, 1.0)
    row["stature_m"][np.arange(k)[None] >= rng.integers(1, k + 1, n)[:, None]] = 0.0
    row["stature_m"][rng.random(n) < _NOBODY] = 0.0
    row["heading_rad"] = rng.uniform(-np.pi, np.pi, (n, k))
    row["gait_phase"] = rng.uniform(0.0, 2.0 * np.pi, (n, k))
    row["vel_ned"] = 0.0
    row["vel_ned"][..., 0] = rng.uniform(0.0, 5.0, (n, k)) * (rng.random((n, k)) < 0.8)
    people.assign(row)
    is_usual = wp.array((rng.random((n, k)) < 0.15).astype(np.int32), dtype=int)
    wp.launch(_dress, (n, k), [int(rng.integers(2**31)), is_usual, usual_clothes(), clothes])
    height_m = rng.uniform(*heights_m, n)
    _aim(camera, rng, where, -ground[:, 0] - height_m, yaw)
    return np.asarray(height_m)


def _aim(
    camera: QuickCamera, rng: np.random.Generator, where: Any, down: NDArray[np.float64], yaw: NDArray[np.float64]
) -> None:
    lens: Any = camera.lenses.numpy()
    n = len(lens)
    lens["pos_ned"] = np.concatenate([where, down[:, None]], -1)
    lean = [rng.normal(0.0, 0.15, n), rng.normal(-0.05, 0.2, n)]  # roll and pitch [rad]
    mount = camera_mount()
    poses = [quat_of_roll_pitch_yaw(*angles) for angles in zip(*lean, yaw, strict=True)]
    lens["q_ned_from_rdf"] = [product(pose, mount) for pose in poses]
    lens["half_width"] = rng.uniform(0.97, 1.03, n) * np.tan(np.radians(0.5 * HFOV_DEG))
    light = np.where(rng.random(n) < 0.3, rng.uniform(0.06, 0.3, n), 1.0)
    gain = np.minimum(1.0 / light, float(GAIN_MAX))
    lens["exposure"] = rng.uniform(0.5, 1.8, n) * light * gain
    optics: Any = camera.optics.numpy()
    noise = rng.uniform(0.3, 1.5, n)
    optics["read_std"], optics["shot_std"] = 2.5 * noise * gain, 4.5 * noise * np.sqrt(gain)
    optics["depth_std_fraction"] = 0.02 * noise
    optics["has_depth_limit"] = 1
    optics["depth_max_m"] = rng.choice([0.0, 4.0, 8.0, 1000.0], n, p=[0.2, 0.1, 0.2, 0.5])
    optics["depth_holes"] = rng.uniform(0.0, 0.4, n) * (rng.random(n) < 0.5)
    optics["shutter_s"] = rng.uniform(0.0, 0.033, n)
    optics["vel_rdf"] = rng.normal(0.0, 2.0, (n, 3))
    optics["rate_rdf"] = rng.normal(0.0, 0.6, (n, 3))
    optics["seed"], optics["tick"] = rng.integers(2**30, size=n), rng.integers(2**30, size=n)
    camera.lenses.assign(lens)
    camera.optics.assign(optics)


def _labels(camera: QuickCamera, people: Any) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Of each image: whose chest is in which cell; where else somebody is seen, nothing counts."""
    kind = camera.kind.numpy()
    lens: Any = camera.lenses.numpy()
    n = len(kind)
    cells = np.zeros((n, CELLS, CELLS), np.int8)
    by_cell = (kind == PERSON).reshape(n, CELLS, STRIDE, CELLS, STRIDE).any(axis=(2, 4))
    cells[by_cell] = _UNSURE
    ranges_m = np.zeros((n, CELLS, CELLS), np.float32)
    for i in range(n):
        nearer: list[Any] = []
        eye = lens[i]["pos_ned"]
        there = [person for person in people[i] if person["stature_m"] > 0.0]
        far_m = [float(np.linalg.norm(person["pos_ned"] - eye)) for person in there]
        for k in np.argsort(far_m):
            person = there[k]
            _label(cells[i], ranges_m[i], kind[i], lens[i], person, nearer)
    return cells, ranges_m


def _label(
    cells: NDArray[np.int8], ranges_m: NDArray[np.float32], kind: Any, lens: Any, person: Any, nearer: list[Any]
) -> None:
    """Of one person; whoever stands behind a nearer one counts for nothing."""
    stature_m = float(person["stature_m"])
    chest_m = float(CHEST_M) / float(STATURE_M) * stature_m
    points = []
    for up in (chest_m, 0.93 * stature_m, 0.3 * stature_m):
        offset = person["pos_ned"] - np.array([0.0, 0.0, up]) - lens["pos_ned"]
        ray = rotated(inverse(lens["q_ned_from_rdf"].tolist()), offset.tolist())
        points.append(_seen(ray, kind, float(lens["half_width"])))
        if up == chest_m:
            is_behind = any(abs(ray[0] / max(ray[2], 0.1) - x) < _BODY_M / z for x, z in nearer)
            nearer.append((ray[0] / max(ray[2], 0.1), max(ray[2], 0.1)))
    chest = points[0]
    if is_behind or chest is None or not chest[2] or sum(p is not None and p[2] for p in points) < _POINTS_LEAST:
        return
    row, column, _, range_m = chest
    if RANGE_M[0] < range_m < 12.0:
        cell = row // STRIDE, column // STRIDE
        cells[cell] = _SOMEBODY
        ranges_m[cell] = range_m


def _seen(ray: Any, kind: Any, half_width: float) -> tuple[int, int, bool, float] | None:
    """Row, column, whether a person is seen there, and range [m]; None: it is not in the image."""
    if ray[2] < 0.3:
        return None
    size = kind.shape[0]
    column, row = (int(np.floor(0.5 * size * (1.0 + ray[axis] / (ray[2] * half_width)))) for axis in (0, 1))
    if not (0 <= row < size and 0 <= column < size):
        return None
    near = np.s_[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    is_there = bool((kind[near] == PERSON).any())
    return row, column, is_there, float(np.linalg.norm(ray))
