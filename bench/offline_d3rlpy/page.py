"""The section of docs/results/offline.md that shows our offline training beside d3rlpy's."""

import json
import textwrap
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from bench.page_section import with_section
from common.files import write_whole

PAGE = Path(__file__).parents[2] / "docs" / "results" / "offline.md"
RESULTS = PAGE.with_name("offline-d3rlpy.jsonl")
ALIKE = PAGE.with_name("offline-d3rlpy-alike.json")
HEADING = "## Beside d3rlpy"
_NAMES = {"iql": "IQL", "td3_bc": "TD3+BC"}
_STUDENT = {2: 4.303, 3: 2.776, 4: 2.447, 5: 2.306}
"""Two-sided 95 % of Student's t for the difference of two means of so many seeds each, of 2 (seeds - 1) degrees."""
MOST_SEEDS = max(_STUDENT)
WIDTH = 120


def difference(row: dict[str, Any]) -> tuple[float, float, float]:
    """Our mean score less d3rlpy's, and its 95 % interval over the seeds; one seed has none, which is all numbers."""
    ours, theirs = row["scores"], row["d3rlpy_scores"]
    apart = fmean(ours) - fmean(theirs)
    if len(ours) < 2:
        return apart, float("-inf"), float("inf")
    half = _STUDENT[len(ours)] * ((stdev(ours) ** 2 + stdev(theirs) ** 2) / len(ours)) ** 0.5
    return apart, apart - half, apart + half


def _mean(values: list[float]) -> str:
    return f"{fmean(values):.1f}" + (f" ± {stdev(values):.1f}" if len(values) > 1 else "")


def _apart(row: dict[str, Any]) -> str:
    apart, low, high = difference(row)
    return f"{apart:+.1f}" + (f" ({low:.1f} to {high:.1f})" if len(row["scores"]) > 1 else "")


def _of_dataset(row: dict[str, Any]) -> str:
    """None: its rewards weigh otherwise than the score."""
    return "-" if row["dataset_score"] is None else f"{row['dataset_score']:.1f}"


def _ratio(row: dict[str, Any]) -> float:
    return sum(row["d3rlpy_cpu_s"]) / sum(row["cpu_s"])


def _verdict(rows: list[dict[str, Any]]) -> str:
    """In how many rows we are at least as good, and what the others are."""
    of_each = " and ".join(
        f"{sum(difference(row)[0] >= 0.0 for row in of)} of {len(of)} with {_NAMES[name]}"
        for name in _NAMES
        if (of := [row for row in rows if row["trainer"] == name])
    )
    less = [row for row in rows if difference(row)[0] < 0.0]
    told = [row for row in rows if len(row["scores"]) > 1]
    counts = {
        "of the others are within noise": sum(difference(row)[2] >= 0.0 for row in less if row in told),
        "of the others are below it": sum(difference(row)[2] < 0.0 for row in less),
        "of all are above it": sum(difference(row)[1] > 0.0 for row in rows),
    }
    words = f"Our mean score is at least d3rlpy's in {len(rows) - len(less)} of {len(rows)} rows: {of_each}."
    if told:
        found = ", ".join(f"{count} {what}" for what, count in counts.items())
        words += (
            f" By the 95 % interval of the difference (Student's, over the seeds of both; few leave it wide) {found}."
        )
        mean = sum(difference(row)[0] for row in rows) / len(rows)
        words += (
            f" Over all rows, which share datasets, ours is {abs(mean):.1f} points {'less' if mean < 0.0 else 'more'}."
        )
    if len(told) < len(rows):
        words += f" {len(rows) - len(told)} rows are of one seed, which does not tell a difference from noise."
    return words


def _alike(apart: dict[str, float]) -> str:
    """That both make the same steps, of what `bench.offline_d3rlpy.alike` wrote."""
    most = max(value for name, value in apart.items() if name not in ("steps", "iql policy"))
    return (
        "Both make the same steps: from the same weights and minibatches, without noise on TD3's targets, "
        f"{apart['steps']} of them leave TD3+BC's policy and all critics and values off d3rlpy's by at most {most:.1g} "
        "of the way that they have gone (`bench/offline_d3rlpy/alike.py`), and IQL's policy by "
        f"{apart['iql policy']:.1g}: d3rlpy bounds the deviation of its actions by a sigmoid. It begins with 0.22, we "
        "with 1, as IQL's authors do."
    )


def write_section(rows: list[dict[str, Any]]) -> None:
    """Writes it, in place of the one that is there."""
    version, steps, hidden = rows[0]["d3rlpy"], rows[0]["steps"], rows[0]["hidden"]
    ratios = {name: [_ratio(row) for row in rows if row["trainer"] == name] for name in _NAMES}
    spans = " and ".join(
        f"{min(found):.1f} to {max(found):.1f} times for {_NAMES[name]}" for name, found in ratios.items() if found
    )
    text = (
        f"d3rlpy {version} and we learn from the same datasets (`bench/offline_d3rlpy/cases.py`; d3rlpy from their "
        f"D4RL export): {steps:,} gradient steps of 256 decisions, 2 layers of {hidden}, swish, discount 0.99, Adam at "
        "3e-4, one thread. A row is as many trainings by both as it has seeds; scores are their means and deviations, "
        "0 at random actions and 100 at the pilot without noise, which is judged as they are. Where the pilot is a "
        "policy that ships (of `drive-park` the one before it met late scans), the rewards to learn from weigh as in "
        "its training, and the score as the task has it by itself. Times are of the processor, for the gradient steps "
        f"alone; d3rlpy takes longer than we do, {spans}. {_verdict(rows)}"
    )
    lines = [
        HEADING,
        "",
        "```sh",
        "python3 -m venv d3rlpy-env && d3rlpy-env/bin/pip install torch==2.13.0 d3rlpy",
        ".venv/bin/python -m bench.offline_d3rlpy.alike --d3rlpy-python d3rlpy-env/bin/python",
        ".venv/bin/python -m bench.offline_d3rlpy --d3rlpy-python d3rlpy-env/bin/python",
        "```",
        "",
        *textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False),
        "",
        "| dataset | learnt by | its score | seeds | ours | d3rlpy | ours less d3rlpy | time, d3rlpy / ours |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['case']}, {row['quality']} | {_NAMES[row['trainer']]} | {_of_dataset(row)} "
        f"| {len(row['scores'])} | {_mean(row['scores'])} | {_mean(row['d3rlpy_scores'])} | {_apart(row)} "
        f"| {_ratio(row):.1f} |"
        for row in sorted(rows, key=lambda row: list(_NAMES).index(row["trainer"]))
    ]
    lines += [
        "",
        *textwrap.wrap(_alike(json.loads(ALIKE.read_text(encoding="utf-8"))), WIDTH, break_on_hyphens=False),
        "",
        "What differs: d3rlpy leaves out the last decision of an episode that was cut, since it does not keep what",
        "was seen after it; its initial weights and its order of minibatches are other draws; its observations are",
        "normalised beforehand, which we do in each step. Policies of both are played by our simulator, on the same",
        "episodes; that they are d3rlpy's is checked by their actions. Parking1's actions are choices, which TD3+BC",
        "has not, and d3rlpy's IQL neither; Drive's parking stands for it. Rows:",
        "[offline-d3rlpy.jsonl](offline-d3rlpy.jsonl).",
        "",
    ]
    write_whole(PAGE, with_section(PAGE.read_text(encoding="utf-8"), HEADING, "\n".join(lines)).encode())
