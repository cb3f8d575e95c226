"""FollowMe: laws of its episodes, what its observations hold, what it pays and how it ends."""

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
import warp as wp
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.flight.own_state import OwnState
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_kernels import MEASURES
from policies.tasks.follow_me.observe import EGO, OwnerReport, observe_rows, vector_elements
from policies.tasks.follow_me.settings import FollowSettings

STATE = {"observation": "state", "has_estimator": "false"}
SMALL = {"image_size": "8"}


def _task(count: int, seed: int = 5, params: dict[str, float] | None = None, **settings: Any) -> FollowMe:
    task = build_task("FollowMe", count, task_settings("FollowMe", settings))
    assert isinstance(task, FollowMe)
    task.set_params(params or {})
    task.reset(seed)
    return task


def _fly(task: FollowMe, decisions: int, seed: int = 0) -> None:
    """The same gentle actions for a row, whatever the batch."""
    actions = np.random.default_rng(seed).uniform(-0.3, 0.3, (decisions, 4)).astype(np.float32)
    for action in actions:
        task.buffers.continuous.fill_(0.0)
        task.buffers.continuous.assign(np.tile(action, (task.env_count, 1)))
        task.step()


def _bytes(rows: NDArray[Any]) -> bytes:
    """Without the padding of structs, which NumPy does not copy."""
    if rows.dtype.names is None:
        return rows.tobytes()
    return b"".join(_bytes(rows[name]) for name in rows.dtype.names)


def test_single_environment_is_the_first_row_of_a_batch() -> None:
    one, many = _task(1, **SMALL), _task(3, **SMALL)
    _fly(one, 4)
    _fly(many, 4)
    for name in ("observations", "images", "privileged", "rewards"):
        assert getattr(one.buffers, name).numpy()[0].tobytes() == getattr(many.buffers, name).numpy()[0].tobytes(), name
    assert one.measures.numpy()[0].tobytes() == many.measures.numpy()[0].tobytes()


def test_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    first, second = _task(2, **STATE), _task(2, **STATE)
    second.reset(6)
    other = second.buffers.observations.numpy().copy()
    second.reset(5)
    _fly(first, 3)
    _fly(second, 3)
    assert first.buffers.observations.numpy().tobytes() == second.buffers.observations.numpy().tobytes()
    assert not np.array_equal(other, first.buffers.observations.numpy())


def test_beginning_one_row_touches_only_that_row() -> None:
    task = _task(3, **SMALL)
    _fly(task, 2)
    before = task.state()
    task.begin(np.array([False, True, False]))
    after = task.state()
    masks = {"is_starting", "is_growing"}
    per_row = [name for name, rows in before.items() if rows.shape[:1] == (3,) and name not in masks]
    assert {"observations", "images", "people", "rig2", "world_seeds"} <= set(per_row)
    for name in per_row:
        for row in (0, 2):
            assert _bytes(before[name][row]) == _bytes(after[name][row]), name
    for name in ("observations", "images", "people", "world_seeds"):
        assert _bytes(before[name][1]) != _bytes(after[name][1]), name


def test_restored_state_continues_bit_for_bit() -> None:
    params = {"decision_limit": 3.0}  # so that episodes begin in between
    task = _task(2, params=params, **SMALL)
    _fly(task, 2)
    kept = task.state()
    _fly(task, 3, seed=1)
    other = _task(2, seed=9, params=params, **SMALL)
    other.load_state(kept)
    _fly(other, 3, seed=1)
    restored = other.state()
    for name, rows in task.state().items():
        assert _bytes(rows) == _bytes(restored[name]), name


def test_observation_does_not_change_when_the_truth_does() -> None:
    task = _task(2, **SMALL)
    _fly(task, 8)
    task.is_starting.fill_(value=True)

    def shown() -> bytes:
        task._show.launch()  # writes the vector anew
        return bytes(task.buffers.observations.numpy().tobytes())

    before = shown()
    for array in (task.rig.truth, task.follow.people, task.follow.sights, task.follow.nearness):
        array.zero_()
    assert shown() == before


