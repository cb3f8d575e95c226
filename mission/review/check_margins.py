"""The checks of a scenario that the run's folder holds: what passed, by how much, and when it was worst.

In: `result.json` beside the log, read leniently: what is not there, or is of another form, is left out. What is wrong
with the file as a whole is said in a sentence.
"""

import json
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from common.config.refusal import shown

RESULT_FILE = "result.json"
SUMMARY_FILE = "summary.json"
CHECKS_MAX = 1000
TEXT_MAX = 400


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was asked of a flight."""

    name: str
    is_passed: bool | None  # None: it does not say
    margin: float | None  # how much was left; negative: by how much it failed
    worst_s: float | None  # simulated time
    asked: str
    happened: str
    unit: str = ""  # of the margin


def checks_of(folder: Path) -> tuple[Check, ...]:
    """Those of a run's folder, failed ones first, then the narrowest."""
    listed = _json(folder / RESULT_FILE).get("checks")
    if not isinstance(listed, list):
        return ()
    found = [_check(each) for each in listed[:CHECKS_MAX] if isinstance(each, dict) and each.get("name")]
    return tuple(sorted(found, key=_rank))


def result_fault(folder: Path) -> str:
    """What is wrong with the result of a run's folder, in a sentence with its file; "": nothing, or there is none."""
    path = folder / RESULT_FILE
    if not path.exists():
        return ""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        wrong = f"cannot be read: {error.strerror or error}"
    except UnicodeDecodeError:
        wrong = "is not UTF-8 text"
    except json.JSONDecodeError as error:
        wrong = f"is no JSON: line {error.lineno}: {error.msg[:1].lower()}{error.msg[1:]}"
    except RecursionError:
        wrong = "is nested too deeply"
    else:
        wrong = _wrong_form(found)
    return f"{path}: {wrong}: no checks are shown" if wrong else ""


def _wrong_form(result: object) -> str:
    if not isinstance(result, dict):
        return f"must be a mapping, not {shown(result)}"
    if not isinstance(result.get("checks", []), list):
        return f"checks: must be a list, not {shown(result['checks'])}"
    return ""


def result_of(folder: Path) -> str:
    """What the run's own summary calls its result; empty without one."""
    for name in (RESULT_FILE, SUMMARY_FILE):
        result = _json(folder / name).get("result")
        if isinstance(result, str):
            return result[:TEXT_MAX]
    return ""


def _rank(check: Check) -> tuple[bool, float]:
    return check.is_passed is not False, check.margin if check.margin is not None else float("inf")


def _json(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _check(raw: dict[str, Any]) -> Check:
    passed = raw.get("passed")
    return Check(
        name=str(raw["name"])[:TEXT_MAX],
        is_passed=passed if isinstance(passed, bool) else None,
        margin=_number(raw.get("margin")),
        worst_s=_number(raw.get("worst_s")),
        asked=_text(raw.get("asked")),
        happened=_text(raw.get("happened")),
        unit=_text(raw.get("unit")),
    )


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if isfinite(value) else None


def _text(value: Any) -> str:
    if value is None:
        return ""
    return (f"{value:.4g}" if isinstance(value, float) else str(value))[:TEXT_MAX]
