"""The section of docs/results/offline.md that shows our offline training beside d3rlpy's."""

from pathlib import Path
from typing import Any

from bench.page_section import with_section
from common.files import write_whole

PAGE = Path(__file__).parents[2] / "docs" / "results" / "offline.md"
RESULTS = PAGE.with_name("offline-d3rlpy.jsonl")
HEADING = "## Beside d3rlpy"
_NAMES = {"iql": "IQL", "td3_bc": "TD3+BC"}


def write_section(rows: list[dict[str, Any]]) -> None:
    """Writes it, in place of the one that is there."""
    version, steps, hidden = rows[0]["d3rlpy"], rows[0]["steps"], rows[0]["hidden"]
    ratios = {name: [row["d3rlpy_cpu_s"] / row["cpu_s"] for row in rows if row["trainer"] == name] for name in _NAMES}
    spans = "; ".join(
        f"{_NAMES[name]} {min(found):.1f} to {max(found):.1f} times" for name, found in ratios.items() if found
    )
    wins = sum(row["score"] >= row["d3rlpy_score"] for row in rows)
    lines = [
        HEADING,
        "",
        "```sh",
        "python3 -m venv d3rlpy-env && d3rlpy-env/bin/pip install torch==2.13.0 d3rlpy",
        ".venv/bin/python -m bench.offline_d3rlpy --d3rlpy-python d3rlpy-env/bin/python",
        "```",
        "",
        f"d3rlpy {version} and we learn from the same datasets (`bench/offline_d3rlpy/cases.py`; d3rlpy from their",
        f"D4RL export): {steps:,} gradient steps of 256 decisions, 2 layers of {hidden}, swish, discount 0.99, Adam at",
        "3e-4, one thread, one seed. Scores are 0 at random actions and 100 at the pilot without noise. Times are",
        "of the processor, for the gradient steps alone, in one run; d3rlpy takes as long as ours",
        f"{spans}. Our score is at least d3rlpy's in {wins} of {len(rows)} rows.",
        "",
        "| dataset | learnt by | its score | ours | d3rlpy | time, d3rlpy / ours |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        ratio = row["d3rlpy_cpu_s"] / row["cpu_s"]
        lines.append(
            f"| {row['case']}, {row['quality']} | {_NAMES[row['trainer']]} | {row['dataset_score']:.1f} "
            f"| {row['score']:.1f} | {row['d3rlpy_score']:.1f} | {ratio:.1f} |"
        )
    lines += [
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
