"""What tests of pages in a headless Chromium share."""

import pytest

from tests.browser import Browser


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()
