"""`honeyguide companion` refuses in one sentence, with exit code 2."""

import socket

import pytest
from typer.testing import CliRunner

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from mission.cli import app
from mission.follow.companion_process import trouble_text
from policies.companion.companion import Companion
from policies.companion.image_client import StreamCamera
from policies.companion.pilot import load_pilot
from policies.companion.skills.following import Following
from tests.system.vehicle import free_ports
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
    ["", "127.0.0.1:14580", "serial:///dev/ttyS0", "udpout://127.0.0.1", "tcp://127.0.0.1:x", "udpout://:1"],
)
def test_an_address_of_another_kind(link):
    assert "must be udpout://HOST:PORT, udpin://ADDRESS:PORT, tcp://HOST:PORT or serial:///dev/NAME:BAUD" in refused(
        "--policy", "scripted", "--link", link
    )


def test_a_serial_port_that_is_not_there():
    sentence = "/dev/nobody cannot be opened at 57600 baud: No such file or directory."
    assert sentence in refused("--policy", "scripted", "--link", "serial:///dev/nobody:57600")


def test_a_port_that_is_taken():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        assert "is in use" in refused("--policy", "scripted", "--link", f"udpin://127.0.0.1:{port}")


def test_a_setting_that_the_guard_has_not():
    sentence = "--guard-setting owner: the guard has no such setting; did you mean owner_m?"
    assert sentence in refused("--policy", "scripted", "--guard-setting", "owner=2")


def test_a_camera_of_another_kind():
    assert "must be tcp://HOST:PORT" in refused("--policy", "scripted", "--camera", "http://127.0.0.1:1")


def test_it_says_who_flies_and_where_and_what_is_missing():
    result = CliRunner().invoke(app, ["companion", "--policy", "scripted", "--seconds", "0.2"])
    assert result.exit_code == 0
    loading, first, last = result.stdout.strip().splitlines()
    assert loading == "loading the program ..."
    assert "vehicle: udpout://127.0.0.1:14580, pictures: tcp://127.0.0.1:14600" in first
    assert "no decision timed" in last


def test_a_camera_that_is_not_there_is_named():
    camera = StreamCamera(f"tcp://127.0.0.1:{free_ports()[0]}")
    own_end, vehicle_end = memory_pair(LinkRole.ONBOARD)
    companion = Companion(own_end, Following(camera, load_pilot("scripted")))
    vehicle_end.send(encode("HEARTBEAT", 1, 1, 0, type=2, autopilot=12, system_status=4, mavlink_version=3))
    vehicle_end.send(encode("ATTITUDE_QUATERNION", 1, 1, 1, time_boot_ms=1, q1=1.0))
    vehicle_end.send(encode("LOCAL_POSITION_NED", 1, 1, 2, time_boot_ms=1))
    for time_us in range(0, 100_000, 20_000):
        companion.frame(time_us)
    assert trouble_text(companion) == "no new pictures: nobody there"
    companion.close()


def test_what_flies_is_not_driven_by_sticks():
    result = refused("--policy", "navigate", "--by-sticks")
    assert "--by-sticks: navigate flies, and only what drives is driven by sticks" in result


def test_what_asks_for_courses_is_not_driven_by_sticks():
    result = refused("--policy", "navigate-rover", "--by-sticks")
    assert "--by-sticks: navigate-rover asks for courses, and sticks for turns" in result


def test_what_drives_into_poses_follows_nobody():
    assert "made for Drive, and does not follow anybody" in refused("--policy", "drive-park", "--follow")


def test_who_follows_by_a_policy_of_navigate_looks_through_the_camera():
    result = CliRunner().invoke(
        app,
        ["companion", "--policy", "navigate-rover", "--follow", "--seconds", "0.2", "--camera", "tcp://127.0.0.1:9"],
    )
    assert result.exit_code == 0
    assert "navigate-rover drives; vehicle: udpout://127.0.0.1:14580, pictures: tcp://127.0.0.1:9" in result.stdout
