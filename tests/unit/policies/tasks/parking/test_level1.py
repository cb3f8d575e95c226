import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.parking.arena import BLOCK_POSITIONS, LEVEL1_MARKER, LEVEL1_SPOTS, LEVEL1_START, pose
from policies.tasks.parking.spots import cells
from policies.tasks.task_params import Sampler

PRESETS = ("as-documented", "as-coded", "improved")
PUSH, RIGHT, LEFT = 0, 1, 2


def built(env_count=1, seed=0, params=None, **settings):
    task = build_task("Parking1", env_count, task_settings("Parking1", settings))
    task.set_params(params or {})
    task.reset(seed)
    return task


def act(task, *actions):
    """Steps with one action, or one per row; returns rewards."""
    task.buffers.branches.numpy()[:] = np.array(actions).reshape(-1, task.buffers.branches.shape[1])
    task.step()
    return task.buffers.rewards.numpy().copy()


def put(task, row, *, pos=None, yaw_deg=None, vel=None, goal=None):
    """Moves car or goal of one row."""
    world = task.world
    if pos is not None:
        world.pos.numpy()[row] = pos
    if yaw_deg is not None:
        world.yaw.numpy()[row] = np.radians(yaw_deg)
    if vel is not None:
        world.vel.numpy()[row] = vel
    if goal is not None:
        world.goal.numpy()[row] = pose(goal)


def drive_until_over(task, action, limit=2000):
    for _ in range(limit):
        act(task, action)
        if task.buffers.outcomes.numpy()[0]:
            return Outcome(int(task.buffers.outcomes.numpy()[0]))
    return Outcome.RUNNING


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_it_is_a_valid_gymnasium_environment(preset):
    check_env(gymnasium.make("honeyguide/Parking1-v0", preset=preset, render_mode="rgb_array").unwrapped)


def test_presets_have_the_documented_sizes_of_observation_and_action():
    assert [built(preset=preset).layout.observation_size for preset in PRESETS] == [27, 27, 24]
    assert [built(preset=preset).layout.branch_sizes for preset in PRESETS] == [(3,), (3,), (3, 3)]
    assert [built(preset=preset).decision_s for preset in PRESETS] == [0.06, 0.06, 0.06]


def test_a_push_as_coded_adds_two_metres_per_second_and_is_damped_in_three_ticks():
    task = built()
    speed = 0.0
    for _ in range(5):
        act(task, PUSH)
        speed = (speed + 800.0 / 8.0 * 0.02) * 0.84**3
    assert task.world.vel.numpy()[0] == pytest.approx([0.0, speed], rel=1e-5)


def test_as_documented_the_car_is_pushed_in_every_tick_and_reaches_its_terminal_speed():
    task = built(preset="as-documented")
    put(task, 0, goal=(8.0, 12.0, 0.0))
    for _ in range(20):
        act(task, 0)
    assert task.world.vel.numpy()[0][1] == pytest.approx(1.0 * 0.84 / 0.16, rel=1e-4)  # v = (v + 400/8 x 0.02) x 0.84


def test_a_turn_as_coded_is_three_degrees_and_leaves_the_push_out():
    task = built()
    act(task, RIGHT)
    assert np.degrees(task.world.yaw.numpy()[0]) == pytest.approx(3.0, abs=1e-4)
    act(task, LEFT)
    act(task, LEFT)
    assert np.degrees(task.world.yaw.numpy()[0]) == pytest.approx(-3.0, abs=1e-4)
    assert not task.world.vel.numpy().any()


def test_the_first_goal_as_coded_is_the_marker_of_the_scene_and_a_crash_keeps_it_and_the_velocity():
    task = built()
    assert task.world.goal.numpy()[0, :2] == pytest.approx(LEVEL1_MARKER)
    put(task, 0, pos=(-13.0, 13.8), vel=(0.0, 5.0))
    act(task, PUSH)
    assert task.buffers.outcomes.numpy()[0] == Outcome.HIT_WALL
    assert task.world.goal.numpy()[0, :2] == pytest.approx(LEVEL1_MARKER)
    assert task.world.pos.numpy()[0] == pytest.approx(LEVEL1_START[:2])
    assert task.world.vel.numpy()[0, 1] > 3.0


