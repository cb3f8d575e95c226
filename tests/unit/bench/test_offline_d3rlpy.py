"""The comparison with d3rlpy: its table, and that neither library is given other rows than the other."""

import json

import h5py
import numpy as np
import pytest
from rich.console import Console

from bench.offline_d3rlpy import alike, cases, page
from policies.datasets.exporting import export_d4rl
from policies.datasets.reader import DatasetReader
from policies.offline.store import open_store

ROW = {
    "case": "hover", "quality": "expert", "trainer": "iql", "steps": 5000, "hidden": 64, "episodes": 100,
    "decisions": 500, "d3rlpy_decisions": 495, "d3rlpy": "2.8.1", "scores": [90.0], "d3rlpy_scores": [80.0],
    "dataset_score": 95.0, "cpu_s": [10.0], "d3rlpy_cpu_s": [31.0], "references": [0.0, 1.0],
}  # fmt: skip


def test_the_section_takes_the_place_of_the_one_that_is_there(tmp_path, monkeypatch):
    target = tmp_path / "offline.md"
    target.write_text("# Title\n\n## First\n\ntext\n")
    monkeypatch.setattr(page, "PAGE", target)
    monkeypatch.setattr(page, "ALIKE", tmp_path / "alike.json")
    apart = {"steps": 200, "td3_bc policy": 2e-7, "iql critics": 1.1e-6, "iql policy": 0.0084}
    page.ALIKE.write_text(json.dumps(apart))
    page.write_section([ROW])
    worse = {"trainer": "td3_bc", "scores": [70.0, 72.0, 74.0], "d3rlpy_scores": [80.0, 80.0, 83.0]}
    within = {"trainer": "td3_bc", "quality": "replay", "scores": [70.0, 90.0], "d3rlpy_scores": [75.0, 90.0]}
    page.write_section([ROW, ROW | worse, ROW | within])
    text = target.read_text()
    assert text.count(page.HEADING) == 1
    assert "## First\n\ntext" in text
    assert "| hover, expert | IQL | 95.0 | 1 | 90.0 | 80.0 | +10.0 | 3.1 |" in text
    assert "| hover, expert | TD3+BC | 95.0 | 3 | 72.0 ± 2.0 | 81.0 ± 1.7 | -9.0 (-13.2 to -4.8) | 3.1 |" in text
    words = " ".join(text.split())
    assert "in 1 of 3 rows: 1 of 1 with IQL and 0 of 2 with TD3+BC. By the 95 % interval" in words
    assert "1 of the others are within noise, 1 of the others are below it, 0 of all are above it. Over all" in words
    assert " 1 rows are of one seed" in words
    assert "by at most 1e-06 of the way that they have gone" in words
    assert "IQL's policy by 0.008:" in words
    assert max(map(len, text.splitlines())) < 125


def test_the_interval_of_a_difference_is_students():
    apart, low, high = page.difference({"scores": [1.0, 3.0], "d3rlpy_scores": [0.0, 2.0]})
    assert apart == 1.0
    assert low == pytest.approx(1.0 - 4.303 * 2.0**0.5)  # both have a variance of 2, of 2 seeds each
    assert high == pytest.approx(1.0 + 4.303 * 2.0**0.5)
    assert page.difference({"scores": [1.0], "d3rlpy_scores": [0.0]}) == (1.0, float("-inf"), float("inf"))


@pytest.mark.parametrize(("trainer", "networks"), [("td3_bc", ("critics",)), ("iql", ("critics", "value"))])
def test_steps_begin_with_the_others_weights(monkeypatch, trainer, networks):
    rng, sizes = np.random.default_rng(1), {"policy": (alike.SEEN, alike.DONE), "value": (alike.SEEN, 1)}
    theirs = {}
    for network in ("policy", *networks):
        seen, made = sizes.get(network, (alike.SEEN + alike.DONE, 1))
        shapes = [(64, seen), (64,), (64, 64), (64,), (made, 64), (made,)] * (2 if network == "critics" else 1)
        for k, shape in enumerate(shapes):
            theirs[f"start {network} {k:02d}"] = rng.standard_normal(shape).astype(np.float32)
            theirs[f"end {network} {k:02d}"] = theirs[f"start {network} {k:02d}"] + np.float32(0.5)
    monkeypatch.setattr(alike, "STEPS", 0)
    assert alike._apart(trainer, theirs) == {"policy": 1.0} | dict.fromkeys(networks, 1.0)  # not a step of that way


def test_a_dataset_is_paid_by_the_numbers_of_its_case(tmp_path):
    returns = []
    for cost in (0.0, 10.0):
        folder = tmp_path / f"{cost:g}"
        folder.mkdir()
        case = cases.Case("Hover", "random", ("has_estimator=false",), 4, {"rate_cost": cost})
        dataset = cases.collected(case, "best", folder, Console(quiet=True))
        returns.append(open_store([str(dataset)]).episode_returns())
        with DatasetReader(dataset) as reader:
            assert reader.origin.notes == {"number rate_cost": f"{cost:g}"}
    assert (returns[0] > returns[1]).all()


@pytest.mark.parametrize("quality", ["medium", "replay"])
def test_both_are_given_the_same_decisions(tmp_path, quality):
    case = cases.Case("RollerBall", "expert", (), 10)
    dataset = cases.collected(case, quality, tmp_path, Console(quiet=True))
    assert cases.collected(case, quality, tmp_path, Console(quiet=True)) == dataset  # is not made again
    export_d4rl(dataset, tmp_path / "flat.hdf5")
    store = open_store([str(dataset)])
    assert store.episode_count == case.episodes
    with h5py.File(tmp_path / "flat.hdf5") as file:
        batch = store.take(store.decisions)
        assert np.array_equal(file["observations"][()], batch.observations.numpy())
        assert np.array_equal(file["next_observations"][()], batch.next_observations.numpy())
        assert np.array_equal(file["rewards"][()], batch.rewards.numpy())
        assert np.array_equal(file["terminals"][()], batch.is_terminated.numpy() > 0.0)
