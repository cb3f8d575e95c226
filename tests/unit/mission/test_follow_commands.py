"""`honeyguide companion` refuses in one sentence, with exit code 2."""

import pytest
from typer.testing import CliRunner

from mission.cli import app
from tests.unit.policies.companion.test_pilot import policy_file


def refused(*arguments):
    result = CliRunner().invoke(app, ["companion", *map(str, arguments)])
    assert result.exit_code == 2
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    return lines[0]


def test_an_unknown_policy():
    assert "no such policy file" in refused("--policy", "nowhere.pt")


def test_a_policy_of_another_layout(tmp_path):
    assert "layout version" in refused("--policy", policy_file(tmp_path, version=99))


@pytest.mark.parametrize(
    "link", ["", "127.0.0.1:14580", "udpin://127.0.0.1:14580", "udpout://127.0.0.1", "udpout://:1"]
)
def test_an_address_of_another_kind(link):
    assert "must be udpout://HOST:PORT" in refused("--policy", "scripted", "--link", link)


def test_a_camera_of_another_kind():
    assert "must be tcp://HOST:PORT" in refused("--policy", "scripted", "--camera", "http://127.0.0.1:1")
