"""`honeyguide follow --view` as a process, and a person at its page who clicks, in a headless Chromium."""

import re

import pytest

from tests.browser import CHROMIUM
from tests.system.page.shown_process import shown

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.mark.slow
def test_who_clicks_as_the_page_invites_gets_no_error_and_the_same_figures_twice(tmp_path):
    with shown(tmp_path, "follow", "--policy", "scripted", "--seconds", "20", "--no-mp4") as process:
        browser = process.browser
        browser.wait("document.body?.innerText.match(/[3-9] s flown by the policy/)", 120.0)
        browser.click_button("Hold")
        browser.wait("document.body.innerText.includes('Hold: done')")
        page = browser.wait(
            "document.body.innerText.includes('flight ended: logs in') && document.body.innerText", 120.0
        )
        said = process.end()
    assert re.search(r"judged: the \d+\.\d s that the policy flew; for \d+\.\d s mode Hold was chosen", said)
    assert "run" in page
    for label in ("within 1-3 m", "owner in view", "median distance"):
        figure = re.search(rf"{label} (\d+\.\d+ (?:%|m))", page)[1]
        assert re.search(rf"{label} +│ {re.escape(figure)}", said), (figure, said)
