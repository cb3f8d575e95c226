"""The live page in a headless Chromium: it loads, shows the scene, and its clicks reach vehicle and simulator."""

import numpy as np
import pytest

from tests.browser import CHROMIUM
from tests.system.page.shown_flight import Shown

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    page = Shown(tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


def text(shown):
    return shown.browser.evaluate("document.body.innerText")


def test_the_page_shows_a_scene_and_plots_that_go_on(shown):
    shown.browser.wait("document.body?.innerText.includes('disarmed')")
    assert shown.browser.evaluate("document.title") == "Honeyguide"
    shown.wait(lambda: len(np.unique(scene_pixels(shown).reshape(-1, 3), axis=0)) > 200)
    assert shown.browser.evaluate("document.querySelectorAll('canvas').length") >= 4  # the scene and three plots
    plots = "[...document.querySelectorAll('.u-wrap canvas')].map(c => c.toDataURL()).join()"
    before = shown.browser.wait(plots)
    shown.wait(lambda: shown.browser.evaluate(plots) != before)
    assert shown.browser.errors == []


def test_the_page_asks_the_network_for_nothing(shown):
    hosts = {url.split("/")[2] for url in shown.browser.requests if url.startswith(("http", "ws"))}
    assert hosts == {f"127.0.0.1:{shown.server.get_port()}"}


def test_a_button_and_a_click_on_the_ground_fly_the_vehicle(shown):
    shown.wait(lambda: shown.flight.controller.state.is_ready_to_arm)
    shown.browser.click_button("Take off")
    shown.wait(lambda: shown.flight.controller.state.is_flying and height(shown) > 4.0)
    start_ned = position(shown)
    shown.browser.click(400, 420)
    shown.wait(lambda: np.linalg.norm((position(shown) - start_ned)[:2]) > 1.0)
    shown.browser.wait("document.body?.innerText.includes('go to')")
    assert "m from home" in text(shown)


def test_a_dead_motor_brings_the_vehicle_down(shown):
    shown.wait(lambda: shown.flight.controller.state.is_flying)
    shown.browser.click_button("Kill the motor")
    shown.browser.wait("document.body?.innerText.includes('motor 1 is off')")
    shown.wait(lambda: height(shown) < 0.5)


def scene_pixels(shown):
    return shown.browser.picture()[200:, 320:660]


def position(shown):
    return shown.flight.rig.rows["truth"][0]["pos_ned"].copy()


def height(shown):
    return float(shown.flight.rig.rows["truth"][0]["height_agl_m"])