def test_a_park_as_coded_draws_one_of_the_three_spots_and_stops_the_car():
    task = built(64)
    for row in range(64):
        put(task, row, pos=LEVEL1_MARKER, vel=(0.0, 1.0))
    act(task, *[PUSH] * 64)
    assert (task.buffers.outcomes.numpy() == Outcome.SUCCESS).all()
    assert not task.world.vel.numpy().any()
    goals = {tuple(np.round(goal, 3)) for goal in task.world.goal.numpy()[:, :2].tolist()}
    assert goals == set(LEVEL1_SPOTS)


def test_as_documented_every_episode_draws_a_spot_and_starts_at_rest():
    task = built(64, preset="as-documented")
    for row in range(64):
        put(task, row, pos=(0.0, 14.0), vel=(0.0, 5.0))
    act(task, *[0] * 64)
    assert (task.buffers.outcomes.numpy() == Outcome.HIT_WALL).all()
    assert not task.world.vel.numpy().any()
    assert len({tuple(goal) for goal in task.world.goal.numpy()[:, :2].tolist()}) == len(LEVEL1_SPOTS)


@pytest.mark.parametrize(("x", "z", "yaw_deg"), BLOCK_POSITIONS)
def test_driving_into_a_block_ends_as_a_hit_of_an_obstacle(x, z, yaw_deg):
    task = built(goals="anywhere")
    put(task, 0, pos=(x, z - 4.0), yaw_deg=0.0, goal=(14.0, 14.0, 0.0))
    assert drive_until_over(task, PUSH) == Outcome.HIT_OBSTACLE
    assert task.buffers.rewards.numpy()[0] == pytest.approx(-0.5, abs=0.02)


def test_an_episode_without_limit_goes_on_and_one_with_a_limit_is_truncated():
    task = built(2)
    for _ in range(300):
        act(task, RIGHT, RIGHT)
    assert task.buffers.steps.numpy().tolist() == [300, 300]
    task = built(2, params={"step_limit": 20.0})
    for _ in range(20):
        act(task, RIGHT, RIGHT)
    assert (task.buffers.outcomes.numpy() == Outcome.TIMEOUT).all()
    assert task.buffers.is_truncated.numpy().all()
    assert not task.buffers.is_terminated.numpy().any()


def test_success_in_pose_needs_place_heading_and_slowness():
    task = built(5, preset="improved")
    numbers_ahead = 0.29
    for row, (offset, turn_deg, speed) in enumerate(
        [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 14.0, 0.0), (0.0, 0.0, 1.0), (0.2, -8.0, 0.1)]
    ):
        goal = (0.0, 0.0, 30.0)
        task.blocks.numpy()[row] = [pose((12.0, z, 0.0)) for z in (-9.0, 0.0, 9.0)]
        yaw = np.radians(goal[2] + turn_deg)
        nose = np.array([np.sin(yaw), np.cos(yaw)])
        put(
            task, row, pos=(offset, 0.0) - numbers_ahead * nose, yaw_deg=goal[2] + turn_deg, vel=speed * nose, goal=goal
        )
    act(task, *[(0, 0)] * 5)
    assert task.buffers.outcomes.numpy().tolist() == [Outcome.SUCCESS, 0, 0, 0, Outcome.SUCCESS]


def test_improved_episodes_differ_and_begin_clear_of_everything():
    task = built(2048, preset="improved")
    assert not task.buffers.outcomes.numpy().any()
    act(task, *[(0, 0)] * 2048)
    assert not task.buffers.outcomes.numpy().any()
    blocks = task.blocks.numpy()[..., :2]
    gaps = np.linalg.norm(blocks[:, [0, 0, 1]] - blocks[:, [1, 2, 2]], axis=-1)
    assert gaps.min() >= 6.0
    goals = task.world.goal.numpy()[:, :2]
    assert np.linalg.norm(blocks - goals[:, None], axis=-1).min() > 1.6
    assert np.linalg.norm(task.world.pos.numpy() - goals, axis=-1).min() >= 3.1
    for values in (goals[:, 0], task.world.yaw.numpy(), blocks[:, 0, 0]):
        assert len(np.unique(values)) > 1900


