"""LeRobot's format 2.1 as its own reader asks for it, by pyarrow: files, features, columns, statistics."""

import json

import numpy as np
import pytest

from policies.datasets.episodes import DatasetOrigin, EpisodeRows
from policies.datasets.exporting import export_lerobot
from policies.datasets.writer import DatasetWriter
from policies.tasks.layout import Branch, Element, Layout

pyarrow = pytest.importorskip("pyarrow", reason="the extra lerobot")

FRAME = (Element("a", "m"), Element("b", "1"))
FLOWN = Layout("Hover", 1, FRAME, (Element("up", "1"), Element("turn", "1")))
CHOSEN = Layout("RollerBall", 1, (Element("a", "m"),), branches=(Branch("push", ("left", "right")),))
OWN = ["timestamp", "frame_index", "episode_index", "index", "task_index"]  # that every dataset of LeRobot's has


def episode(layout, steps, seed):
    rng = np.random.default_rng(seed)
    actions = rng.integers(2, size=steps) if layout.branches else rng.uniform(-1.0, 1.0, (steps, 2)).astype(np.float32)
    seen = rng.normal(size=(steps + 1, layout.observation_size)).astype(np.float32)
    return EpisodeRows(seen, actions, rng.normal(size=steps), is_terminated=True, outcome="success")


def exported(folder, layout):
    with DatasetWriter(folder / "set", DatasetOrigin(layout, {}, "test")) as writer:
        writer.add_all(episode(layout, 4 + k, k) for k in range(3))
    assert export_lerobot(folder / "set", folder / "lerobot") == 15
    return folder / "lerobot"


def lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_files_are_where_info_says_and_hold_the_features_that_it_names(tmp_path):
    from pyarrow import parquet

    root = exported(tmp_path, FLOWN)
    info = json.loads((root / "meta" / "info.json").read_text())
    assert (info["codebase_version"], info["total_episodes"], info["total_frames"]) == ("v2.1", 3, 15)
    assert set(OWN) < set(info["features"])
    row = 0
    for k in range(info["total_episodes"]):
        path = root / info["data_path"].format(episode_chunk=k // info["chunks_size"], episode_index=k)
        table = parquet.read_table(path)
        assert set(table.column_names) == set(info["features"])
        for name, feature in info["features"].items():
            (size,), kind = feature["shape"], getattr(pyarrow, feature["dtype"].replace("bool", "bool_"))()
            expected = kind if size == 1 else pyarrow.list_(kind, size)
            assert table.schema.field(name).type == expected, name
        expected = episode(FLOWN, 4 + k, k)
        assert np.array_equal(np.stack(table["observation.state"].to_numpy()), expected.observations[:-1])
        assert np.array_equal(np.stack(table["action"].to_numpy()), expected.actions)
        assert table["index"].to_pylist() == list(range(row, row + len(expected)))
        steps_s = np.diff(table["timestamp"].to_numpy())
        assert np.allclose(steps_s, 1.0 / info["fps"], atol=1e-4)  # as LeRobot checks
        row += len(expected)


def test_every_episode_has_its_line_of_lengths_and_of_statistics(tmp_path):
    root = exported(tmp_path, FLOWN)
    features = json.loads((root / "meta" / "info.json").read_text())["features"]
    assert [line["length"] for line in lines(root / "meta" / "episodes.jsonl")] == [4, 5, 6]
    assert lines(root / "meta" / "tasks.jsonl") == [{"task_index": 0, "task": "Hover"}]
    for k, line in enumerate(lines(root / "meta" / "episodes_stats.jsonl")):
        assert line["episode_index"] == k
        assert set(line["stats"]) == set(features)
        for name, found in line["stats"].items():
            assert found["count"] == [4 + k]
            assert all(np.shape(found[key]) == tuple(features[name]["shape"]) for key in ("min", "max", "mean", "std"))
        seen = episode(FLOWN, 4 + k, k).observations[:-1]
        assert np.allclose(line["stats"]["observation.state"]["std"], seen.std(axis=0), atol=1e-6)


def test_what_has_one_element_is_a_number_and_no_list(tmp_path):
    from pyarrow import parquet

    table = parquet.read_table(exported(tmp_path, CHOSEN) / "data" / "chunk-000" / "episode_000001.parquet")
    for name in ("observation.state", "action"):
        assert table.schema.field(name).type == pyarrow.float32()
    assert table["action"].to_pylist() == episode(CHOSEN, 5, 1).actions.tolist()
