"""Datasets collected in shards by processes and by Ray, some of which are killed: the same bytes as undisturbed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from common.clock import wall_sleep_s
from tests.documents import ROOT
from tests.ray_head import RayHead
from tests.system.datasets.killing import children

MOST_S = 240.0
pytestmark = pytest.mark.slow


def command(out, *more, episodes=240):
    """A collection as a user starts it."""
    program = "from mission.cli import main; main()"
    line = [sys.executable, "-c", program, "dataset", "collect", "Hover", "--policy", "expert", "--seed", "3"]
    return [*line, "--episodes", str(episodes), "--noise", "0.1", "-o", str(out), "--shards", "6", *more]


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def finished(out):
    return list(out.with_name(out.name + ".shards").glob("shard-*[0-9]"))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """What one process makes of it."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    subprocess.run(command(out, "--jobs", "1"), cwd=ROOT, check=True, capture_output=True, timeout=MOST_S)
    return content(out)


def test_a_killed_process_and_a_killed_collection_change_nothing(tmp_path, undisturbed):
    out = tmp_path / "out"
    process = subprocess.Popen(command(out, "--jobs", "2"), cwd=ROOT, stdout=subprocess.PIPE, text=True)
    while process.poll() is None and not finished(out):
        wall_sleep_s(0.02)
    workers = children(process.pid)
    os.kill(workers[0], signal.SIGKILL)
    before = len(finished(out))
    while process.poll() is None and len(finished(out)) == before:
        wall_sleep_s(0.02)
    workers = children(process.pid)
    process.kill()
    process.communicate(timeout=MOST_S)  # until the last that writes there has ended
    assert not out.exists()
    kept = {path: path.stat().st_mtime_ns for path in finished(out)}
    assert kept
    for _ in range(500):
        if not any(Path(f"/proc/{pid}").exists() for pid in workers):
            break
        wall_sleep_s(0.02)
    else:
        pytest.fail("processes outlive the collection")
    process = subprocess.Popen(command(out, "--jobs", "2"), cwd=ROOT, stdout=subprocess.PIPE, text=True)
    output, _ = process.communicate(timeout=MOST_S)
    assert process.returncode == 0, output
    assert "240 episodes" in output
    assert content(out) == undisturbed
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_ray_makes_the_same_dataset_when_a_worker_dies(tmp_path, undisturbed):
    pytest.importorskip("ray", reason="needs the extra 'ray'")
    head = RayHead(6398)
    try:
        out = tmp_path / "out"
        process = subprocess.Popen(command(out, "--ray", head.address), cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert head.kill_worker("_collect", process)
        output, _ = process.communicate(timeout=MOST_S)
        assert process.returncode == 0, output
        assert content(out) == undisturbed
    finally:
        head.end()
