"""`python -m bench.drive [batch] [POLICY …]`: how well does a rover park, and drive to poses?

In: the policies that ship, or policy files of Drive. Held-out worlds with estimator, wind, noise and varied vehicles,
as many episodes each. Out: a table with 95 % intervals; then, unless `batch` is asked for alone, the same over MAVLink
(`drive_mavlink.py`). Of what ships both are written into docs/results/drive.md, of others they are printed.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.goal_episodes import first_episodes
from bench.page_section import kept_from
from bench.row import machine
from common.files import write_whole
from common.intervals import bootstrap, rate
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.drive_kernels import MEASURES
from policies.tasks.episode import Outcome

AIMS = {"park": "97 %", "reach": "95 %"}
FLOWN = "## Over MAVLink"  # the section of bench.drive_mavlink
EPISODES = 1000  # side by side: each environment plays one
SEED = 1_000_003  # no training run is given it
LONGEST = 1500  # decisions; time is up before
PAGE_FILE = Path(__file__).parent.parent / "docs" / "results" / "drive.md"
PAGE = """\
# Drive: parking, and poses on hills

Policies of a rover ([drive.md](../explanation/drive.md)) in held-out worlds, {episodes} episodes of each kind: on the
estimator, with sensor noise, wind and gusts, and masses, motors and tyres that differ. Success is to stand within 0.3 m
and 10 degrees of the goal, slower than 0.3 m/s, without having touched anything. Actions are the most probable ones;
rates have Wilson's 95 % interval, times the bootstrap's. Made by `python -m bench.drive`, of the policies that ship;
`make reproduce-drive` trains three seeds of each from nothing, chooses among them, and judges what it has chosen.
[drive.md](../explanation/drive.md#how-well) tells how those that ship were trained.

| policy | aim | success | touched | out of time | other | time to the goal |
|---|---|---|---|---|---|---|
{rows}

![Drives that failed, from above](images/failed-drives.png)

Drives of the table that failed (`python -m docs.generate.failed_drives`), by their numbers among the {episodes}: rover
and path in blue, goal in red, noses in green, carts in orange with their last 3 s, on a grid of 2 m. Parking,
it meets a cart before its spot, another in the aisle, and goes to and fro before an aisle with two until time is up. On
the course it passes a wall too close, and twice comes to the goal but not into its pose before time is up.

Measured on {machine}.
"""


@dataclass(frozen=True, slots=True)
class Drives:
    """What the episodes came to; one element per episode."""

    outcomes: NDArray[np.int32]
    times_s: NDArray[np.float32]


def judged(policy: Policy, preset: str, count: int = EPISODES, seed: int = SEED, scan_lag_s: float = 0.0) -> Drives:
    """Every environment plays its first episode, its scans so late [s]."""
    settings = {"preset": preset, "has_estimator": True, "split": "test"}
    task = build_task("Drive", count, task_settings("Drive", settings))
    if not isinstance(task, Drive):
        raise TypeError(task)
    task.set_params({"scan_lag_s": scan_lag_s})
    task.reset(seed)
    outcomes, measures = first_episodes(policy, task, LONGEST)
    return Drives(outcomes, measures[:, MEASURES.index("time_s")])


def row(preset: str, drives: Drives) -> str:
    """A line of the table."""
    named = (Outcome.SUCCESS, Outcome.HIT_OBSTACLE, Outcome.TIMEOUT)
    cells = [preset, AIMS[preset]]
    for is_it in (*(drives.outcomes == outcome for outcome in named), ~np.isin(drives.outcomes, named)):
        fraction = rate(is_it)
        cells.append(f"{100 * fraction.value:.1f} % ({100 * fraction.low:.1f} to {100 * fraction.high:.1f})")
    times = drives.times_s[drives.outcomes == Outcome.SUCCESS]
    mean = bootstrap(len(times), lambda rows: float(times[rows].mean()) if len(rows) else float("nan"))
    cells.append(f"{mean.value:.1f} s ({mean.low:.1f} to {mean.high:.1f})")
    return "| " + " | ".join(cells) + " |"


def main(arguments: list[str]) -> int:
    named = [text for text in arguments if text != "batch"]
    try:
        paths = [find_policy(text) for text in named or [f"drive-{preset}" for preset in AIMS]]
    except CheckpointError as error:
        print(error)
        return 2
    lines, policies = [], []
    for path in paths:
        policy, card = load_policy(path)
        preset = str(card.settings["preset"])
        policies.append((preset, path))
        lines.append(row(preset, judged(policy, preset)))
        print(lines[-1], flush=True)
    if not named:
        page = PAGE.format(episodes=EPISODES, rows="\n".join(lines), machine=machine())
        write_whole(PAGE_FILE, (page + kept_from(PAGE_FILE.read_text(), FLOWN)).encode())
    if "batch" not in arguments:
        from bench.drive_mavlink import SCENES, measured, write_section  # which judges by this module

        if not named:
            write_section(dict(policies), SCENES)
            return 0
        for preset, path in policies:
            print(measured(preset, load_policy(path)[0], str(path), SCENES), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
