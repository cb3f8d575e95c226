"""`honeyguide park --view` as a process, and a person at its page who clicks a spot, in a headless Chromium."""

import pytest

from tests.browser import CHROMIUM
from tests.system.page.shown_process import shown

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")


@pytest.mark.slow
def test_a_click_on_a_spot_has_the_rover_drive_there(tmp_path):
    with shown(tmp_path, "park", "--idle", "--seconds", "45", "--world-seed", "1") as process:
        browser = process.browser
        browser.wait("document.body?.innerText.includes('companion: waiting (no goal)')", 120.0)
        browser.click_button("spot 3")
        browser.wait("document.body.innerText.includes('companion: driving')", 30.0)
        browser.wait("document.body.innerText.match(/spot 3: /)", 60.0)
        process.end()
