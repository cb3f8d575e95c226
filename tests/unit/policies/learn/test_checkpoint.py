"""Checkpoints: exact, whole or not there, and never a program."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
import torch

from policies.learn.checkpoint import checkpoint_path, checkpoints, load, prune, save
from policies.learn.export.policy_path import CheckpointError
from tests.small_files import files_of_at_most

CONTENT = {
    "steps": 7,
    "name": "a",
    "weights": torch.arange(6.0).reshape(2, 3),
    "generator": torch.Generator().manual_seed(3).get_state(),
    "task": {"steps": np.arange(4, dtype=np.int32), "pose": np.zeros(2, dtype=[("x", "<f4"), ("i", "<i4")])},
    "nested": [1.5, (True, None), np.float32(2.5)],
}


def test_what_was_saved_comes_back_exactly(tmp_path):
    save(tmp_path / "a.pt", CONTENT, "checkpoint")
    back = load(tmp_path / "a.pt", "checkpoint")
    assert torch.equal(back["weights"], CONTENT["weights"])
    assert torch.equal(back["generator"], CONTENT["generator"])
    for name, array in CONTENT["task"].items():
        assert back["task"][name].dtype == array.dtype
        np.testing.assert_array_equal(back["task"][name], array)
    assert back["nested"] == [1.5, (True, None), 2.5]
    assert (back["steps"], back["name"]) == (7, "a")


def test_same_content_gives_the_same_bytes(tmp_path):
    for name in ("a.pt", "b.pt"):
        save(tmp_path / name, CONTENT, "checkpoint")
    assert (tmp_path / "a.pt").read_bytes() == (tmp_path / "b.pt").read_bytes()


def test_a_view_is_stored_without_the_memory_it_looks_at(tmp_path):
    save(tmp_path / "a.pt", {"one": torch.zeros(1_000_000)[:1]}, "checkpoint")
    assert (tmp_path / "a.pt").stat().st_size < 10_000


@pytest.mark.parametrize("place", [0.1, 0.5, 0.9])
def test_damaged_file_is_refused_in_one_sentence(tmp_path, place):
    path = tmp_path / "a.pt"
    save(path, {"weights": torch.arange(10_000.0)}, "checkpoint")
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match=r"a\.pt: not a checkpoint of honeyguide, or damaged"):
        load(path, "checkpoint")


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04"])
def test_foreign_bytes_are_refused(tmp_path, content):
    path = tmp_path / "a.pt"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match="not a checkpoint"):
        load(path, "checkpoint")


def test_half_a_file_is_refused(tmp_path):
    path = tmp_path / "a.pt"
    save(path, CONTENT, "checkpoint")
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(CheckpointError, match="not a checkpoint"):
        load(path, "checkpoint")


def test_torch_files_of_others_are_refused(tmp_path):
    torch.save({"Policy": {"w": torch.zeros(3)}}, tmp_path / "a.pt")
    with pytest.raises(CheckpointError, match="not a policy"):
        load(tmp_path / "a.pt", "policy")


def test_other_kind_is_named(tmp_path):
    save(tmp_path / "a.pt", CONTENT, "checkpoint")
    with pytest.raises(CheckpointError, match="a checkpoint of honeyguide, not a policy"):
        load(tmp_path / "a.pt", "policy")


def test_missing_file_is_named(tmp_path):
    with pytest.raises(CheckpointError, match=r"none\.pt: cannot be read: No such file"):
        load(tmp_path / "none.pt", "policy")


class Program:
    """What a malicious file holds."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('ran')",))


def test_a_program_in_a_file_is_not_run(tmp_path):
    torch.save({"honeyguide": "policy", "content": Program()}, tmp_path / "a.pt", pickle_module=pickle)
    with pytest.raises(CheckpointError, match="not a policy"):
        load(tmp_path / "a.pt", "policy")


def test_full_disk_leaves_the_old_file_and_no_half(tmp_path):
    """The limit on a file's size stands for a full disk: the write fails after some bytes."""
    path = tmp_path / "a.pt"
    save(path, CONTENT, "checkpoint")
    before = path.read_bytes()
    with (
        files_of_at_most(100_000),
        pytest.raises(CheckpointError, match=r"a\.pt: cannot be written: File too large"),
    ):
        save(path, {"weights": torch.zeros(1_000_000)}, "checkpoint")
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["a.pt"]


def test_killed_writer_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.pt"
    save(path, {"number": -1}, "checkpoint")
    program = (
        "import sys, torch, pathlib; from policies.learn.checkpoint import save\n"
        "for k in range(1000000):\n"
        "    save(pathlib.Path(sys.argv[1]), {'number': k, 'weights': torch.full((300000,), k)}, 'checkpoint')\n"
        "    print(k, flush=True)\n"
    )
    writer = subprocess.Popen([sys.executable, "-c", program, str(path)], stdout=subprocess.PIPE)
    for _ in range(5):
        writer.stdout.readline()
    writer.kill()
    writer.communicate()
    content = load(path, "checkpoint")
    assert content["number"] >= 4
    assert bool((content["weights"] == content["number"]).all())


def test_the_newest_checkpoints_stay_with_what_was_exported_beside_them(tmp_path):
    for steps in (900, 1000, 20, 300):
        checkpoint_path(tmp_path, "A-1", steps).write_bytes(b"")
        (tmp_path / f"A-1-{steps}.onnx").write_bytes(b"")
    (tmp_path / "A-1-5.pt.part").write_bytes(b"")
    (tmp_path / "A-10.pt").write_bytes(b"")  # of another behaviour, A
    prune(tmp_path, "A-1", 2)
    assert [path.name for path in checkpoints(tmp_path, "A-1")] == ["A-1-900.pt", "A-1-1000.pt"]
    assert sorted(path.name for path in tmp_path.glob("*.onnx")) == ["A-1-1000.onnx", "A-1-900.onnx"]
    assert (tmp_path / "A-10.pt").exists()