def test_vector_is_what_a_companion_makes_of_estimate_and_report() -> None:
    task = _task(1, **SMALL)
    _fly(task, 12)
    arrays, phone = task.rig.arrays, task.follow.phones.numpy()[0]
    estimate = arrays.autopilot.ekf.rows.numpy()[0]["estimate"]
    own, report = OwnState(), OwnerReport()
    q = wp.quat(*(float(x) for x in estimate["q_ned_from_frd"]))
    own.pos_ned = wp.vec3(*(float(x) for x in estimate["pos_ned"]))
    own.vel_ned = wp.vec3(*(float(x) for x in estimate["vel_ned"]))
    own.q_ned_from_frd = q
    own.yaw_rate = wp.quat_rotate(q, wp.vec3(*(float(x) for x in estimate["omega_frd"])))[2]
    sample = arrays.sensors.numpy()[0]["samples"]["range"]
    own.height_m = float(sample["distance_m"]) * wp.quat_rotate(q, wp.vec3(0.0, 0.0, 1.0))[2]
    own.is_height_valid = int(sample["is_valid"])
    assert phone["fix"]["is_known"] == 1
    report.pos_ned = wp.vec3(*(float(x) for x in phone["fix"]["pos_ned"]))
    report.vel_ned = wp.vec3(*(float(x) for x in phone["fix"]["vel_ned"]))
    report.age_s = (int(arrays.tick.numpy()[0]) * 4000 - int(phone["fix"]["time_us"])) * 1e-6
    report.is_known = 1
    out = wp.zeros((1, len(vector_elements(int(EGO)))), dtype=float)
    rows: list[Any] = [wp.array([own], dtype=OwnState), wp.array([report], dtype=OwnerReport)]
    action = wp.array(task.buffers.continuous.numpy(), dtype=wp.vec4)
    wp.launch(observe_rows, 1, [int(EGO), *rows, action, wp.zeros(1, dtype=float), out])
    np.testing.assert_allclose(task.buffers.observations.numpy()[0], out.numpy()[0], rtol=1e-5, atol=1e-6)


def test_episodes_start_as_takeovers_do() -> None:
    task = _task(64, **STATE)
    fixes, tick = task.follow.phones.numpy()["fix"].copy(), task.rig.arrays.tick.numpy().copy()
    people_ned = task.follow.people.numpy()["pos_ned"].copy()
    is_known = fixes["is_known"] == 1
    assert is_known.mean() > 0.9  # others are silent just then
    ages_s = tick * 0.004 - fixes["time_us"] * 1e-6
    assert ages_s[is_known].min() >= 0.3  # the phone's lag
    off_m = np.linalg.norm((fixes["pos_ned"] - people_ned)[is_known, :2], axis=1)
    assert 0.5 < off_m.mean() < 4.0
    task.step()
    heights_m = task.rig.rows["truth"]["height_agl_m"]
    assert heights_m.min() < 2.0
    assert heights_m.max() > 3.0  # a vehicle's least takeoff is 2.5 m


@pytest.mark.parametrize(("aside_m", "outcome"), [(0.0, Outcome.HIT_OTHER), (0.3, Outcome.RUNNING)])
def test_an_owner_who_runs_past_between_two_decisions_has_been_hit(aside_m: float, outcome: Outcome) -> None:
    task = _task(1, params={"touch_m": 0.2, "trees_per_ha": 0.0, "owner_speed_max": 6.0}, **STATE)
    people = task.follow.people.numpy()
    drone_ned = task.rig.rows["truth"][0]["pos_ned"]
    people["pos_ned"][0, :2] = drone_ned[0] + aside_m, drone_ned[1] - 0.3  # 0.6 m to the east in 0.1 s
    people["course_rad"] = people["heading_rad"] = 0.5 * math.pi
    people["speed"] = people["speed_sp"] = 6.0
    people["turn_rate"] = people["bend_rad_s"] = 0.0
    people["plan_left_s"] = 10.0
    people["stature_m"] = 4.0  # as high as the drone flies
    task.follow.people.assign(people)
    task.step()
    assert Outcome(int(task.buffers.outcomes.numpy()[0])) is outcome


def _documented(params: dict[str, float]) -> tuple[float, Outcome]:
    task = _task(1, params=params, preset="as-documented", observation="state", has_estimator="false")
    task.step()
    return float(task.buffers.rewards.numpy()[0]), Outcome(int(task.buffers.outcomes.numpy()[0]))


def test_documented_rewards_are_five_payments_a_decision_and_a_fine_for_a_collision() -> None:
    near = {"start_distance_min_m": 2.0, "start_distance_max_m": 2.5}
    far = {"start_distance_min_m": 4.0, "start_distance_max_m": 5.0}
    assert _documented(near) == (pytest.approx(0.5), Outcome.RUNNING)
    assert _documented(far) == (pytest.approx(-0.25), Outcome.RUNNING)
    assert _documented(near | {"touch_m": 3.0}) == (pytest.approx(-10.0), Outcome.HIT_OTHER)


def test_documented_choices_fly_forward_up_and_left() -> None:
    task = _task(1, preset="as-documented", observation="state", has_estimator="false")
    task.buffers.branches.assign(np.array([[1, 1, 1]], dtype=np.int32))
    for _ in range(6):
        task.step()
    seen = dict(zip((e.name for e in task.layout.frame), task.buffers.observations.numpy()[0], strict=True))
    assert seen["true_vel_hfrd_x"] > 0.05
    assert seen["true_vel_hfrd_z"] < -0.01
    assert seen["true_yaw_rate"] < -0.2


