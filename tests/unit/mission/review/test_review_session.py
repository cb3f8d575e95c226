"""`honeyguide review`: which files it writes, of one log, two, and a folder of runs, and what it refuses."""

import json
import re
import shutil
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.flight import Flight, FlightConfig
from mission.review.check_margins import checks_of
from mission.view.replay_file import keep_for_replay
from sim.world.world import WorldConfig
from tests.unit.mission.review.px4_logs import write


def review(*arguments):
    return CliRunner().invoke(app, ["review", *(str(each) for each in arguments)])


def data_of(page):
    text = re.search(r'<script id="data" type="application/json">(.*?)</script>', page.read_text(), re.DOTALL)[1]
    return json.loads(text.replace("<\\/", "</"))


@pytest.fixture(scope="module")
def px4_log(tmp_path_factory):
    return write(tmp_path_factory.mktemp("px4") / "circle.ulg")


def run(folder, log, **checks):
    folder.mkdir(parents=True)
    shutil.copy(log, folder / "flight.ulg")
    listed = [{"name": name, "passed": margin > 0.0, "margin": margin} for name, margin in checks.items()]
    (folder / "result.json").write_text(json.dumps({"result": "flown", "checks": listed}))
    return folder


def test_a_log_of_px4_becomes_one_file_that_needs_nothing_else(px4_log, tmp_path):
    target = tmp_path / "page.html"
    outcome = review(px4_log, "--output", target)
    assert outcome.exit_code == 0, outcome.output
    page = target.read_text()
    assert re.findall(r"""(?:src|href)=["'](?!#)[^"']*["']|url\(|@import|https?://""", page) == []
    assert [panel["title"] for section in data_of(target)["sections"] for panel in section["panels"]][:2] == [
        "North of the origin",
        "East of the origin",
    ]


def test_our_own_flight_recorder_is_reviewed_beside_its_log(tmp_path):
    flight = Flight(FlightConfig(world=WorldConfig(size_m=64.0, trees_per_ha=0.0)), folder=tmp_path)
    keep_for_replay(flight, path_ned=[(0.0, 0.0, 0.0), (5.0, 0.0, -3.0)])
    flight.run(lambda f: f.time_us >= 3e6)
    flight.close()
    assert review(tmp_path).exit_code == 0
    data = data_of(tmp_path / "review.html")
    assert data["tracks"][0]["waypoints"] == [[5.0, 0.0, -3.0]]
    lacks = {section["title"]: section["missing"] for section in data["sections"]}
    assert {title for title, missing in lacks.items() if missing} <= {"Actuators"}
    assert data["flights"][0]["has_defaults"]


def test_a_review_loads_neither_the_simulator_nor_an_extra():
    heavy = ("warp", "sim", "viser", "cv2")
    script = f"import mission.review.review_session, sys; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run((sys.executable, "-c", script), capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_two_logs_are_laid_over_each_other_where_they_took_off(px4_log, tmp_path):
    later = write(tmp_path / "later.ulg", start_us=101_000_000)
    assert review(px4_log, later, "--output", tmp_path / "both.html").exit_code == 0
    data = data_of(tmp_path / "both.html")
    assert [flight["airborne"][0][1] for flight in data["flights"]] == [0.0, 0.0]
    assert {curve["flight"] for curve in data["sections"][0]["panels"][0]["curves"]} == {0, 1}


def test_a_folder_of_runs_becomes_an_index_with_the_worst_first(px4_log, tmp_path):
    folder = tmp_path / "campaign"
    run(folder / "wide", px4_log, path=3.0)
    run(folder / "failed", px4_log, path=-0.5, landing=1.0)
    run(folder / "narrow", px4_log, path=0.1)
    (folder / "broken").mkdir()
    (folder / "broken" / "flight.ulg").write_bytes(b"no log")
    assert review(folder).exit_code == 0
    index = (folder / "review.html").read_text()
    names = re.findall(r"<td>(?:<a href=\"(.*?)\">)?(broken|failed|narrow|wide)<", index)
    assert names == [("", "broken")] + [(f"{name}/review.html", name) for name in ("failed", "narrow", "wide")]
    assert "is not a ULog" in index
    assert all((folder / link).exists() for link, _ in names[1:])
    assert data_of(folder / "failed" / "review.html")["flights"][0]["checks"][0]["name"] == "path"


