"""LeRobot's format 2.1 as its own reader asks for it, by pyarrow: files, features, columns, statistics."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from policies.datasets.episodes import DatasetOrigin, EpisodeRows
from policies.datasets.exporting_lerobot import export_lerobot
from policies.datasets.writer import DatasetWriter
from policies.tasks.layout import Branch, Element, ImageElement, Layout

pyarrow = pytest.importorskip("pyarrow", reason="the extra lerobot")

FRAME = (Element("a", "m"), Element("b", "1"))
FLOWN = Layout("Hover", 1, FRAME, (Element("up", "1"), Element("turn", "1")))
CHOSEN = Layout("RollerBall", 1, (Element("a", "m"),), branches=(Branch("push", ("left", "right")),))
SEEN = Layout("FollowMe", 1, FRAME, FLOWN.continuous, image=ImageElement(6, 9, ("red", "green", "blue", "depth")))
OWN = ["timestamp", "frame_index", "episode_index", "index", "task_index"]  # that every dataset of LeRobot's has


def episode(layout, steps, seed):
    rng = np.random.default_rng(seed)
    actions = rng.integers(2, size=steps) if layout.branches else rng.uniform(-1.0, 1.0, (steps, 2)).astype(np.float32)
    seen = rng.normal(size=(steps + 1, layout.observation_size)).astype(np.float32)
    rewards = rng.normal(size=steps)
    images = rng.integers(256, size=(steps + 1, *layout.image_shape), dtype=np.uint8) if layout.image else None
    return EpisodeRows(seen, actions, rewards, is_terminated=True, outcome="success", images=images)


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


def test_images_are_pngs_of_the_bytes_that_were_seen(tmp_path):
    from pyarrow import parquet

    root = exported(tmp_path, SEEN)
    for k in range(3):
        table = parquet.read_table(root / "data" / "chunk-000" / f"episode_{k:06d}.parquet")
        expected = episode(SEEN, 4 + k, k).images[:-1]
        for name, channels in (("front", [0, 1, 2]), ("depth", [3, 3, 3])):
            files = table[f"observation.images.{name}"].to_pylist()
            assert [file["path"] for file in files] == [f"frame_{row:06d}.png" for row in range(4 + k)]
            found = [cv2.imdecode(np.frombuffer(file["bytes"], np.uint8), cv2.IMREAD_UNCHANGED) for file in files]
            assert np.array_equal(np.stack(found)[..., ::-1], expected[..., channels])  # of OpenCV's blue, green, red


def test_info_schema_and_statistics_of_images_are_as_lerobot_has_them(tmp_path):
    from pyarrow import parquet

    root = exported(tmp_path, SEEN)
    features = json.loads((root / "meta" / "info.json").read_text())["features"]
    schema = parquet.read_schema(root / "data" / "chunk-000" / "episode_000001.parquet")
    noted = json.loads(schema.metadata[b"huggingface"])["info"]["features"]
    assert set(noted) == set(features) == set(schema.names)
    images = {name: feature for name, feature in features.items() if feature["dtype"] == "image"}
    assert set(images) == {"observation.images.front", "observation.images.depth"}
    for name, feature in images.items():
        assert (feature["shape"], feature["names"]) == ([6, 9, 3], ["height", "width", "channels"])
        assert noted[name] == {"_type": "Image"}
        assert schema.field(name).type == pyarrow.struct({"bytes": pyarrow.binary(), "path": pyarrow.string()})
    assert noted["observation.state"] == {
        "feature": {"dtype": "float32", "_type": "Value"}, "length": 2, "_type": "Sequence"
    }  # fmt: skip
    found = lines(root / "meta" / "episodes_stats.jsonl")[1]["stats"]["observation.images.front"]
    colours = episode(SEEN, 5, 1).images[:-1, ..., :3] / 255.0
    assert found.pop("count") == [5]
    for key, value in found.items():
        np.testing.assert_allclose(value, getattr(colours, key)((0, 1, 2)).reshape(3, 1, 1), rtol=1e-9)


@pytest.mark.parametrize(("channels", "names"), [(("nearness",), ["nearness"]), (("red", "green", "blue"), ["front"])])
def test_an_image_is_named_by_what_its_channels_are(tmp_path, channels, names):
    root = exported(tmp_path, replace(SEEN, image=ImageElement(6, 9, channels)))
    features = json.loads((root / "meta" / "info.json").read_text())["features"]
    assert [name.removeprefix("observation.images.") for name in features if "images" in name] == names
