"""Laws of the world: what must hold at every point and along every ray of every map."""

from functools import cache

import numpy as np
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from sim.world.poisson import poisson_disc
from sim.world.world import WorldConfig, WorldMap, build_world
from tests.unit.sim.world.queries import query_points, query_rays

FEW = settings(max_examples=60, deadline=None)  # the first example compiles a kernel
HALF_M = 100.0
seeds = st.integers(0, 2**32 - 1)
along_map = st.floats(-HALF_M, HALF_M, width=32)
around_map = st.floats(-1.2 * HALF_M, 1.2 * HALF_M, width=32)
heights = st.floats(-3.0, 30.0, width=32)


@cache
def small_world(trees_per_ha: float = 120.0, has_walls: bool = True) -> WorldMap:
    return build_world(
        WorldConfig(
            seed=7,
            size_m=2.0 * HALF_M,
            hill_wavelength_m=100.0,
            clearing_radius_m=10.0,
            clearing_blend_m=40.0,
            trees_per_ha=trees_per_ha,
            has_walls=has_walls,
        )
    )


@st.composite
def directions(draw: st.DrawFn) -> np.ndarray:
    vector = np.array([draw(st.floats(-1.0, 1.0, width=32)) for _ in range(3)])
    length = np.linalg.norm(vector)
    assume(length > 0.1)
    return (vector / length).astype(np.float32).astype(np.float64)


@given(seed=seeds)
@settings(max_examples=10, deadline=None)
def test_same_seed_same_bytes(seed):
    config = WorldConfig(seed=seed, size_m=100.0)
    first, second = build_world(config), build_world(config)
    assert first.heights.tobytes() == second.heights.tobytes()
    assert first.trees.tobytes() == second.trees.tobytes()
    assert first.height(0.0, 0.0) == 0.0


@given(seed=seeds, spacing_m=st.floats(2.0, 40.0), keep_out_m=st.floats(0.0, 60.0))
@settings(max_examples=20, deadline=None)
def test_poisson_disc_keeps_its_distances(seed, spacing_m, keep_out_m):
    points = poisson_disc(seed, 100.0, spacing_m, keep_out_m)
    distance = np.linalg.norm(points[:, None] - points, axis=-1)[~np.eye(len(points), dtype=bool)]
    assert distance.min(initial=np.inf) >= spacing_m * (1.0 - 1e-12)
    assert np.linalg.norm(points, axis=1).min(initial=np.inf) >= keep_out_m
    assert np.abs(points).max(initial=0.0) <= 50.0


@given(north=around_map, east=around_map)
@FEW
def test_kernel_height_is_the_host_height(north, east):
    world = small_world()
    height, _, _ = query_points(world, np.array([[north, east, 0.0]]))
    assert abs(height[0] - world.height(north, east)) < 2e-5  # float32 position times a slope below 1


@given(north=along_map, east=along_map)
@FEW
def test_normal_is_unit_up_and_perpendicular_to_the_surface(north, east):
    world = small_world()
    step = 1e-5
    # finite differences hold inside one triangle: stay clear of the sides of the cell and of its diagonal
    u, v = ((x + HALF_M) / 4.0 % 1.0 for x in (north, east))
    assume(min(u, v, 1.0 - u, 1.0 - v, abs(u - v)) > step)
    for normal in (world.normal_ned(north, east), query_points(world, np.array([[north, east, 0.0]]))[1][0]):
        assert abs(np.linalg.norm(normal) - 1.0) < 1e-6
        assert normal[2] < 0.0
        here = world.height(north, east)
        rise_north = world.height(north + step, east) - here
        rise_east = world.height(north, east + step) - here
        assert abs(np.dot(normal, [step, 0.0, -rise_north])) < 1e-6 * step + 1e-11
        assert abs(np.dot(normal, [0.0, step, -rise_east])) < 1e-6 * step + 1e-11


@given(north=around_map, east=around_map, height=heights, dir_ned=directions())
@example(north=101.0, east=100.75, height=1.0, dir_ned=np.array([-0.5, -0.5, 0.0]) * 2.0**0.5)  # a wall's end
@FEW
def test_ray_ends_on_a_surface_and_meets_nothing_before(north, east, height, dir_ned):
    world = small_world()
    origin = np.array([north, east, -height])
    max_m = 80.0
    for hit in (world.ray_hit(origin, dir_ned, max_m), query_rays(world, origin[None], dir_ned[None], max_m)[0]):
        assert 0.0 <= hit <= max_m
        # a grazing ray may dip in by float32 rounding, less than 1 mm on this map
        before = origin + np.linspace(0.0, hit, 4000, endpoint=False)[:, None] * dir_ned
        assert hit == 0.0 or world.clearance(before).min() > -1e-3
        if 0.0 < hit < max_m:
            assert abs(world.clearance(origin + hit * dir_ned)) < 1e-3
        if hit == 0.0:
            assert world.clearance(origin) < 1e-4


@given(north=along_map, east=along_map, height=st.floats(15.0, 60.0, width=32))
@FEW
def test_ray_downwards_measures_the_height_above_ground(north, east, height):
    world = small_world(trees_per_ha=0.0, has_walls=False)
    above = height - float(world.height(north, east))
    origin, down = np.array([[north, east, -height]]), np.array([[0.0, 0.0, 1.0]])
    assert abs(world.ray_hit(origin[0], down[0], 100.0) - above) < 1e-9
    assert abs(query_rays(world, origin, down, 100.0)[0] - above) < 1e-4


@given(north=around_map, east=around_map, height=heights, radius=st.floats(0.1, 2.0))
@FEW
def test_contact_depth_is_radius_less_distance(north, east, height, radius):
    world = small_world()
    pos = np.array([north, east, -height])
    _, _, contact = query_points(world, pos[None], radius)
    assert abs(contact[0, 3] - max(radius - float(world.obstacle_distance(pos)), 0.0)) < 1e-4
    length = np.linalg.norm(contact[0, :3])
    assert abs(length - 1.0) < 1e-5 if contact[0, 3] > 0.0 else length == 0.0


@given(
    i_tree=st.integers(0, 10_000), off=st.tuples(*[st.floats(-3.0, 3.0, width=32)] * 2), fraction=st.floats(0.1, 1.1)
)
@FEW
def test_pushing_out_along_the_normal_ends_the_contact(i_tree, off, fraction):
    world = small_world(trees_per_ha=20.0)  # sparse: one tree at a time
    tree = world.trees[i_tree % len(world.trees)]
    height = tree["root_height"] + fraction * (tree["crown_high"] + tree["crown_radius"] - tree["root_height"])
    pos = np.array([tree["north"] + off[0], tree["east"] + off[1], -height], np.float64)
    for _ in range(20):  # in the corner between trunk and crown each push gives way to the other
        _, _, contact = query_points(world, pos[None])
        pos = pos + contact[0, 3] * contact[0, :3]
    assert world.obstacle_distance(pos) > 0.3 - 5e-3
