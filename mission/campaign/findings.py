"""What a campaign has found, as JSON: `summary.json`."""

import json
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from common.files import write_whole
from mission.campaign.campaign import Campaign
from mission.campaign.runs import Record
from mission.campaign.statistics import Fraction, Sensitivity, sensitivities, success_of, worst_first
from mission.campaign.varying import KeyFault, varied
from mission.scenario.keeping import keep_scenario
from mission.scenario.runner import RESULT_FILE

WORST_COUNT = 10
SUMMARY_FILE, WORST_FOLDER = "summary.json", "worst"


@dataclass(frozen=True, slots=True)
class WorstRun:
    """One of the worst, and how it is flown again."""

    record: Record
    command: str
    """"": it cannot be flown at all."""


@dataclass(frozen=True, slots=True)
class Findings:
    """All of it."""

    campaign: Campaign
    samples: tuple[Record, ...]
    success: Fraction
    sensitivities: tuple[Sensitivity, ...]
    searches: tuple[Any, ...]
    worst: tuple[WorstRun, ...]

    @property
    def is_met(self) -> bool:
        """Whether as many have passed as are required."""
        least = self.campaign.success_min
        return least is None or self.success.value >= least

    def as_json(self) -> dict[str, Any]:
        lost = [record for record in self.samples if record.is_lost]
        return {
            "name": self.campaign.name,
            "about": self.campaign.about,
            "runs": len(self.samples),
            "success": {"fraction": self.success.value, **asdict(self.success)},
            "require": self.campaign.require,
            "is_met": self.is_met,
            "lost_runs": len(lost),
            "simulated_s": sum(record.simulated_s for record in self.samples),
            "cpu_s": sum(record.cpu_s for record in self.samples),
            "sensitivity": [asdict(each) for each in self.sensitivities],
            "searches": [_search_json(each) for each in self.searches],
            "worst": [{**each.record.as_json(), "command": each.command} for each in self.worst],
        }


def findings_of(campaign: Campaign, samples: list[Record], searches: list[Any], folder: Path) -> Findings:
    """What was found; the worst runs are written down as scenarios, which `honeyguide test` flies again."""
    every = {record.key: record for record in samples}
    for search in searches:
        every |= {record.key: record for record in getattr(search, "records", ())}
    worst = worst_first(list(every.values()))[:WORST_COUNT]
    _drop_others(folder / WORST_FOLDER, worst)
    return Findings(
        campaign,
        tuple(samples),
        success_of(samples),
        tuple(sensitivities(campaign, samples)),
        tuple(searches),
        tuple(WorstRun(record, _kept(campaign, record, folder)) for record in worst),
    )


def _drop_others(folder: Path, worst: list[Record]) -> None:
    """Takes away what an earlier end has left: runs that are no longer among the worst, and those without all logs."""
    names = {record.order.folder for record in worst}
    for own in folder.glob("*"):
        if own.name not in names or not has_logs(own):
            shutil.rmtree(own, ignore_errors=True)


def has_logs(own: Path) -> bool:
    """Whether a run was flown again with its logs to its end, where its result is written."""
    return (own / RESULT_FILE).is_file()


def _kept(campaign: Campaign, record: Record, folder: Path) -> str:
    scenario = campaign.flown
    own = folder / WORST_FOLDER / record.order.folder
    try:
        exact = varied(scenario, record.values)
    except KeyFault:
        return ""
    own.mkdir(parents=True, exist_ok=True)
    return keep_scenario(own, exact, record.seed)


def _search_json(found: Any) -> dict[str, Any]:
    given = {key: value for key, value in asdict(found).items() if key not in ("records", "worst", "brackets")}
    brackets = getattr(found, "brackets", ())
    if brackets:
        given["brackets"] = [
            {"seed": b.seed, "passes": b.passes, "fails": b.fails, "has_boundary": b.has_boundary} for b in brackets
        ]
    return {"kind": type(found).__name__, "sentence": found.sentence, **given}


def write_summary(findings: Findings, folder: Path) -> None:
    """Writes `summary.json`."""
    write_whole(folder / SUMMARY_FILE, (json.dumps(findings.as_json(), indent=1, ensure_ascii=False) + "\n").encode())


def fraction_text(fraction: Fraction) -> str:
    """A fraction as people read it."""
    interval = f"95 % interval {fraction.low:.1%} to {fraction.high:.1%}"
    return f"{fraction.value:.1%} ({fraction.count} of {fraction.total}; {interval})"
