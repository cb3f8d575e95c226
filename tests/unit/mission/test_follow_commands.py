"""`honeyguide companion` refuses in one sentence, with exit code 2."""

import socket

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
    "link",
    ["", "127.0.0.1:14580", "serial:///dev/ttyS0:57600", "udpout://127.0.0.1", "tcp://127.0.0.1:x", "udpout://:1"],
)
def test_an_address_of_another_kind(link):
    assert "must be udpout://HOST:PORT, udpin://ADDRESS:PORT or tcp://HOST:PORT" in refused(
        "--policy", "scripted", "--link", link
    )


def test_a_port_that_is_taken():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        assert "is in use" in refused("--policy", "scripted", "--link", f"udpin://127.0.0.1:{port}")


def test_a_camera_of_another_kind():
    assert "must be tcp://HOST:PORT" in refused("--policy", "scripted", "--camera", "http://127.0.0.1:1")
