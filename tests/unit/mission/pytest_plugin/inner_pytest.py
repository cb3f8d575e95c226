"""A pytest in this one, with the plugin as this process has it.

What is imported here is not imported in each of them.
"""

import pytest_honeyguide
from mission.pytest_plugin import running, scenario_items  # noqa: F401
from mission.scenario import one_run  # noqa: F401


def inner(pytester, *options):
    return pytester.runpytest_inprocess(*options, plugins=[pytest_honeyguide])
