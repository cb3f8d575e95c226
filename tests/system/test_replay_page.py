"""Replays in a headless Chromium: the HTML file opens from the disk, without a network, and the slider acts."""

import time

import numpy as np
import pytest

from mission.flight import flight_world
from mission.view.html import write_html
from mission.view.page import PageServer
from mission.view.replay import ReplayView
from tests.browser import CHROMIUM, Browser
from tests.unit.mission.view.rows import CONFIG, hovering

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.fixture
def browser(tmp_path):
    opened = Browser(tmp_path / "profile", 1000, 500)
    yield opened
    opened.close()


def recording():
    """A vehicle that climbs."""
    flown = hovering(4.0)
    flown.rows["pos_ned"][:, 2] -= np.linspace(0.0, 3.0, len(flown))
    return flown


def test_the_html_file_shows_the_flight_and_its_slider_moves_it(browser, tmp_path):
    page = tmp_path / "flight.html"
    write_html(recording(), flight_world(CONFIG), page, "x500")
    browser.open(page.as_uri())
    browser.wait("typeof plots !== 'undefined' && document.getElementById('status').textContent.includes('Offboard')")
    first = browser.picture()
    assert len(np.unique(first[:400, :600].reshape(-1, 3), axis=0)) > 50
    browser.evaluate("(() => { const t = by('time'); t.value = 13; t.dispatchEvent(new Event('input')); })()")
    browser.wait("document.getElementById('clock').textContent.startsWith('13.0')")
    assert (np.abs(browser.picture().astype(int) - first) > 30).any(axis=2)[:400, :600].sum() > 100
    browser.click_button("Play")
    browser.wait("now > 13.2")
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:"))] == []


def test_the_replay_page_plays(browser):
    server = PageServer(0, "Honeyguide")
    view = ReplayView(recording(), flight_world(CONFIG), server)
    browser.open(server.url)
    end_s = time.monotonic() + 60.0
    shown = "document.body?.innerText.match(/Offboard, disarmed, (1[1-9]\\.\\d) s/)"
    while not browser.evaluate(f"!!{shown}"):
        assert time.monotonic() < end_s
        for _ in range(10):
            view.frame()
            time.sleep(0.02)
    assert browser.errors == []
    view.close()
