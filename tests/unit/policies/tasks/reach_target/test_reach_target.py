import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.episode import Outcome

NAME = "ReachTarget"
SIZES = (9, 9, 15, 9, 9)
LEVEL = (0.0, 0.0, 0.0, 1.0)


def built(count=1, params=None, **settings):
    task = build_task(NAME, count, task_settings(NAME, settings))
    task.set_params(params or {})
    task.reset(0)
    return task


def set_row(task, i=0, **values):
    """Puts fields of one row, which the next step uses."""
    for name, value in values.items():
        array = getattr(task.world, name)
        rows = array.numpy().copy()
        rows[i] = value
        array.assign(rows)


def act(task, steer=0.0, throttle=0.0, brake=0.0, count=1):
    task.buffers.continuous.numpy()[:] = (steer, throttle, brake)
    for _ in range(count):
        task.step()


def reward(task):
    return float(task.buffers.rewards.numpy()[0])


def outcome(task):
    return Outcome(int(task.buffers.outcomes.numpy()[0]))


def rolling(task, pos, vel, yaw=0.0):
    """Sets row 0 rolling along its heading, wheels turning with it."""
    q = (0.0, np.sin(yaw / 2), 0.0, np.cos(yaw / 2))
    set_row(task, pos=pos, q=q, vel=(vel * np.sin(yaw), 0.0, vel * np.cos(yaw)), spin=(vel / 0.5,) * 4)


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
@pytest.mark.parametrize("settings", [{"variant": k} for k in range(5)] + [{"preset": "improved"}])
def test_it_is_a_valid_gymnasium_environment(settings):
    check_env(gymnasium.make("honeyguide/ReachTarget-v0", render_mode="rgb_array", **settings).unwrapped)


@pytest.mark.parametrize("variant", range(5))
@pytest.mark.parametrize("preset", ["as-documented", "as-coded"])
def test_variants_differ_in_what_they_see_and_whether_the_way_is_paid(variant, preset):
    task = built(variant=variant, preset=preset)
    assert task.layout.observation_size == SIZES[variant]
    assert task.settings.reward.startswith("shaped") == (variant in (1, 2, 3))


def test_world_observations_are_target_car_velocity_direction_and_heading_in_that_order():
    task = built(variant=2)
    act(task, 0.5, 0.5, -1.0, 5)
    world = task.world
    target, pos, vel = world.target.numpy()[0], world.pos.numpy()[0], world.vel.numpy()[0]
    direction = (target - pos) / np.linalg.norm(target - pos)
    seen = task.buffers.observations.numpy()[0]
    assert np.allclose(seen[:12], np.concatenate([target, pos, vel, direction]), atol=1e-5)
    assert np.dot(seen[12:], vel) == pytest.approx(np.linalg.norm(vel), rel=0.1)  # it drives where it heads


def test_car_observations_are_the_world_ones_turned_into_the_car():
    task = built(variant=3)
    rolling(task, (10.0, 0.859, 5.0), 4.0, np.pi / 2)  # heading along +x
    set_row(task, target=(10.0, 0.5, 25.0))  # 20 m to its left
    act(task)
    seen = task.buffers.observations.numpy()[0]
    assert seen[:3] == pytest.approx([-20.0, 0.5 - 0.859, -0.8], abs=0.05)
    assert seen[3:6] == pytest.approx([0.0, 0.0, 4.0], abs=0.05)
    assert seen[6:9] == pytest.approx(seen[:3] / np.linalg.norm(seen[:3]), abs=1e-5)


def test_ego_observation_gives_bearing_distance_and_edges():
    task = built(observation="ego")
    rolling(task, (10.0, 0.859, 5.0), 4.0, np.pi / 2)
    set_row(task, target=(10.8, 0.5, 8.0), target_yaw=np.pi)
    act(task, 0.1)
    seen = {element.name: value for element, value in zip(task.layout.frame, task.buffers.observations.numpy()[0])}  # noqa: B905
    assert seen["goal_bearing_sin"] == pytest.approx(-1.0, abs=0.01)
    assert seen["goal_distance"] == pytest.approx(3.0 / 50.0, abs=0.001)
    assert seen["goal_distance_near"] == pytest.approx(3.0 / 5.0, abs=0.01)
    assert seen["vel_car_z"] == pytest.approx(0.4, abs=0.01)
    assert seen["steering"] == pytest.approx(0.1)
    assert seen["edge_ahead"] == pytest.approx((50.0 - 10.8) / 50.0, abs=0.01)
    assert seen["edge_right"] == pytest.approx((50.0 + 5.0) / 50.0, abs=0.05)
    assert seen["edge_behind"] == pytest.approx((50.0 + 10.8) / 50.0, abs=0.01)
    assert seen["edge_left"] == pytest.approx((50.0 - 5.0) / 50.0, abs=0.05)
    assert seen["goal_heading_cos"] == pytest.approx(0.0, abs=0.1)
    assert seen["goal_heading_sin"] == pytest.approx(1.0, abs=0.1)


