"""The leaderboard: like flights alone are entered, ranked by a stated rule, and the page is what the rows give."""

import json
import re
from dataclasses import replace
from itertools import cycle

import pytest
from typer.testing import CliRunner

from bench.follow.leaderboard import BEGIN, END, PAGE, app, with_entries
from bench.follow.leaderboard_rows import (
    CONDITIONS,
    SEEDS,
    EntryError,
    entry_from,
    ranked,
    read_rows,
    score_interval,
    write_rows,
)
from mission.follow.benchmark.conditions import BY_NAME


def record(*in_band, has_guard=True, guard_settings=None, seeds=SEEDS, conditions=CONDITIONS):
    """flights.json of a policy that was so long in the band on each seed, again and again."""
    flown = [
        {
            "seed": seed, "in_band": value, "is_collided": value < 0.5, "is_somebody_hit": False, "nearest_m": 1.2,
            "interventions_per_min": 12.0, "trouble": "",
        }
        for seed, value in zip(seeds, cycle(in_band), strict=False)
    ]  # fmt: skip
    about = {"task": "follow", "policy": "p", "has_guard": has_guard, "guard_settings": guard_settings or {}}
    return about | {"flights": dict.fromkeys(conditions, flown)}


def entry(name, *in_band):
    return entry_from(record(*in_band), name, "all", "by hand")


def test_the_page_is_what_the_rows_give():
    page = PAGE.read_text(encoding="utf-8")
    assert with_entries(page, read_rows()) == page, "python -m bench.follow.leaderboard"


def test_the_shipped_policies_and_the_script_have_entries():
    assert {"follow-me-tracked", "scripted"} <= {row.policy for row in read_rows()}


def test_conditions_are_of_the_benchmark():
    assert set(CONDITIONS) <= set(BY_NAME)


def test_who_is_longer_in_the_band_is_ahead_and_then_who_touches_less():
    rows = [entry("b", 0.4, 0.4, 0.4, 1.0), entry("c", 0.9, 0.9, 0.9, 0.9), entry("a", 0.55, 0.55, 0.55, 0.55)]
    assert [row.name for row in ranked(rows)] == ["c", "a", "b"]


def test_two_are_compared_seed_by_seed():
    first, second = entry("a", 0.9, 0.6, 0.8, 0.7), entry("b", 0.8, 0.5, 0.7, 0.6)
    behind = score_interval(second, first)
    assert (behind.low, behind.value, behind.high) == pytest.approx((0.1, 0.1, 0.1))
    assert score_interval(first).low < score_interval(first).high


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"has_guard": False}, "under the guard"),
        ({"guard_settings": {"owner_m": 0.5}}, "under the guard as it ships"),
        ({"seeds": (1, 3, 5, 7)}, "walk: seeds (1, 3, 5, 7), wanted"),
        ({"conditions": CONDITIONS[1:]}, "no flights of walk"),
    ],
)
def test_other_flights_are_refused(changes, sentence):
    with pytest.raises(EntryError) as refused:
        entry_from(record(0.9, 0.9, 0.9, 0.9, **changes), "a", "all", "by hand")
    assert sentence in str(refused.value)


def test_rows_are_read_as_they_were_written(tmp_path):
    rows = [entry("a", 0.9, 0.9, 0.9, 0.9), entry("b", 0.8, 0.8, 0.8, 0.8)]
    write_rows(rows, tmp_path / "rows.jsonl")
    assert read_rows(tmp_path / "rows.jsonl") == rows


def test_a_collision_is_on_the_page():
    rows = [entry("a", 0.9, 0.9, 0.9, 0.9), replace(entry("b", 0.8, 0.8, 0.8, 0.4), made="in a day")]
    page = with_entries(BEGIN + END, rows)
    assert "| 1 | a | 90.0 % (90.0 to 90.0) | - | 100.0 % (" in page
    assert "| b | 2 (0) |" in page
    assert "in a day" in page


def test_a_folder_without_flights_is_refused_in_a_sentence(tmp_path):
    words = [str(tmp_path), "--name", "a", "--sees", "all", "--made", "by hand"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert "flights.json" in "".join(re.findall(r"[^\s│]", result.output))  # however it is wrapped
    (tmp_path / "flights.json").write_text(json.dumps(record(0.9, 0.9, 0.9, 0.9)), encoding="utf-8")
    assert CliRunner().invoke(app, words[:1]).exit_code == 2


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "{}", '{"task": "follow", "has_guard": true, "flights": {"walk": [{}]}}']
)
def test_flights_that_the_benchmark_did_not_write_are_refused_in_a_sentence(tmp_path, text):
    (tmp_path / "flights.json").write_text(text, encoding="utf-8")
    result = CliRunner().invoke(app, [str(tmp_path), "--name", "a", "--sees", "all", "--made", "by hand"])
    assert result.exit_code == 2
    assert "flights.json" in "".join(re.findall(r"[^\s│]", result.output))


def test_a_name_that_is_two_cells_is_refused(tmp_path):
    (tmp_path / "flights.json").write_text(json.dumps(record(0.9, 0.9, 0.9, 0.9)), encoding="utf-8")
    result = CliRunner().invoke(app, [str(tmp_path), "--name", "a | b", "--sees", "all", "--made", "by hand"])
    assert result.exit_code == 2