def goal_cells(**settings):
    task = built(4096, goals="anywhere", resets="clean", **settings)
    return {tuple(cell) for cell in np.floor(task.world.goal.numpy()[:, :2]).astype(int).tolist()}


def test_goals_of_train_validation_and_test_lie_in_different_cells():
    train, validation, test = (goal_cells(split=split) for split in ("train", "validation", "test"))
    assert not train & validation
    assert not train & test
    assert not validation & test
    count = len(train) + len(validation) + len(test)
    assert 0.15 < len(test) / count < 0.25
    assert 0.05 < len(validation) / count < 0.11
    assert len(train) > 300


@pytest.mark.parametrize(("quarter", "signs"), [(1, (-1, -1)), (2, (1, -1)), (3, (-1, 1)), (4, (1, 1))])
def test_a_quarter_held_out_holds_the_test_goals_and_no_other(quarter, signs):
    test = np.array(list(goal_cells(quarter=quarter, split="test"))) + 0.5
    assert (np.sign(test) == signs).all()
    assert len(test) > 100
    for split in ("train", "validation"):
        others = np.array(list(goal_cells(quarter=quarter, split=split))) + 0.5
        assert not (np.sign(others) == signs).all(axis=1).any()
        assert len({tuple(sign) for sign in np.sign(others).tolist()}) == 3


@pytest.mark.parametrize("preset", ["as-documented", "as-coded"])
def test_published_spots_are_for_training_and_lie_in_training_cells(preset):
    def positions(**settings):
        return built(512, preset=preset, **settings).world.goal.numpy()[:, :2]

    assert len(np.unique(positions(), axis=0)) <= 3
    assert len(np.unique(positions(goals="one", resets="clean"), axis=0)) == 1
    test_cells = {tuple(cell) for cell in cells(0, 1, "test").tolist()}
    validation_cells = {tuple(cell) for cell in cells(0, 1, "validation").tolist()}
    assert {tuple(np.floor(position)) for position in positions(split="test").tolist()} <= test_cells
    assert {tuple(np.floor(position)) for position in positions(split="validation").tolist()} <= validation_cells
    assert not {tuple(np.floor(spot)) for spot in (*LEVEL1_SPOTS, LEVEL1_MARKER)} & (test_cells | validation_cells)
    assert len(np.unique(positions(split="test", goals="published"), axis=0)) <= 3


@pytest.mark.parametrize(
    ("position", "number", "sizes_m", "outcome"),
    [
        ((8.0, 9.0, 0.0), "pad_width_m", (2.5, 3.0), Outcome.SUCCESS),
        (BLOCK_POSITIONS[0], "block_width_m", (3.467, 5.0), Outcome.HIT_OBSTACLE),
    ],
)
def test_pads_and_blocks_are_as_wide_as_their_numbers_say(position, number, sizes_m, outcome):
    yaw_rad = np.radians(position[2])
    between = (sum(sizes_m) / 2 + 1.1317) / 2  # where a car beside it touches the wide one only
    pos = np.array(position[:2]) + between * np.array([np.cos(yaw_rad), -np.sin(yaw_rad)])
    for size_m, expected in zip(sizes_m, (Outcome.RUNNING, outcome), strict=True):
        task = built(params={number: size_m})
        put(task, 0, pos=pos, yaw_deg=position[2], goal=(8.0, 9.0, 0.0))
        act(task, RIGHT)
        assert task.buffers.outcomes.numpy()[0] == expected


def test_starts_may_be_kept_near_the_goal():
    task = built(512, starts="anywhere", goals="anywhere", resets="clean", params={"start_range_m": 5.0})
    gaps = np.abs(task.world.pos.numpy() - task.world.goal.numpy()[:, :2])
    assert gaps.max() <= 5.0