def test_stacked_heights_are_those_of_the_published_scene():
    task = built(18, variant=0, heights="stacked")
    heights = task.buffers.observations.numpy()[:, 4]
    assert heights == pytest.approx([1.0 - 20.0 * (k % 16) for k in range(18)])


def test_a_reach_as_coded_pays_one_ends_the_episode_and_keeps_the_motion():
    task = built(variant=4, preset="as-coded")
    rolling(task, (0.0, 0.859, 0.0), 5.0)
    set_row(task, target=(0.0, 0.5, 1.5))
    act(task)
    assert outcome(task) == Outcome.SUCCESS
    assert reward(task) == 1.0
    assert task.buffers.is_terminated.numpy()[0]
    # tested every physics step: 1.5 m less the planar radius sqrt(1 - 0.359²) = 0.933 are passed after 0.12 s
    assert task.world.pos.numpy()[0, 2] == pytest.approx(0.6, abs=0.02)
    assert task.world.vel.numpy()[0, 2] == pytest.approx(5.0, abs=0.05)
    assert task.buffers.episodes.numpy()[0] == 2
    assert np.abs(task.world.target.numpy()[0] - (0.0, 0.5, 1.5)).max() > 0.1


def test_a_reach_as_documented_pays_one_moves_the_target_and_goes_on():
    task = built(variant=4, preset="as-documented", params={"step_limit": 3.0})
    rolling(task, (0.0, 0.859, 0.0), 5.0)
    set_row(task, target=(0.0, 0.5, 1.5))
    act(task)
    assert outcome(task) == Outcome.RUNNING
    assert reward(task) == 1.0
    assert task.world.pos.numpy()[0, 2] == pytest.approx(1.0, abs=0.02)  # the whole decision was driven
    assert task.world.target.numpy()[0, 2] != 1.5
    act(task, count=2)
    assert outcome(task) == Outcome.SUCCESS  # one target in an episode that was cut
    assert task.buffers.is_truncated.numpy()[0]
    assert not task.buffers.is_terminated.numpy()[0]
    assert task.world.pos.numpy()[0] == pytest.approx([0.0, 1.0, 0.0])  # back in the middle


@pytest.mark.parametrize(("preset", "times"), [("as-coded", 1), ("as-documented", 10)])
def test_shaping_pays_the_speed_towards_the_target_over_two_thousand(preset, times):
    task = built(variant=3, preset=preset)
    rolling(task, (0.0, 0.859, -20.0), 10.0)
    set_row(task, target=(0.0, 0.859, 30.0))
    act(task)
    assert reward(task) == pytest.approx(times * 10.0 / 2000.0, rel=0.01)
    rolling(task, (0.0, 0.859, -20.0), -10.0)
    act(task)
    assert reward(task) == pytest.approx(-times * 10.0 / 2000.0, rel=0.01)


def test_potential_shaping_of_a_whole_episode_depends_on_where_it_began_only():
    task = built(observation="ego", reward="potential", params={"shaping_gamma": 1.0})
    rolling(task, (0.0, 0.859, 0.0), 10.0)
    set_row(task, target=(0.0, 0.5, 30.0))
    total = 0.0
    for _ in range(20):
        act(task)
        total += reward(task)
        if outcome(task) != Outcome.RUNNING:
            break
    assert outcome(task) == Outcome.SUCCESS
    assert total == pytest.approx(1.0 + 30.0 / 50.0, rel=1e-4)


def test_standing_still_is_cut_after_two_hundred_decisions_and_starts_in_the_middle_again():
    task = built(4)
    act(task, brake=1.0, count=199)
    assert not task.buffers.is_truncated.numpy().any()
    act(task, brake=1.0)
    assert (task.buffers.outcomes.numpy() == Outcome.TIMEOUT).all()
    assert task.buffers.is_truncated.numpy().all()
    assert task.world.pos.numpy() == pytest.approx(np.tile([0.0, 1.0, 0.0], (4, 1)))
    assert not task.world.vel.numpy().any()


