"""Reviews in a headless Chromium: opened from the disk without a network, zoomed together, and on a phone."""

import pytest

from mission.review.flight_review import review_flight
from mission.review.review_page import review_page
from tests.browser import CHROMIUM
from tests.unit.mission.review.px4_logs import ALL, write

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("review")
    flight = review_flight((write(folder / "log.ulg", topics=ALL - {"battery_status"}),), "circle", None, None)
    (folder / "page.html").write_bytes(review_page([flight], "circle"))
    return folder / "page.html"


def opened(chromium, page, width, height):
    chromium.renew(width, height)
    chromium.open(page.as_uri())
    chromium.wait(
        "typeof plots !== 'undefined' && plots.length > 20 && views.some(view => view.isNear && !view.isStale)"
    )
    return chromium


def test_a_review_opens_from_the_disk_and_says_what_the_log_lacks(chromium, page):
    browser = opened(chromium, page, 1280, 800)
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:"))] == []
    titles = browser.evaluate("[...document.querySelectorAll('h2')].map(h => h.innerText)")
    assert titles[:4] == ["Modes and texts", "Position", "Height", "Velocity"]
    assert (
        browser.evaluate("document.querySelector('#power .missing').innerText") == "no battery (topic battery_status)"
    )
    assert browser.picture().std() > 10.0


def test_a_stretch_that_is_dragged_over_is_shown_by_all_plots(chromium, page):
    browser = opened(chromium, page, 1280, 800)
    browser.evaluate("plots[0].canvas.scrollIntoView({block: 'center'})")
    browser.wait("plots[0].scale && plots[0].view.isNear && !plots[0].view.isStale")
    box = browser.evaluate(
        "(() => { const r = plots[0].canvas.getBoundingClientRect(); return [r.left, r.top, r.width] })()"
    )
    left, width = box[0] + 52, box[2] - 62  # of the axis
    for kind, fraction in (("mousePressed", 0.25), ("mouseMoved", 0.4), ("mouseMoved", 0.5), ("mouseReleased", 0.5)):
        buttons = 0 if kind == "mouseReleased" else 1
        at = {"x": left + fraction * width, "y": box[1] + 60.0, "button": "left", "buttons": buttons, "clickCount": 1}
        browser.send("Input.dispatchMouseEvent", type=kind, **at)
    browser.wait("shown.to - shown.from < 6")
    assert browser.evaluate("[shown.from, shown.to]") == pytest.approx([5.0, 10.0], abs=0.1)
    for number in (1, 2):
        browser.wait(f"!plots[{number}].view.isStale")
        assert browser.evaluate(f"plots[{number}].scale.x(7.5)") == pytest.approx(
            browser.evaluate("plots[0].scale.x(7.5)"), abs=2
        )
    assert browser.evaluate("shown.cursor") == pytest.approx(10.0, abs=0.1)
    browser.click_button("Whole flight")
    browser.wait("shown.to - shown.from > 19")


def test_two_fingers_zoom_and_the_page_plays(chromium, page):
    browser = opened(chromium, page, 390, 844)
    browser.send("Emulation.setTouchEmulationEnabled", enabled=True)
    browser.evaluate("plots[0].canvas.scrollIntoView({block: 'center'})")
    browser.wait("plots[0].scale && !plots[0].view.isStale")
    x, y = browser.evaluate(
        "(() => { const r = plots[0].canvas.getBoundingClientRect(); return [r.left + r.width / 2, r.top + 60] })()"
    )
    for kind, apart in (("touchStart", 20), ("touchMove", 40), ("touchMove", 80), ("touchEnd", 0)):
        fingers = [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}] if apart else []
        browser.send("Input.dispatchTouchEvent", type=kind, touchPoints=fingers)
    browser.wait("shown.to - shown.from < 8")
    before = browser.evaluate("shown.cursor")
    browser.click_button("Play")
    browser.wait(f"shown.cursor > {before} + 0.5")
    browser.click_button("Pause")
    browser.send("Emulation.setTouchEmulationEnabled", enabled=False)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_on_a_phone_nothing_is_wider_than_the_window(chromium, page, scheme):
    chromium.renew(390, 844)
    chromium.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    chromium.open(page.as_uri())
    chromium.wait("typeof plots !== 'undefined' && plots.length > 20")
    assert chromium.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert chromium.evaluate(
        "[...document.querySelectorAll('figure, .card')].every(e => e.getBoundingClientRect().right <= innerWidth)"
    )
    for wanted in ("Play", "5 x"):
        assert wanted in chromium.evaluate("document.getElementById('bar').innerText")
    bright = chromium.picture()[700:, :].mean()
    assert (bright > 150) == (scheme == "light")
    assert chromium.errors == []