def test_a_mirrored_world_gives_mirrored_ranges():
    task = built(2, observation="ranged", rays=4)
    for row, side in enumerate((1.0, -1.0)):
        put(task, row, pos=(side * 3.0, -11.0), yaw_deg=side * 20.0, goal=(side * 8.0, 9.0, side * 40.0))
        task.blocks.numpy()[row] = [
            pose((side * x, z, side * yaw)) for x, z, yaw in ((4.0, 2.0, 25.0), (-6.0, 3.0, -50.0), (9.0, -9.0, 10.0))
        ]
    act(task, PUSH, PUSH)
    names = [element.name for element in task.layout.frame]
    seen = {name: task.buffers.observations.numpy()[:, k] for k, name in enumerate(names)}
    for name in names:
        if name.endswith("_right") and "wall" not in name:
            assert seen[name][0] == pytest.approx(-seen[name][1], abs=1e-5), name
        elif name.endswith("_forward") and "wall_x" not in name:
            assert seen[name][0] == pytest.approx(seen[name][1], abs=1e-5), name
    assert seen["ray_right_1_fraction"][0] == pytest.approx(seen["ray_left_1_fraction"][1], abs=2e-3)


def test_numbers_may_be_randomised():
    task = built(256, params={"drag_per_s": Sampler(intervals=((4.0, 12.0),))})
    act(task, *[PUSH] * 256)
    drag = task.buffers.params.numpy()[:, task.param_table.names.index("drag_per_s")]
    assert drag.std() > 1.0
    assert task.world.vel.numpy()[:, 1] == pytest.approx(2.0 * (1.0 - drag * 0.02) ** 3, rel=1e-4)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"preset": "hard"}, "Parking1: preset: must be as-documented, as-coded or improved, not hard"),
        ({"split": "all"}, "Parking1: split: must be train, validation or test, not all"),
        ({"ray_tags": "wall+tree"}, "Parking1: ray_tags: .*at most once"),
        ({"observation": "pixels"}, "Parking1: observation"),
    ],
)
def test_settings_that_do_not_exist_are_refused_in_one_sentence(settings, message):
    with pytest.raises(UnknownTask, match=message):
        task_settings("Parking1", settings)


def test_pictures_show_every_preset():
    for preset in PRESETS:
        image = built(preset=preset, rays=4).top_view(0, 240)
        assert image.shape[0] == 240
        assert len(np.unique(image.reshape(-1, 3), axis=0)) > 5


def test_every_other_episode_is_the_published_world_mirrored():
    task = built(512, preset="as-documented", mirrored=True)
    side = np.sign(task.world.pos.numpy()[:, 0]) / np.sign(LEVEL1_START[0])
    assert 0.4 < (side < 0.0).mean() < 0.6
    goals, blocks = task.world.goal.numpy(), task.blocks.numpy()
    flip = np.stack([side, np.ones(512), side, np.ones(512)], axis=1)
    plain = {tuple(np.round(goal, 4)) for goal in built(512, preset="as-documented").world.goal.numpy().tolist()}
    assert {tuple(np.round(goal, 4)) for goal in (goals * flip).tolist()} == plain
    assert np.allclose(blocks * flip[:, None], [pose(block) for block in BLOCK_POSITIONS], atol=1e-5)


def test_what_is_done_the_other_way_round_in_a_mirrored_episode_pays_the_same():
    task = built(64, preset="as-documented", reward="progress", goals="one", mirrored=True)
    side = np.sign(task.world.pos.numpy()[:, 0]) / np.sign(LEVEL1_START[0])
    assert len(set(side.tolist())) == 2
    rewards = np.array([act(task, *[RIGHT if s > 0 else LEFT for s in side]) for _ in range(10)])
    assert np.allclose(rewards, rewards[:, :1], atol=1e-5)
    assert np.abs(rewards[:, 0]).min() > 1e-3


def test_coded_resets_keep_the_side_of_an_environment():
    task = built(64, preset="as-coded", mirrored=True)
    side = np.sign(task.blocks.numpy()[:, 0, 0])
    assert len(set(side.tolist())) == 2
    for _ in range(100):
        act(task, *[[PUSH]] * 64)
        assert (np.sign(task.blocks.numpy()[:, 0, 0]) == side).all()