def test_driving_on_falls_off_the_edge_without_a_penalty():
    for preset in ("as-documented", "as-coded"):
        task = built(64, preset=preset)
        task.set_params({"reach_m": 0.05})
        act(task, 0.0, 0.4, 0.0, 60)
        scores = task.take_scores()
        assert scores.count(Outcome.FELL) + scores.count(Outcome.HIT_OTHER) >= 64
        assert scores.return_sum == scores.count(Outcome.SUCCESS)


def test_creeping_over_the_edge_strikes_it_as_coded_and_only_falls_as_documented():
    ends = []
    for preset in ("as-coded", "as-documented"):
        task = built(preset=preset)
        rolling(task, (0.0, 0.859, 47.0), 2.0)
        for _ in range(50):
            act(task, throttle=0.05)
            if outcome(task) != Outcome.RUNNING:
                break
        ends.append(outcome(task))
    assert ends == [Outcome.HIT_OTHER, Outcome.FELL]


def test_a_car_on_its_roof_ends_the_episode_as_coded_and_lies_there_as_documented():
    task = built(preset="as-coded")
    set_row(task, pos=(0.0, 0.6, 0.0), q=(0.0, 0.0, 1.0, 0.0))
    act(task, count=2)
    assert task.take_scores().count(Outcome.HIT_OTHER) == 1
    task = built(preset="as-documented")
    set_row(task, pos=(0.0, 0.6, 0.0), q=(0.0, 0.0, 1.0, 0.0))
    act(task, throttle=1.0, count=50)
    assert task.world.pos.numpy()[0] == pytest.approx([0.0, 0.5, 0.0], abs=0.05)
    assert np.abs(task.world.vel.numpy()[0]).max() < 0.05


def test_starts_and_targets_lie_where_the_published_scene_puts_them():
    task = built(4096)
    target = task.world.target.numpy()
    assert np.abs(target[:, [0, 2]]).max() <= 47.0
    assert np.abs(target[:, [0, 2]]).mean() == pytest.approx(23.5, abs=0.7)  # 3 sigma of 8,192 even draws: 0.45
    assert (target[:, 1] == 0.5).all()
    assert (task.world.pos.numpy() == (0.0, 1.0, 0.0)).all()
    q = task.world.q.numpy()
    degrees = np.degrees(2.0 * np.arctan2(q[:, 1], q[:, 3]))
    assert np.abs(degrees - np.round(degrees)).max() < 1e-3
    assert len(np.unique(np.round(degrees))) > 340


def test_goals_of_training_of_validation_and_of_tests_share_no_square_of_the_ground():
    def squares(split):
        task = built(8192, preset="improved", split=split)
        return {tuple(square) for square in np.floor(task.world.target.numpy()[:, [0, 2]] / 2.0).astype(int)}

    train, validation, test = squares("train"), squares("validation"), squares("test")
    assert not train & test
    assert not train & validation
    assert not validation & test
    assert len(test) > 150  # of 2,209 squares every tenth
    assert len(validation) > 150
    assert len(train) > 1500


def test_the_improved_goal_needs_position_heading_and_speed():
    def is_success(away=0.0, turn_deg=0.0, speed=0.0):
        task = built(preset="improved")
        rolling(task, (0.0, 0.859, 0.0), speed)
        set_row(task, target=(away, 0.5, 0.0), target_yaw=np.radians(turn_deg))
        act(task)
        return outcome(task) == Outcome.SUCCESS

    assert is_success(0.28, 9.0, 0.2)
    assert not is_success(away=0.35)
    assert not is_success(turn_deg=12.0)
    assert not is_success(speed=3.0)


def test_wrong_settings_are_refused():
    with pytest.raises(UnknownTask, match="variant"):
        task_settings(NAME, {"variant": 5})
    with pytest.raises(UnknownTask, match="preset"):
        task_settings(NAME, {"preset": "as-dreamt"})


def test_a_picture_shows_the_car_and_the_target():
    task = built()
    set_row(task, target=(30.0, 0.5, 30.0))
    image = task.top_view(0, 400)
    middle, corner = image[200, 200], image[400 - 200 - int(30 * 400 / 110) + 8, 200 + int(30 * 400 / 110)]
    assert not np.array_equal(middle, corner)
