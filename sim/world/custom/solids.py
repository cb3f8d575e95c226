"""Solids: all that stands in a world file, as one mesh of triangles: boxes, walls, cylinders, meshes, pads.

One function answers where a ray meets them: range finders, cameras and the legs of vehicles all ask it, so that they
agree (a leg is a ray from the centre of gravity to a foot: a surface that it crosses holds the foot). Spheres of hulls
are pushed off what is no floor, by the distance to the same triangles. Surfaces are seen and touched from both sides. A
world without any costs one comparison.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.world.terrain import FloatArray
from sim.world.trees import NO_OBSTACLE_M

if TYPE_CHECKING:
    from sim.world.custom.solid_parts import SolidPart

wp.set_module_options({"enable_backward": False})

FLOOR = wp.constant(0.5)  # cosine of the slope up to which a surface is stood on, and no obstacle: 60 deg
_FAR_DOWN_M = wp.constant(1.0e4)
_NEAR_M = wp.constant(1.0e-4)  # nearer, what is left of the difference of two positions is rounding
_TINY = wp.constant(1.0e-20)


@wp.struct
class Solids:
    """The triangles of one world."""

    mesh: wp.uint64  # id of the wp.Mesh; it must be kept alive by whoever made it
    count: int  # triangles; 0: there are none
    top_m: float  # height of the highest above the home plane


@wp.struct
class SolidHit:
    """Where a ray meets a solid first."""

    t: float  # [m] along the unit ray; the length asked for if it meets none
    normal_ned: wp.vec3  # unit, towards where the ray comes from
    face: int  # -1: none
    u: float  # barycentric coordinates
    v: float


@wp.func
def solids_hit(solids: Solids, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> SolidHit:
    """The first surface that a ray of unit direction meets within `max_m` [m]."""
    hit = SolidHit()
    hit.t = max_m
    hit.face = -1
    if solids.count > 0:
        query = wp.mesh_query_ray(solids.mesh, origin_ned, dir_ned, max_m)
        if query.result:
            hit.t = query.t
            hit.face = query.face
            hit.u = query.u
            hit.v = query.v
            hit.normal_ned = wp.normalize(query.normal)
            if wp.dot(hit.normal_ned, dir_ned) > 0.0:
                hit.normal_ned = -hit.normal_ned
    return hit


@wp.func
def solids_ray_hit(solids: Solids, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray of unit direction to the first surface, `max_m` if none."""
    if solids.count == 0 or -wp.max(origin_ned[2], origin_ned[2] + max_m * dir_ned[2]) > solids.top_m:
        return max_m
    return solids_hit(solids, origin_ned, dir_ned, max_m).t


@wp.func
def solids_gap(solids: Solids, pos_ned: wp.vec3, most_m: float) -> wp.vec4:
    """Unit vector from the nearest surface to a point, and its distance [m], `most_m` and no vector if farther."""
    gap = wp.vec4(0.0, 0.0, 0.0, most_m)
    if solids.count == 0 or -pos_ned[2] - most_m > solids.top_m:
        return gap
    query = wp.mesh_query_point_no_sign(solids.mesh, pos_ned, most_m)
    if query.result:
        off = pos_ned - wp.mesh_eval_position(solids.mesh, query.face, query.u, query.v)
        distance = wp.length(off)
        normal = wp.mesh_eval_face_normal(solids.mesh, query.face)
        if distance > _NEAR_M:
            normal = off / distance
        gap = wp.vec4(normal[0], normal[1], normal[2], distance)
    return gap