@pytest.mark.parametrize(("distance_m", "outcome"), [(2.0, Outcome.SUCCESS), (6.0, Outcome.TIMEOUT)])
def test_time_running_out_is_a_truncation_and_a_success_where_the_owner_is_followed(
    distance_m: float, outcome: Outcome
) -> None:
    start = {"start_distance_min_m": distance_m, "start_distance_max_m": distance_m, "start_bearing_deg": 0.0}
    task = _task(1, params={"decision_limit": 1.0, **start}, **STATE)
    task.step()
    buffers = task.buffers
    assert Outcome(int(buffers.outcomes.numpy()[0])) is outcome
    assert (bool(buffers.is_truncated.numpy()[0]), bool(buffers.is_terminated.numpy()[0])) == (True, False)
    assert task.take_scores().count(outcome) == 1


def test_losing_the_owner_and_touching_the_ground_end_an_episode() -> None:
    task = _task(2, params={"wind_m_s": 0.0}, **STATE)
    ends = [set[Outcome](), set[Outcome]()]
    task.buffers.continuous.assign(np.array([[0, 0, 1, 0], [-1, 0, -0.2, 0]], dtype=np.float32))
    for _ in range(40):
        task.step()
        for row, outcome in enumerate(task.buffers.outcomes.numpy()):
            ends[row].add(Outcome(int(outcome)))
    assert ends[0] - {Outcome.RUNNING} == {Outcome.HIT_OBSTACLE}
    assert ends[1] - {Outcome.RUNNING} <= {Outcome.LOST, Outcome.HIT_OBSTACLE}
    assert Outcome.LOST in ends[1]


def test_measures_are_the_truth_about_the_owner() -> None:
    task = _task(4, **STATE)
    _fly(task, 5)
    measures = dict(zip(MEASURES, task.measures.numpy().T, strict=True))
    body, people = task.rig.rows["truth"], task.follow.people.numpy()
    chest = people["pos_ned"] - np.array([0.0, 0.0, 1.0])
    distance = np.linalg.norm(chest - body["pos_ned"], axis=1)
    np.testing.assert_allclose(measures["distance_m"], distance, rtol=1e-5)
    assert (measures["is_in_band"] == ((distance >= 1.0) & (distance <= 3.0))).all()
    assert (np.abs(measures["bearing_rad"]) <= math.pi).all()


def test_training_validation_and_test_episodes_draw_from_disjoint_worlds_and_paths() -> None:
    for split, divisor, left in (("train", 4, 0), ("validation", 4, 2), ("test", 2, 1)):
        task = _task(6, split=split, **STATE)
        for seeds in (task.world_seeds, task.follow.path_seeds, task.noise_seeds):
            assert (seeds.numpy() % divisor == left).all()
            assert len(set(seeds.numpy().tolist())) == 6


def test_worlds_are_fresh_every_episode_unless_they_are_kept() -> None:
    everyone = np.ones(2, dtype=np.bool_)
    for terrain, is_fresh in (("fresh", True), ("kept", False)):
        task = _task(2, terrain=terrain, **STATE)
        before = task.world_seeds.numpy().copy()
        task.begin(everyone)
        assert (task.world_seeds.numpy() != before).all() == is_fresh


def test_presets_have_the_layouts_they_promise() -> None:
    documented = _task(1, preset="as-documented", **SMALL).layout
    assert (documented.observation_size, documented.branch_sizes) == (7, (2, 3, 3))
    assert documented.image_shape == (8, 8, 3)
    blind = _task(1, preset="vision-only", **SMALL).layout
    assert blind.image_shape == (8, 8, 4)
    assert not any("owner" in element.name for element in blind.frame)
    with pytest.raises(UnknownTask, match=r"FollowMe: preset: must be 'as-documented'|FollowMe: preset: must be"):
        task_settings("FollowMe", {"preset": "as-coded"})


@pytest.mark.filterwarnings("ignore:.*Box observation space m:UserWarning")  # bounds of floats are infinite here
@pytest.mark.parametrize("preset", ["as-documented", "improved", "vision-only"])
def test_gymnasium_accepts_the_environment(preset: str) -> None:
    check_env(
        gymnasium.make(
            "policies:honeyguide/FollowMe-v0", preset=preset, image_size=8, render_mode="rgb_array"
        ).unwrapped
    )


def test_picture_from_above_shows_the_camera_image() -> None:
    task = _task(1, **SMALL)
    assert task.top_view(0, 96).shape == (96, 96, 3)


def test_settings_default_to_what_flies() -> None:
    assert FollowSettings().has_estimator
    assert FollowSettings().preset == "improved"
