"""`honeyguide park --view` as a process, and a person at its page who clicks a spot, in a headless Chromium."""

import re
import subprocess

import pytest

from tests.browser import CHROMIUM, Browser
from tests.system.page.test_follow_taken_over import free_tcp_port
from tests.system.vehicle import HONEYGUIDE, ROOT, free_ports

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.mark.slow
def test_a_click_on_a_spot_has_the_rover_drive_there(tmp_path):
    gcs, api = free_ports()
    command = [HONEYGUIDE, "park", "--view", "--view-port", free_tcp_port(), "--idle", "--seconds", "45"]
    options = ["--world-seed", "1", "--gcs-port", gcs, "--api-port", api, "--run-folder", tmp_path / "run"]
    process = subprocess.Popen(
        [*map(str, command + options)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT
    )
    browser = Browser(tmp_path / "profile", 1000, 700)
    try:
        said = ""
        while not (address := re.search(r"live page: (\S+)", said)):
            line = process.stdout.readline()
            assert line, said
            said += line
        browser.open(address[1])
        browser.wait("document.body?.innerText.includes('companion: waiting (no goal)')", 120.0)
        browser.click_button("spot 3")
        browser.wait("document.body.innerText.includes('companion: driving')", 30.0)
        browser.wait("document.body.innerText.match(/spot 3: /)", 60.0)
        said += process.communicate(timeout=60.0)[0]
    finally:
        browser.close()
        process.kill()
    assert process.returncode == 0, said
