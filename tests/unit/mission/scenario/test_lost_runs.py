"""Runs whose process ends: what is kept of them, and what is left alone."""

import json

from mission.scenario.one_run import Planned, ScenarioRuns
from mission.scenario.scenario import Scenario

HOP = Scenario.model_validate({"name": "hop", "world": {"kind": "plain"}, "vehicle": {"script": ["arm"]}})


def lost(folder):
    return ScenarioRuns().lost(Planned(HOP, "hop.scenario.yaml", 1, folder), "its process died")


def test_a_run_that_was_lost_before_it_began_leaves_what_is_no_kept_run_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    flown = lost(tmp_path)
    assert "is there already, and is no kept run" in flown.note
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_lost_run_keeps_its_logs_and_not_those_of_an_earlier_one(tmp_path):
    for error, names in (("its process was ended", {"flight.ulg"}), ("", set())):
        folder = tmp_path / f"run{len(names)}"
        folder.mkdir()
        (folder / "flight.ulg").write_bytes(b"log")
        (folder / "result.json").write_text(json.dumps({"error": error}))
        flown = lost(folder)
        assert flown.command
        assert {path.name for path in folder.iterdir()} == {"result.json", "hop.scenario.yaml", *names}
        assert json.loads((folder / "result.json").read_text())["error"] == "its process died"
