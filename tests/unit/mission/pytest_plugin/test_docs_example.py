"""The tests that the page on pytest shows pass as they stand."""

from tests.documents import ROOT, blocks
from tests.unit.mission.pytest_plugin.inner_pytest import inner

pytest_plugins = "pytester"


def test_the_example_passes(pytester):
    (text,) = blocks(ROOT / "docs" / "how-to" / "pytest.md", "python")
    pytester.makeini("[pytest]\nfilterwarnings = error\n")
    pytester.makepyfile(test_delivery=text)
    inner(pytester, "test_delivery.py").assert_outcomes(passed=3)
