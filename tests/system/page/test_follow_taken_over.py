"""`honeyguide follow --view` as a process, and a person at its page who clicks, in a headless Chromium."""

import re
import socket
import subprocess

import pytest

from tests.browser import CHROMIUM, Browser
from tests.system.vehicle import HONEYGUIDE, ROOT, free_ports

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


def free_tcp_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.slow
def test_who_clicks_as_the_page_invites_gets_no_error_and_the_same_figures_twice(tmp_path):
    gcs, api = free_ports()
    folder = tmp_path / "run"
    command = [HONEYGUIDE, "follow", "--view", "--view-port", free_tcp_port(), "--policy", "scripted"]
    options = ["--seconds", "20", "--no-mp4", "--gcs-port", gcs, "--api-port", api, "--run-folder", folder]
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
        browser.wait("document.body?.innerText.match(/[3-9] s flown by the policy/)", 120.0)
        browser.click_button("Hold")
        browser.wait("document.body.innerText.includes('Hold: done')")
        shown = browser.wait(
            "document.body.innerText.includes('flight ended: logs in') && document.body.innerText", 120.0
        )
        said += process.communicate(timeout=60.0)[0]
    finally:
        browser.close()
        process.kill()
    assert process.returncode == 0, said
    assert re.search(r"judged: the \d+\.\d s that the policy flew; for \d+\.\d s mode Hold was chosen", said)
    assert str(folder.name) in shown
    for label in ("within 1-3 m", "owner in view", "median distance"):
        figure = re.search(rf"{label} (\d+\.\d+ (?:%|m))", shown)[1]
        assert re.search(rf"{label} +│ {re.escape(figure)}", said), (figure, said)
