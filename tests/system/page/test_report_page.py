"""The report of a campaign in a headless Chromium: opened from the disk without a network, on a phone, in the dark."""

import math

import pytest

from mission.campaign.campaign import Campaign
from mission.campaign.findings import findings_of
from mission.campaign.report.page import REPORT_FILE, write_report
from mission.campaign.runs import Record
from mission.campaign.search.bisection import BoundaryFound, Bracket
from tests.browser import CHROMIUM

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")

LONG = "vehicle.parameters.EKF2_GPS_POS_X_OF_A_NAME_THAT_IS_LONGER_THAN_A_PHONE_IS_WIDE"
GIVEN = {
    "name": "gale",
    "about": "Holds <script>throw 1</script> its place & lands.",
    "scenario": {"seeds": [1], "vehicle": {"script": ["arm", {"takeoff": 3}, "land"]}},
    "vary": {
        "wind.speed_m_s": {"uniform": [0, 10]},
        "wind.from_deg": {"choice": [0, 90, 180]},
        "noise": {"uniform": [0, 2]},
        LONG: {"uniform": [0, 1]},
    },
    "require": "success >= 0.99",
    "search": {"bisect": {"key": "wind.speed_m_s", "seeds": 2}},
}
# Of them, and of the boundary: margins, where it fails, each key, seeds.
FIGURES = 2 + 4 + 1


def record(number, speed, phase="sample", seed=1):
    values = {"wind.speed_m_s": speed, "wind.from_deg": 90 * (number % 3), "noise": (number * 7 % 20) / 10.0}
    margin = 7.0 - speed - 0.2 * math.sin(number)
    failures = () if margin >= 0.0 else (f"hold: asked within 3 m, but {3.0 - margin:.3g} m",)
    return Record(
        *(phase, number, seed, {**values, LONG: (number * 3 % 11) / 11.0}, 1.0),
        passed=margin >= 0.0, margin=margin, check="hold", unit="m", failures=failures, margins={"hold": margin},
    )  # fmt: skip


def boundary():
    brackets = tuple(
        Bracket(seed, 6.9, 7.0, [record(i, 10.0 * i / 4, f"bisect-{seed}", seed) for i in range(5)]) for seed in (1, 2)
    )
    return BoundaryFound("wind.speed_m_s", 0.0, 10.0, 0.1, brackets)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    samples = [record(number, 10.0 * number / 60) for number in range(60)]
    write_report(findings_of(Campaign.model_validate(GIVEN), samples, [boundary()], folder), folder)
    return folder / REPORT_FILE


def opened(chromium, page, width, height, scheme):
    chromium.renew(width, height)
    chromium.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    chromium.open(page.as_uri())
    chromium.wait("document.readyState === 'complete' && document.querySelector('h1') !== null")
    return chromium


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_a_report_opens_from_the_disk_and_fits_its_window(chromium, page, width, height, scheme):
    browser = opened(chromium, page, width, height, scheme)
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:"))] == []
    assert browser.evaluate("document.documentElement.scrollWidth <= innerWidth")
    sizes = browser.evaluate(
        "[...document.querySelectorAll('figure svg')].map(s => s.getBoundingClientRect())"
        ".map(r => [r.left, r.right, r.width, r.height])"
    )
    assert len(sizes) == FIGURES
    for left, right, figure_width, figure_height in sizes:
        assert left >= 0.0
        assert right <= width
        assert min(figure_width, figure_height) > 200.0
    picture = browser.picture()
    assert (picture.mean() > 150) == (scheme == "light")
    assert picture.std() > 10.0


def test_a_report_says_what_was_found_and_runs_nothing_that_it_was_given(chromium, page):
    browser = opened(chromium, page, 1280, 800, "light")
    titles = browser.evaluate("[...document.querySelectorAll('h2')].map(h => h.innerText)")
    assert titles == ["What it depends on", "Boundary", "Worst first"]
    assert browser.evaluate("document.querySelector('p').innerText") == GIVEN["about"]
    assert "not met" in browser.evaluate("document.body.innerText")
    assert browser.evaluate("document.querySelectorAll('.wide')[1].querySelectorAll('tr').length") == 11


def test_plots_take_the_colours_of_their_page(chromium, page):
    inks = [
        opened(chromium, page, 1280, 800, scheme).evaluate(
            "getComputedStyle(document.querySelector('figure svg g[id^=text] :is(text, g)')).fill"
        )
        for scheme in ("light", "dark")
    ]
    assert inks == ["rgb(33, 37, 41)", "rgb(222, 226, 230)"]
