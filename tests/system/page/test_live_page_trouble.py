"""The live page when things go wrong, in a headless Chromium: texts, a crash, a restart, the flight's end, a phone."""

import pytest

from autopilot.interface.vehicle_state import Severity
from tests.browser import CHROMIUM
from tests.system.page.shown_flight import Shown

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
AT_ONCE_S = 30.0  # wall clock of a busy machine that draws without a GPU


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    page = Shown(tmp_path_factory.mktemp("profile"), 1000, 700)
    yield page
    page.close()


def says(shown, text, timeout_s=AT_ONCE_S):
    shown.browser.wait(f"document.body?.innerText.includes({text!r})", timeout_s)


def take_off(shown):
    if not shown.flight.controller.state.is_flying:
        shown.browser.click_button("Take off")
        shown.wait(lambda: shown.flight.controller.state.is_flying)


def test_what_the_vehicle_says_is_on_the_page(shown):
    says(shown, "disarmed", 60.0)
    take_off(shown)
    says(shown, "s Armed")


def test_a_text_that_a_client_has_chosen_is_shown_as_it_is(shown):
    shown.flight.texts.statustext(Severity.CRITICAL, "<img src=x onerror=\"document.title='hit'\"> *a* `b` [c](d)")
    says(shown, "onerror=\"document.title='hit'\"> *a* `b` [c](d)")
    assert shown.browser.evaluate("document.querySelectorAll('img[src=x]').length") == 0
    assert shown.browser.evaluate("document.title") == "Honeyguide"


def test_a_crash_is_told_and_a_take_off_after_it_refused_with_its_reasons(shown):
    take_off(shown)
    shown.browser.click_button("Kill the motor")
    says(shown, "the vehicle has crashed")
    shown.wait(lambda: not shown.flight.controller.state.is_armed)
    says(shown, "Disarmed by")
    shown.browser.click_button("Take off")
    says(shown, "Take off: cannot be armed: ")


def test_a_restart_makes_it_fly_again_from_its_pad(shown):
    shown.browser.click_button("Restart")
    says(shown, "back on its pad")
    shown.wait(lambda: not shown.flight.is_crashed)
    shown.browser.wait("!document.body.innerText.includes('the vehicle has crashed')", AT_ONCE_S)
    take_off(shown)


def test_the_end_of_a_flight_is_told_with_its_folder(shown):
    shown.stop()
    shown.view.end("flight ended: logs in runs/20261122-191919")
    says(shown, "flight ended: logs in runs/20261122-191919")
    assert shown.browser.evaluate(
        "[...document.querySelectorAll('button')].find(b => b.innerText.trim() === 'Take off').disabled"
    )
    assert shown.browser.errors == []


def test_on_a_phone_controls_leave_the_scene_free_and_begin_with_status(tmp_path):
    phone = Shown(tmp_path, 390, 844)
    try:
        says(phone, "disarmed", 60.0)
        phone.browser.wait("document.querySelector('#root canvas[data-engine]')?.clientHeight > 0")
        phone.browser.wait(f"{bottom('canvas[data-engine]')} <= {top('.mantine-ScrollArea-root')} + 1", AT_ONCE_S)
        assert phone.browser.evaluate(bottom("canvas[data-engine]")) > 400
        status = phone.browser.evaluate(
            "(() => { const r = [...document.querySelectorAll('p')].find(p => p.innerText.includes('disarmed'))"
            ".getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; })()"
        )
        assert 0 <= status[0] < status[2] <= 390
        assert 440 < status[1] < status[3] <= 844
        assert phone.browser.evaluate("document.querySelectorAll('.u-wrap').length") == 3
    finally:
        phone.close()


def top(selector):
    return f"document.querySelector('#root {selector}').getBoundingClientRect().top"


def bottom(selector):
    return f"document.querySelector('#root {selector}').getBoundingClientRect().bottom"
