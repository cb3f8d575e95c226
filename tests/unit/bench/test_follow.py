"""The reproduction of following: order of stages, results kept whole, and a page that says what they say."""

import inspect
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.cars.page import DOCS
from bench.cars.result import Point
from bench.follow.__main__ import RUNS, _jobs, _take, main, published, results, unpublished
from bench.follow.choice import best_first
from bench.follow.page import duration, write_page
from bench.follow.result import Judged, Result, read, read_all, write, write_all
from bench.follow.run import policy_path, result_path
from bench.follow.stages import CELLS, OWNER_SPEEDS, STAGES, in_order
from common.intervals import Interval
from policies.learn.checkpoint import load, save
from policies.learn.config.recipes import recipe
from policies.learn.export.policy_file import POLICY, load_policy, save_policy
from policies.learn.export.provenance import weights_sha256
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.track import Track


def track(distance, count=600):
    column = np.full(count, distance)
    seen = np.ones(count, dtype=np.bool_)
    return Track(np.arange(1, count + 1) * 0.1, column, np.zeros(count), seen, ~seen, 60.0)


def result(stage="student", *, is_flown=False):
    near, far = scorecard([track(2.0), track(2.2)]), scorecard([track(2.0), track(3.5)])
    judged = [Judged(False, cell.trees_per_ha, cell.owner_speed_max, 12.5, far) for cell in CELLS]
    judged += [Judged(False, None, speed, None, far) for speed in OWNER_SPEEDS]
    if is_flown:
        judged += [Judged(True, trees, 2.0, None, near) for trees in (None, 100.0)]
    curve = [Point(1000 * k, 2.0 * k, 0.1 * k, float(k)) for k in range(8)]
    return Result(stage, 1, 600_000, 900.0, 1, "a machine", 400_000, curve, judged)


def test_every_stage_has_a_recipe_and_comes_after_what_it_needs():
    order = in_order(list(STAGES))
    for k, stage in enumerate(order):
        assert recipe(stage.recipe).is_file()
        assert {*stage.before} <= {earlier.name for earlier in order[:k]}


def test_a_stage_brings_those_it_needs():
    assert [stage.name for stage in in_order(["vision-only"])] == ["teacher", "vision-only"]


def test_results_are_read_as_they_were_written(tmp_path):
    path = tmp_path / "student-1.json"
    write(path, result(is_flown=True))
    again = read(path)
    before, after = (which.cards(is_flown=True)[None, 2.0].card for which in (result(is_flown=True), again))
    assert after.success.low == pytest.approx(before.success.low)
    assert after.distance_rmse_m.value == pytest.approx(before.distance_rmse_m.value)
    assert math.isnan(after.loss_s.value)
    assert "NaN" not in path.read_text(encoding="utf-8")
    write_all(tmp_path / "all.jsonl", [again, result("teacher")])
    assert [kept.stage for kept in read_all(tmp_path / "all.jsonl")] == ["student", "teacher"]


def test_page_tells_what_was_measured_and_what_was_not(tmp_path):
    text = write_page({"student": [result(is_flown=True)]}, tmp_path).read_text(encoding="utf-8")
    assert STAGES["document"].title + " | " + STAGES["document"].document + " | not run" in text
    assert "| batch | 2 m/s | 98 % in band | 50.0 % (" in text
    assert "| flown | 2 m/s | 98 % in band | 100.0 % (100.0 to 100.0) |" in text
    assert "| Improved: camera and phone, DAgger | 0.60 M | 1 | 15.0 min |" in text
    assert {path.name for path in (tmp_path / "images").iterdir()} == {"follow-reward.png", "follow-student.png"}
    assert all(path.stat().st_size < 300_000 for path in (tmp_path / "images").iterdir())


def test_page_without_any_result_is_still_a_page(tmp_path):
    assert "none yet" in write_page({}, tmp_path).read_text(encoding="utf-8")


def shipped(name):
    return pretrained(name).read_bytes()


def second(paths):
    return paths[min(1, len(paths) - 1)], Interval(0.8, 0.7, 0.9)


def test_policies_that_ship_stay_unless_new_ones_are_published(tmp_path):
    results, ships = tmp_path / "results", tmp_path / "pretrained"
    results.mkdir()
    ships.mkdir()
    old, new, same = (shipped(name) for name in ("navigate", "follow-me-tracked", "follow-me-teacher"))
    (ships / "follow-me-tracked.pt").write_bytes(old)
    (ships / "follow-me-teacher.pt").write_bytes(same)
    made = {"tracked-wide": new, "teacher": same, "tuned": old}
    for name, content in made.items():
        for seed in (1, 2, 3):
            (results / f"{name}-{seed}.pt").write_bytes(content)
    (line,) = unpublished(results, ships)
    assert line.endswith(f"{results / 'tracked-wide-3.pt'}: not follow-me-tracked.pt, which still ships: --publish")
    assert (ships / "follow-me-tracked.pt").read_bytes() == old
    lines = published(results, ships, second)
    assert f"follow-me-tracked.pt: ships now what lies in {results / 'tracked-wide-2.pt'}" in lines
    assert {path.name for path in ships.iterdir()} == {"follow-me-tracked.pt", "follow-me-teacher.pt"}
    assert not unpublished(results, ships)


