"""`honeyguide dataset build`: the logs that it refuses before it reads them."""

import pytest
from typer.testing import CliRunner

from mission.cli import app


def refused(*words):
    result = CliRunner().invoke(app, ["dataset", "build", *map(str, words)])
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.strip().splitlines()
    return line.removeprefix("honeyguide: ")


@pytest.mark.parametrize("task", ["Drive", "FollowMe", "Navigate"])
def test_a_telemetry_log_holds_no_decisions(tmp_path, task):
    log, out = tmp_path / "flight.tlog", tmp_path / "set"
    log.write_bytes(bytes(100))
    line = refused(log, "--task", task, "-o", out)
    assert line == f"{log}: a .tlog holds no topic policy_decision; build from the run's .ulg"
    assert not out.exists()
