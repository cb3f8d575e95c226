"""`honeyguide dataset build`: the logs that it refuses before it reads them, and those that it tells are not whole."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from common.logs.ulog import UlogWriter
from mission.cli import app
from mission.dataset.companion_log import IMAGES_FILE, ImageFile
from mission.dataset.sources import FlightSource, struck
from mission.log.ulog_file import is_whole
from policies.companion.decision_log import TOPIC, topic_fields, topic_info
from policies.companion.vector_pilot import NavigationPilot
from policies.datasets.episodes import DatasetError
from policies.datasets.reader import DatasetReader

LAYOUT = NavigationPilot.task


def built(*words):
    return CliRunner().invoke(app, ["dataset", "build", *map(str, words)])


def refused(*words):
    result = built(*words)
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.strip().splitlines()
    return line.removeprefix("honeyguide: ")


def logged(path, count=200):
    """A companion's log: decisions of a vehicle that goes north, whose goal is far."""
    path.parent.mkdir(exist_ok=True)
    log = UlogWriter(path, 0, topic_info(LAYOUT, "somebody", ()), {})
    topic = log.add_topic(TOPIC, topic_fields(LAYOUT))
    frame, still = np.zeros(LAYOUT.frame_size), [0.0] * 4
    for k in range(count):
        pos_ned, vel_ned, goal = (0.1 * k, 0.0, -2.0), (1.0, 0.0, 0.0), (500.0, 0.0, -2.0)
        motion = (*still, *still, *still, *pos_ned, *vel_ned, *goal)
        topic.write_row(100_000 * (k + 1), 0, *frame, *motion, 0.0, -1, True, k == 0, 0, 0)
    log.close()
    return path


def test_what_the_accelerometers_felt_before_the_next_decision_is_a_blow():
    sensed = {f"accelerometer_m_s2[{k}]": np.zeros(6) for k in range(3)}
    sensed["timestamp"] = np.array([90, 130, 240, 299, 550, 700], np.uint64) * 1000
    sensed["accelerometer_m_s2[0]"][:] = [50.0, 5.0, -6.0, 0.0, 20.0, 20.0]
    sensed["accelerometer_m_s2[1]"][:] = [0.0, 4.0, -6.0, 0.0, 0.0, 0.0]
    sensed["accelerometer_m_s2[2]"][:] = -60.0  # of a climb, or of a landing
    decided_us = np.array([100, 200, 300, 400], np.uint64) * 1000
    assert struck(sensed, decided_us).tolist() == [False, True, False, True]  # that at 700 ms came too late
    assert not struck(None, decided_us).any()


@pytest.mark.parametrize("task", ["Drive", "FollowMe", "Navigate"])
def test_a_telemetry_log_holds_no_decisions(tmp_path, task):
    log, out = tmp_path / "flight.tlog", tmp_path / "set"
    log.write_bytes(bytes(100))
    line = refused(log, "--task", task, "-o", out)
    assert line == f"{log}: a .tlog holds no topic policy_decision; build from the run's .ulg"
    assert not out.exists()


@pytest.mark.parametrize("other", ["run/decisions.ulg", "run", "copy.ulg"])
def test_a_log_that_is_given_twice_is_refused(tmp_path, other):
    log, out = logged(tmp_path / "run" / "decisions.ulg"), tmp_path / "set"
    shutil.copy(log, tmp_path / "copy.ulg")
    line = refused(log, tmp_path / other, "--task", "Navigate", "-o", out)
    twice = tmp_path / other if other.endswith(".ulg") else log
    assert line == f"{twice}: holds the same as {log}, which is given too"
    assert not out.exists()


def test_a_log_that_was_cut_off_is_built_of_and_said_to_be(tmp_path):
    whole = logged(tmp_path / "whole" / "decisions.ulg")
    content = whole.read_bytes()
    cut = tmp_path / "cut" / "decisions.ulg"
    cut.parent.mkdir()
    cut.write_bytes(content[: len(content) // 2])
    steps = {}
    for log in (whole, cut):
        out = tmp_path / f"{log.parent.name}-set"
        result = built(log, "--task", "Navigate", "-o", out)
        assert result.exit_code == 0, result.output
        warning = "is damaged or cut off: only what can be read of it counts"
        assert (f"{log}: {warning}" in result.output.splitlines()) == (log == cut)
        with DatasetReader(out) as reader:
            assert reader.origin.notes == ({"log cut/decisions.ulg": warning} if log == cut else {})
            steps[log] = reader.steps
    assert 50 < steps[cut] < steps[whole] == 199


def test_a_log_is_whole_up_to_the_end_of_a_message(tmp_path):
    content = logged(tmp_path / "decisions.ulg", 3).read_bytes()
    path = tmp_path / "part.ulg"
    found = []
    for size in range(len(content) - 300, len(content) + 1):
        path.write_bytes(content[:size])
        found.append(is_whole(path))
    assert (found[0], found[-1], sum(found)) == (False, True, 1)
    path.write_bytes(content + b"\x05\x00~12345")  # a message of a kind that there is not
    assert not is_whole(path)


def test_images_are_read_as_they_were_kept_or_refused_with_file_and_topic(tmp_path):
    log = tmp_path / "flight.ulg"
    source = FlightSource(log, None, None)
    with pytest.raises(DatasetError, match=f"{log}: {TOPIC}: was recorded without pictures: images.zip is missing"):
        source.images(np.array([0]))
    shown = np.random.default_rng(0).integers(0, 256, (2, 8, 8, 4), np.uint8)
    kept = ImageFile(tmp_path / IMAGES_FILE, pytest.fail)
    first, second = shown
    assert [kept.add(image) for image in (first, first, second)] == [0, 0, 1]
    kept.close()
    assert np.array_equal(source.images(np.array([0, 0, 1])), shown[[0, 0, 1]])
    with pytest.raises(DatasetError, match=f"{log}: {TOPIC}: 1 decisions have no picture"):
        source.images(np.array([0, -1]))
    with pytest.raises(DatasetError, match=f"{log}: {TOPIC}: a picture in images.zip is missing or damaged"):
        source.images(np.array([0, 2]))