def test_nothing_is_published_of_fewer_than_three_seeds(tmp_path):
    ships = tmp_path / "pretrained"
    ships.mkdir()
    for seed in (1, 2):
        (tmp_path / f"tracked-wide-{seed}.pt").write_bytes(shipped("follow-me-tracked"))
        (tmp_path / f"teacher-{seed}.pt").write_bytes(shipped("follow-me-teacher"))
    (ships / "follow-me-tracked.pt").write_bytes(shipped("navigate"))
    (line,) = published(tmp_path, ships, second)
    assert line == "follow-me-tracked.pt: stays: of tracked-wide 2 of the 3 seeds are trained"
    assert [path.name for path in ships.iterdir()] == ["follow-me-tracked.pt"]
    assert (ships / "follow-me-tracked.pt").read_bytes() == shipped("navigate")
    assert inspect.signature(main).parameters["seeds"].default == 3


def test_of_the_seeds_the_chosen_is_published_whichever_shipped_and_says_what_it_was_chosen_by(tmp_path):
    ships = tmp_path / "pretrained"
    ships.mkdir()
    (tmp_path / "tracked-wide-1.pt").write_bytes(shipped("navigate"))
    (tmp_path / "tracked-wide-2.pt").write_bytes(shipped("follow-me-tracked"))
    (tmp_path / "tracked-wide-3.pt").write_bytes(shipped("navigate"))
    (tmp_path / "late-1.pt").write_bytes(shipped("follow-me-teacher"))  # of a stage that does not ship
    (ships / "follow-me-tracked.pt").write_bytes(shipped("navigate"))
    asked = []

    def choose(paths):
        asked.append([path.name for path in paths])
        return second(paths)

    assert len(published(tmp_path, ships, choose)) == 1
    assert asked == [["tracked-wide-1.pt", "tracked-wide-2.pt", "tracked-wide-3.pt"]]
    _, card = load_policy(ships / "follow-me-tracked.pt")
    assert (card.figures["band_low"], card.figures["band_high"]) == (0.7, 0.9)
    assert not unpublished(tmp_path, ships)  # the card differs, the policy does not


def test_the_teacher_that_ships_is_that_of_the_seed_that_ships(tmp_path):
    ships = tmp_path / "pretrained"
    ships.mkdir()
    for seed, teacher in ((1, "navigate"), (2, "follow-me-teacher"), (3, "navigate")):
        (tmp_path / f"tracked-wide-{seed}.pt").write_bytes(shipped("follow-me-tracked"))  # whose seed is 2
        (tmp_path / f"teacher-{seed}.pt").write_bytes(shipped(teacher))
    assert load_policy(pretrained("follow-me-tracked"))[1].seed == 2
    assert len(published(tmp_path, ships, second)) == 2
    hashes = (
        weights_sha256(load_policy(path)[0]) for path in (ships / "follow-me-teacher.pt", tmp_path / "teacher-2.pt")
    )
    assert len({*hashes}) == 1


def test_the_teacher_that_ships_is_named_as_it_ships_and_not_by_where_it_was_trained(tmp_path):
    ships = tmp_path / "pretrained"
    ships.mkdir()
    teacher = tmp_path / "teacher-2.pt"
    teacher.write_bytes(shipped("follow-me-teacher"))
    content = load(pretrained("follow-me-tracked"), POLICY)
    content["card"]["parents"][0]["teacher"]["policy"] = str(teacher)
    for seed in (1, 2, 3):
        save(tmp_path / f"tracked-wide-{seed}.pt", content, POLICY)
    published(tmp_path, ships, second)
    first, *others = load_policy(ships / "follow-me-tracked.pt")[1].parents
    assert first["teacher"]["policy"] == "follow-me-teacher"
    assert [leg["teacher"] for leg in others] == [{}] * len(others)
    assert published(tmp_path, ships, second) == []


@pytest.mark.parametrize(("seconds", "text"), [(90.0, "90 s"), (900.0, "15.0 min"), (7200.0, "2.0 h")])
def test_durations_are_as_people_say_them(seconds, text):
    assert duration(seconds) == text


def test_the_best_is_whose_interval_begins_highest_and_of_equals_the_first():
    found = {Path(name): Interval(value, low, 1.0) for name, value, low in (("a", 0.9, 0.7), ("b", 0.8, 0.8))}
    found |= {Path("c"): Interval(0.95, 0.8, 1.0)}
    assert best_first(found) == [Path("b"), Path("c"), Path("a")]


def test_what_the_shipped_page_was_made_of_leaves_every_other_stage_able_to_begin(tmp_path, monkeypatch):
    """With its results taken as done, a stage whose policy does not ship any more is trained where others need it."""
    ships = tmp_path / "ships"
    ships.mkdir()
    policy, card = load_policy(pretrained("follow-me-teacher"))
    save_policy(ships / "follow-me-teacher.pt", policy, replace(card, seed=1))  # of a seed that is recorded
    monkeypatch.setattr("bench.follow.__main__.RESULTS", tmp_path)
    monkeypatch.setattr("bench.follow.__main__.PRETRAINED", ships)
    for each in read_all(RUNS):
        _take(each, tmp_path)
    left = _jobs(list(STAGES), 1)
    assert {name for name, found in results(read_all(RUNS)).items() if found} == {each.stage for each in read_all(RUNS)}
    assert "teacher-1" not in {job.name for job in left}
    assert "student-1" in {job.name for job in left}
    for job in left:  # in order, each leaves its result and its policy
        assert job.is_ready(), job.name
        stage = job.name.removesuffix("-1").removesuffix("-1-flown")
        write(result_path(tmp_path, stage, 1), result(stage))
        policy_path(tmp_path, stage, 1).write_bytes(b"")


def test_the_page_is_what_its_results_give(tmp_path):
    results = {name: [each for each in read_all(RUNS) if each.stage == name] for name in STAGES}
    assert write_page(results, tmp_path).read_text() == (DOCS / "follow.md").read_text()