def test_an_index_elsewhere_has_its_pages_beside_it(px4_log, tmp_path):
    for name in ("one", "two"):
        run(tmp_path / "runs" / name, px4_log)
    assert review(tmp_path / "runs", "--output", tmp_path / "out").exit_code == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["001-one.html", "002-two.html", "index.html"]
    assert not list((tmp_path / "runs").rglob("*.html"))


def test_a_run_is_one_flight_whatever_else_lies_in_its_folder(px4_log, tmp_path):
    folder = run(tmp_path / "run", px4_log)
    (folder / "px4").mkdir()
    shutil.copy(px4_log, folder / "px4" / "own.ulg")
    assert review(folder).exit_code == 0
    assert len(data_of(folder / "review.html")["flights"]) == 1


def test_checks_are_read_as_far_as_they_can_be(tmp_path):
    (tmp_path / "result.json").write_text(
        json.dumps(
            {"checks": [{"name": "a", "margin": "wide", "passed": 1}, "b", {"margin": 2}, {"name": "c", "margin": -1}]}
        )
    )
    assert [(check.name, check.margin, check.is_passed) for check in checks_of(tmp_path)] == [
        ("c", -1.0, None),
        ("a", None, None),
    ]
    for text in ("", "[]", '{"checks": 3}', "[" * 100_000):
        (tmp_path / "result.json").write_text(text)
        assert checks_of(tmp_path) == ()


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ('{"checks": 5}', "checks: must be a list, not 5"),
        ('{"checks": [{"name": "hold", "mar', "is no JSON: line 1: unterminated string starting at"),
        ("[]", "must be a mapping, not a list"),
        ("[" * 100_000, "is nested too deeply"),
        (b"\xff\xfe", "is not UTF-8 text"),
    ],
)
def test_a_wrong_result_is_said_and_the_flight_is_reviewed_without_it(px4_log, tmp_path, text, wrong):
    folder = run(tmp_path / "run", px4_log, hold=1.0)
    file = folder / "result.json"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    outcome = review(folder)
    assert outcome.exit_code == 0
    assert f"{file}: {wrong}: no checks are shown" in outcome.output
    assert data_of(folder / "review.html")["flights"][0]["checks"] == []


def test_a_result_that_is_right_or_not_there_is_not_spoken_of(px4_log, tmp_path):
    folder = run(tmp_path / "run", px4_log, hold=1.0)
    assert "no checks" not in review(folder).output
    (folder / "result.json").unlink()
    assert "no checks" not in review(folder).output


def test_wrong_results_of_a_folder_of_runs_are_named_one_by_one(px4_log, tmp_path):
    for name in ("one", "two"):
        (run(tmp_path / name, px4_log) / "result.json").write_text("{")
    outcome = review(tmp_path)
    assert outcome.exit_code == 0
    assert outcome.output.count("is no JSON") == 2


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "campaign.json",
            "the campaign has kept none of its worst runs; the same honeyguide campaign command flies them",
        ),
        ("hop.scenario.yaml", "hop.scenario.yaml --keep FOLDER keeps one that fails"),
    ],
)
def test_of_what_has_no_logs_it_says_what_it_is(tmp_path, name, sentence):
    (tmp_path / name).write_text("{}")
    outcome = review(tmp_path)
    assert outcome.exit_code == 2
    assert f"honeyguide: {tmp_path}: holds no log: " in outcome.stderr
    assert sentence in outcome.stderr


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.ulg"], "nowhere.ulg: there is no such log or folder"),
        (["empty"], "empty: holds no log: there is no .ulg file in it"),
        (["text.ulg"], "text.ulg: is not a ULog"),
        (["good.ulg", "--output", "text.ulg/page.html"], "text.ulg/page.html: cannot be written: "),
        (["good.ulg", "good.ulg", "good.ulg"], "3 logs were given: two are compared; of more, name their folder"),
        (["good.ulg", "many"], "many: holds 2 logs: name one of them to compare it"),
    ],
)
def test_what_cannot_be_reviewed_is_refused_in_one_sentence(px4_log, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.ulg").write_text("a flight")
    shutil.copy(px4_log, tmp_path / "good.ulg")
    for name in ("one", "two"):
        run(tmp_path / "many" / name, px4_log)
    outcome = review(*arguments)
    assert outcome.exit_code == 2
    assert f"honeyguide: {sentence}" in outcome.stderr
    assert "Traceback" not in outcome.stderr
