"""The comparison with d3rlpy: its table, and that neither library is given other rows than the other."""

import h5py
import numpy as np
import pytest
from rich.console import Console

from bench.offline_d3rlpy import cases, page
from policies.datasets.exporting import export_d4rl
from policies.offline.store import open_store

ROW = {
    "case": "hover", "quality": "expert", "trainer": "iql", "steps": 5000, "hidden": 64, "episodes": 100,
    "decisions": 500, "d3rlpy_decisions": 495, "d3rlpy": "2.8.1", "score": 90.0, "d3rlpy_score": 80.0,
    "dataset_score": 95.0, "cpu_s": 10.0, "d3rlpy_cpu_s": 31.0, "references": [0.0, 1.0],
}  # fmt: skip


def test_the_section_takes_the_place_of_the_one_that_is_there(tmp_path, monkeypatch):
    target = tmp_path / "offline.md"
    target.write_text("# Title\n\n## First\n\ntext\n")
    monkeypatch.setattr(page, "PAGE", target)
    page.write_section([ROW])
    page.write_section([ROW, ROW | {"trainer": "td3_bc", "score": 70.0}])
    text = target.read_text()
    assert text.count(page.HEADING) == 1
    assert "## First\n\ntext" in text
    assert "| hover, expert | IQL | 95.0 | 90.0 | 80.0 | 3.1 |" in text
    assert "in 1 of 2 rows" in text
    assert max(map(len, text.splitlines())) < 125


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