@wp.func
def closest_on_triangle(p: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec3:
    """The point of a triangle that is nearest to another point (C. Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab = b - a
    ac = c - a
    d1 = wp.dot(ab, p - a)
    d2 = wp.dot(ac, p - a)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    d3 = wp.dot(ab, p - b)
    d4 = wp.dot(ac, p - b)
    if d3 >= 0.0 and d4 <= d3:
        return b
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return a + (d1 / wp.max(d1 - d3, _TINY)) * ab
    d5 = wp.dot(ab, p - c)
    d6 = wp.dot(ac, p - c)
    if d6 >= 0.0 and d5 <= d6:
        return c
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return a + (d2 / wp.max(d2 - d6, _TINY)) * ac
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return b + ((d4 - d3) / wp.max((d4 - d3) + (d5 - d6), _TINY)) * (c - b)
    scale = 1.0 / wp.max(va + vb + vc, _TINY)
    return a + (vb * scale) * ab + (vc * scale) * ac


@wp.func
def solids_contact(solids: Solids, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with a surface that is no floor below it: push-out normal, penetration; 0 for none.

    A floor is what slopes by less than `FLOOR` says, and an edge that lies so far below. Where one is the nearest, what
    else is near is looked through.
    """
    contact = wp.vec4(0.0, 0.0, 0.0, 0.0)
    if solids_gap(solids, pos_ned, radius)[3] >= radius:
        return contact
    mesh = wp.mesh_get(solids.mesh)
    reach = wp.vec3(radius, radius, radius)
    query = wp.mesh_query_aabb(solids.mesh, pos_ned - reach, pos_ned + reach)
    face = int(0)
    while wp.mesh_query_aabb_next(query, face):
        a = mesh.points[mesh.indices[3 * face]]
        b = mesh.points[mesh.indices[3 * face + 1]]
        c = mesh.points[mesh.indices[3 * face + 2]]
        normal = wp.normalize(wp.cross(b - a, c - a))
        if wp.dot(normal, pos_ned - a) < 0.0:
            normal = -normal
        off = pos_ned - closest_on_triangle(pos_ned, a, b, c)
        distance = wp.length(off)
        if radius - distance > contact[3] and -normal[2] <= FLOOR:
            if distance > _NEAR_M:
                normal = off / distance
            if -normal[2] <= FLOOR:
                contact = wp.vec4(normal[0], normal[1], normal[2], radius - distance)
    return contact


@wp.func
def solids_height(solids: Solids, pos_ned: wp.vec3) -> float:
    """Height above the home plane [m] of the first surface straight below a point; far down if there is none."""
    if solids.count == 0:
        return -_FAR_DOWN_M
    hit = solids_hit(solids, pos_ned, wp.vec3(0.0, 0.0, 1.0), _FAR_DOWN_M)
    if hit.face < 0:
        return -_FAR_DOWN_M
    return -pos_ned[2] - hit.t


@wp.kernel
def _rays(
    solids: Solids,
    origins_ned: wp.array[wp.vec3],
    dirs_ned: wp.array[wp.vec3],
    max_m: float,
    t: wp.array[float],
    normals_ned: wp.array[wp.vec3],
) -> None:
    i = wp.tid()
    hit = solids_hit(solids, origins_ned[i], dirs_ned[i], max_m)
    t[i] = hit.t
    normals_ned[i] = hit.normal_ned


@wp.kernel
def _gaps(solids: Solids, points_ned: wp.array[wp.vec3], most_m: float, gaps_m: wp.array[float]) -> None:
    i = wp.tid()
    gaps_m[i] = solids_gap(solids, points_ned[i], most_m)[3]


@dataclass(frozen=True, eq=False)
class SolidsMap:
    """The solids on the host: the same triangles, asked by the same functions."""

    parts: tuple["SolidPart", ...] = ()

    @cached_property
    def vertices_ned(self) -> NDArray[np.float32]:
        """Corners of all triangles [m], (n, 3)."""
        corners = [part.vertices_ned for part in self.parts]
        return np.concatenate(corners).astype(np.float32) if corners else np.zeros((0, 3), np.float32)

    @cached_property
    def faces(self) -> NDArray[np.int32]:
        """Which corners each triangle has, (m, 3)."""
        firsts = np.cumsum([0, *(len(part.vertices_ned) for part in self.parts)])
        faces = [part.faces + first for part, first in zip(self.parts, firsts, strict=False)]
        return np.concatenate(faces).astype(np.int32) if faces else np.zeros((0, 3), np.int32)

    @cached_property
    def _meshes(self) -> dict[str, Any]:
        """Of each device that they are on."""
        return {}

    def kernel(self, device: str) -> Solids:
        """The solids as kernels read them; the map keeps the mesh alive."""
        solids = Solids()
        solids.top_m = NO_OBSTACLE_M
        if not self.parts:
            return solids
        if device not in self._meshes:
            points = wp.array(self.vertices_ned, dtype=wp.vec3, device=device)
            indices = wp.array(self.faces.ravel(), dtype=wp.int32, device=device)
            self._meshes[device] = wp.Mesh(points=points, indices=indices)
        solids.mesh = self._meshes[device].id
        solids.count = len(self.faces)
        solids.top_m = float(-self.vertices_ned[:, 2].min())
        return solids

    def rays(
        self, origins_ned: FloatArray, dirs_ned: FloatArray, max_m: float
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Distances [m] of the first surfaces along rays, `max_m` for none, and their normals; (rays,), (rays, 3)."""
        count = len(origins_ned)
        t, normals = wp.zeros(count, dtype=float, device="cpu"), wp.zeros(count, dtype=wp.vec3, device="cpu")
        given = [
            wp.array(np.asarray(rows, np.float32), dtype=wp.vec3, device="cpu") for rows in (origins_ned, dirs_ned)
        ]
        wp.launch(_rays, count, [self.kernel("cpu"), *given, max_m, t, normals], device="cpu")
        return t.numpy(), normals.numpy()

    def ray_hit(self, origin_ned: FloatArray, dir_ned: FloatArray, max_m: float) -> float:
        """Distance [m] along a ray of unit direction to the first surface, `max_m` if none."""
        if not self.parts:
            return max_m
        return min(float(self.rays(origin_ned[None], dir_ned[None], max_m)[0][0]), max_m)

    def distance(self, pos_ned: FloatArray, most_m: float = 1000.0) -> FloatArray:
        """Distance [m] from each point, shape (points, 3), to the nearest surface; inf beyond `most_m`."""
        if not self.parts or len(pos_ned) == 0:
            return np.full(len(pos_ned), np.inf)
        gaps = wp.zeros(len(pos_ned), dtype=float, device="cpu")
        points = wp.array(np.asarray(pos_ned, np.float32), dtype=wp.vec3, device="cpu")
        wp.launch(_gaps, len(pos_ned), [self.kernel("cpu"), points, most_m, gaps], device="cpu")
        found = gaps.numpy().astype(np.float64)
        return np.asarray(np.where(found < most_m, found, np.inf))

    def height(self, north: FloatArray, east: FloatArray) -> FloatArray:
        """Height [m] of the highest surface over places on the map, -inf where there is none."""
        north, east = np.broadcast_arrays(np.asarray(north, np.float64), np.asarray(east, np.float64))
        if not self.parts:
            return np.full(north.shape, -np.inf)
        top = float(-self.vertices_ned[:, 2].min()) + 1.0
        origins = np.stack([north.ravel(), east.ravel(), np.full(north.size, -top)], axis=-1)
        far = 2.0e4
        t, _ = self.rays(origins, np.broadcast_to([0.0, 0.0, 1.0], origins.shape), far)
        return np.where(t < far, top - t.astype(np.float64), -np.inf).reshape(north.shape)
