"""Results as JUnit XML, which continuous integration shows: a suite for each run, a case for each check.

What was not flown to its end, or cannot be flown, is an error.
"""

from collections.abc import Sequence
from math import isfinite
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from mission.scenario.result import CheckResult, ScenarioResult


def junit_text(results: Sequence[ScenarioResult]) -> bytes:
    """The file."""
    root = Element("testsuites", name="honeyguide")
    for result in results:
        _suite(root, result)
    indent(root)
    written: bytes = tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="utf-8"?>\n' + written + b"\n"


def _suite(root: Element, result: ScenarioResult) -> None:
    name = f"{result.name} seed {result.seed}"
    failed = sum(not check.passed for check in result.checks)
    suite = SubElement(
        root, "testsuite", name=name, tests=str(len(result.checks) + 1), failures=str(failed),
        errors=str(int(bool(result.error))), time=f"{result.cpu_s:.3f}",
    )  # fmt: skip
    flown = SubElement(suite, "testcase", classname=name, name="flown to its end", time=f"{result.cpu_s:.3f}")
    if result.error:
        SubElement(flown, "error", message=_clean(result.error))
    for check in result.checks:
        _case(suite, name, check)
    if result.folder:
        SubElement(suite, "system-out").text = _clean(f"kept in {result.folder}")


def _case(suite: Element, name: str, check: CheckResult) -> None:
    case = SubElement(suite, "testcase", classname=name, name=_clean(check.name), time="0")
    margin = f", margin {check.margin:.3g} {check.unit}" if isfinite(check.margin) else ""
    text = _clean(f"asked {check.asked}; {check.happened}{margin}")
    if check.passed:
        SubElement(case, "system-out").text = text
    else:
        SubElement(case, "failure", message=text)


def _clean(text: str) -> str:
    """Without characters that XML cannot hold."""
    return "".join(letter if letter.isprintable() or letter in "\n\t" else "?" for letter in text)
