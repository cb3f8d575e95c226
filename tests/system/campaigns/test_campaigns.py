"""Campaigns as commands: killed and gone on with, runs that crash or hang, batches, Ray, the page's example."""

import json
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
import yaml
from typer.testing import CliRunner

from common.clock import wall_sleep_s
from mission.campaign.batch.fly_batch import fly_batch
from mission.campaign.campaign_file import read_campaign
from mission.campaign.sampling import sample_orders
from mission.campaign.workers.fly_run import fly_run
from mission.cli import app
from tests.documents import ROOT, blocks
from tests.ray_head import RayHead

GALE = ROOT / "mission" / "campaign" / "ready" / "gale-in-hold.campaign.yaml"
PAGE = ROOT / "docs" / "how-to" / "campaigns.md"
HOP = """name: hop
runs: 6
scenario:
  world: {kind: plain}
  vehicle:
    script: [arm, {takeoff: 3}, {hold: 5}, land]
  checks:
    - name: hold
      near: {point: [0, 0, -3], within_m: 3.2}
    - at_end: {is_armed: false, is_landed: true}
vary:
  wind.speed_m_s: {uniform: [0, 10]}
  wind.from_deg: {choice: [0, 90, 180]}
"""
BAD = """import os, signal
async def fly(drone, run):
    speed = run.scenario.wind.speed_m_s
    if speed == 1.0:
        os.kill(os.getpid(), signal.SIGSEGV)
    while speed == 2.0:
        pass
"""
MOST_S = 600.0  # a guard, on a busy machine


def campaign(*arguments):
    return CliRunner().invoke(app, ["campaign", *map(str, arguments)])


def runs_in(folder):
    return [json.loads(line) for line in (folder / "runs.jsonl").read_text().splitlines()]


def command(file, folder):
    program = "from mission.cli import main; main()"
    return [sys.executable, "-c", program, "campaign", str(file), "--folder", str(folder)]


def test_a_campaign_killed_on_the_way_goes_on_and_flies_nothing_twice(tmp_path):
    file, folder = tmp_path / "hop.campaign.yaml", tmp_path / "out"
    file.write_text(HOP)
    line = command(file, folder)
    process = subprocess.Popen([*line, "--jobs", "2"], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while process.poll() is None and not ((folder / "runs.jsonl").exists() and len(runs_in(folder)) >= 2):
            wall_sleep_s(0.05)
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait(MOST_S)
    before = (folder / "runs.jsonl").read_bytes()
    with (folder / "runs.jsonl").open("ab") as stream:  # as if it had been killed while it wrote
        stream.write(b'{"phase": "sample", "num')
    result = campaign(file, "--folder", folder, "--jobs", 1, "--resume")
    assert result.exit_code == 0, result.output
    assert "runs are there already" in result.output
    assert (folder / "runs.jsonl").read_bytes().startswith(before)
    found = runs_in(folder)
    assert sorted(run["number"] for run in found) == list(range(6))
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["success"]["total"] == 6
    assert summary["lost_runs"] == 0

    worst = summary["worst"][0]  # and its command flies the same flight again
    again = CliRunner().invoke(
        app, ["test", *worst["command"].split()[2:], "--jobs", "1", "--keep", str(tmp_path / "kept")]
    )
    assert again.exit_code == (0 if worst["passed"] else 1), again.output
    assert f"{worst['margins']['hold']:.3g} m" in again.output
    own = folder / "worst" / f"{worst['phase']}-{worst['number']}"  # its logs are of that flight, too
    kept = {check["name"]: check["margin"] for check in json.loads((own / "result.json").read_text())["checks"]}
    assert kept["hold"] == worst["margins"]["hold"]
    times = [path.stat().st_mtime_ns for path in folder.glob("worst/*/flight.ulg")]
    assert len(times) == 6
    (own / "result.json").unlink()  # as if it had been killed before the last was written
    assert campaign(file, "--folder", folder, "--jobs", 1).exit_code == 0
    assert (own / "result.json").is_file()
    assert len(set(times) - {path.stat().st_mtime_ns for path in folder.glob("worst/*/flight.ulg")}) == 1

    page = (folder / "report.html").read_text()
    assert page.count("<svg") >= 3
    assert "http" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )


def test_a_run_that_crashes_or_hangs_is_a_finding(tmp_path):
    (tmp_path / "bad.py").write_text(BAD)
    given = yaml.safe_load(HOP)
    given["scenario"]["vehicle"] = {"python": str(tmp_path / "bad.py:fly")}
    given["scenario"]["checks"] = [{"altitude": {"max": 3}}]
    given["vary"] = {"wind.speed_m_s": {"choice": [0.0, 1.0, 2.0]}}
    given["seed"], given["runs"], given["require"] = 3, 5, "success >= 1"
    file = tmp_path / "bad.campaign.yaml"
    file.write_text(yaml.safe_dump(given))
    result = campaign(file, "--folder", tmp_path / "out", "--jobs", 2, "--run-max", 20)
    assert result.exit_code == 1, result.output
    errors = {run["values"]["wind.speed_m_s"]: run["error"] for run in runs_in(tmp_path / "out")}
    assert errors == {
        0.0: "",
        1.0: "its process died (signal 11, Segmentation fault)",
        2.0: "hung: its process was ended after 20 s",
    }
    assert "not met" in result.output
    with_logs = {path.parent.name for path in (tmp_path / "out").glob("worst/*/flight.ulg")}
    assert with_logs == {f"sample-{run['number']}" for run in runs_in(tmp_path / "out") if not run["is_lost"]}


