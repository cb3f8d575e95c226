"""Replays in a headless Chromium: the HTML file opens from the disk, without a network, and the slider acts."""

import re
import time

import numpy as np
import pytest

from mission.simulator.flight_rig import flight_world
from mission.view.html import write_html
from mission.view.page import PageServer
from mission.view.replay import ReplayView
from tests.browser import CHROMIUM
from tests.unit.mission.view.rows import CONFIG, hovering

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.fixture
def browser(chromium):
    chromium.renew(1000, 500)
    return chromium


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


def test_plots_have_numbers_and_seconds_on_their_axes(browser, tmp_path):
    page = tmp_path / "flight.html"
    write_html(recording(), flight_world(CONFIG), page, "x500")
    browser.send("Page.addScriptToEvaluateOnNewDocument", source=NOTE_TEXTS)
    browser.open(page.as_uri())
    texts = browser.wait("typeof plots !== 'undefined' && written.length > 20 && written")
    assert any(re.fullmatch(r"\d+ s", text) for text in texts)  # along
    assert {"0", "2"} <= set(texts)  # up
    assert not any("e-" in text or len(text) > 4 for text in texts if re.fullmatch(r"[-+.e\d]+", text))
    assert browser.evaluate("document.getElementById('legend').innerText").split() == ["track", "owner"]


NOTE_TEXTS = """
var written = [];
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function(text, ...at) {
  written.push(text);
  return fill.call(this, text, ...at);
};
"""


def test_the_track_reaches_up_to_the_vehicle(browser, tmp_path):
    page = tmp_path / "flight.html"
    write_html(recording(), flight_world(CONFIG), page, "x500")
    browser.open(page.as_uri())
    browser.wait("typeof plots !== 'undefined'")
    browser.evaluate(
        "draw = (draw => (it, model, ...rest) => { (window.drawn ??= []).push([it, model]);"
        " return draw(it, model, ...rest); })(draw); now = times[0] + 0.63; isStale = true; 1"
    )
    ends = "drawn.filter(([it]) => it === trails[0].head).map(([, m]) => [0, 1, 2].map(k => m[k] + m[12 + k])).at(-1)"
    end = browser.wait(f"window.drawn && {ends}")
    place = browser.evaluate(
        "(() => { const i = indexAt(now); return between('pos_ned', 3, i, (now - times[i]) /"
        " (times[i + 1] - times[i])); })()"
    )
    assert end == pytest.approx(place, abs=1e-3)


def test_on_a_phone_the_scene_has_room_and_all_else_is_within_reach(chromium, tmp_path):
    page = tmp_path / "flight.html"
    write_html(recording(), flight_world(CONFIG), page, "x500")
    chromium.renew(390, 844)
    chromium.open(page.as_uri())
    chromium.wait("typeof plots !== 'undefined' && document.getElementById('status').textContent.includes('Offboard')")
    boxes = {
        name: chromium.evaluate(
            f"(() => {{ const r = document.getElementById('{name}').getBoundingClientRect();"
            " return [r.left, r.top, r.right, r.bottom]; })()"
        )
        for name in ("scene", "status", "onboard", "play", "time", "follow")
    }
    left, top, right, bottom = boxes.pop("scene")
    assert (left, top, right) == (0, 0, 390)
    assert bottom > 350
    for name, box in boxes.items():
        assert box[1] >= bottom, name
        assert 0 <= box[0] < box[2] <= 390, name
        assert box[3] <= 844, name


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