def test_wrong_input_is_2(tmp_path):
    file = tmp_path / "hop.campaign.yaml"
    file.write_text(HOP.replace("takeoff: 3", "takeoff: -3"))
    result = campaign(file)
    assert result.exit_code == 2
    assert "hop.campaign.yaml:6: vehicle.script[1]" in result.output
    file.write_text(HOP)
    assert campaign(file, "--resume", "--folder", tmp_path / "none").exit_code == 2
    file.write_text(HOP.replace("{hold: 5}", "{velocity: {ned_m_s: [1, 0, 0], for_s: 2}}"))
    result = campaign(file, "--batch", "--folder", tmp_path / "none")
    assert result.exit_code == 2
    assert "--batch: step velocity needs MAVLink; fly it without --batch" in result.output.replace("\n", " ")


def test_a_batch_judges_as_processes_do():
    """Verdicts are the same; margins nearly: without MAVLink an order comes some frames earlier, in another gust."""
    read = read_campaign(GALE)
    orders = sample_orders(read, 12)
    batch, alone = fly_batch(read, orders), [fly_run(read, order) for order in orders]
    assert [record.passed for record in alone].count(False) == 3
    for ours, theirs in zip(batch, alone, strict=True):
        assert ours.error == theirs.error == ""
        assert ours.verdicts == theirs.verdicts
        assert ours.margins["hold"] == pytest.approx(theirs.margins["hold"], abs=0.2)
        assert abs(ours.simulated_s - theirs.simulated_s) < 1.0


def test_a_row_of_a_batch_does_not_depend_on_the_others(tmp_path):
    file = tmp_path / "hop.campaign.yaml"
    file.write_text(HOP)
    read = read_campaign(file)
    orders = sample_orders(read, 4)
    together, alone = fly_batch(read, orders), fly_batch(read, orders[2:3])
    assert together[2].margins == alone[0].margins


def test_the_example_of_the_page_flies(tmp_path):
    (text,) = [block for block in blocks(PAGE, "yaml") if block.startswith("# landing")]
    file = tmp_path / "landing.campaign.yaml"
    file.write_text(text)
    given = read_campaign(file)
    assert given.runs == 1000
    result = campaign(file, "--runs", 8, "--batch", "--folder", tmp_path / "out")
    assert result.exit_code in (0, 1), result.output
    runs = runs_in(tmp_path / "out")
    assert len(runs) > 8
    assert {run["check"] for run in runs} == {"place: place"}
    assert not any(run["margin"] is None or "never happened" in run["error"] for run in runs)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "campaign.json", "runs.jsonl", "summary.json", "report.html", "overview.png", "worst",
    }  # fmt: skip
    worst = json.loads((tmp_path / "out" / "summary.json").read_text())["worst"]
    names = {f"{each['phase']}-{each['number']}" for each in worst}
    reviewed = CliRunner().invoke(app, ["review", str(tmp_path / "out")])
    assert reviewed.exit_code == 0, reviewed.output
    index = (tmp_path / "out" / "review.html").read_text()
    assert set(re.findall(r'href="worst/([\w-]+)/review.html"', index)) == names
    assert len(names) == 10


def test_the_fault_of_the_example_comes_before_its_shortest_flight_ends(tmp_path):
    (text,) = [block for block in blocks(PAGE, "yaml") if block.startswith("# landing")]
    file = tmp_path / "landing.campaign.yaml"
    file.write_text(text)
    given = read_campaign(file)
    quick = {
        "wind.speed_m_s": 0.0,
        "faults.0.at": given.vary["faults.0.at"].values[1],
        "vehicle.parameters.MPC_XY_P": 2.0,
    }
    record = fly_run(given, replace(sample_orders(given, 1)[0], values=quick))
    assert "never happened" not in record.error


@pytest.mark.slow
def test_ray_loses_no_run_when_a_worker_dies_and_says_when_its_head_does(tmp_path):
    pytest.importorskip("ray", reason="needs the extra 'ray'")
    file, folder = tmp_path / "hop.campaign.yaml", tmp_path / "out"
    file.write_text(HOP)
    line = command(file, folder)
    head = RayHead(6399)
    try:
        process = subprocess.Popen([*line, "--ray", head.address], cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert head.kill_worker("_fly", process)
        output, _ = process.communicate(timeout=MOST_S)
        assert process.returncode == 0, output
        found = runs_in(folder)
        assert sorted(run["number"] for run in found) == list(range(6))
        assert not any(run["is_lost"] for run in found)

        process = subprocess.Popen(
            [*line, "--ray", head.address, "--runs", "500"], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        while process.poll() is None and len(runs_in(folder)) < 8:
            wall_sleep_s(0.05)
    finally:
        head.end()
    output, _ = process.communicate(timeout=MOST_S)
    assert process.returncode == 1
    assert "the Ray head at 127.0.0.1:6399 is gone" in output
    assert len(runs_in(folder)) >= 8
