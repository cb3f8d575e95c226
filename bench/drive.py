"""`python -m bench.drive [judge] [batch]`: trains Drive's policies, and judges them. Writes docs/results/drive.md.

In: the recipes `drive-park`, `drive-park-careful` and `drive-reach`; with `judge` the policies that ship. Held-out
worlds with estimator, wind, noise and varied vehicles, as many episodes each. Out: the policies in `results/drive/`,
and a table with 95 % intervals; then, unless `batch` is asked for alone, the same over MAVLink (`drive_mavlink.py`).
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.cars.run import Curve, changed
from bench.goal_episodes import first_episodes
from bench.page_section import kept_from
from bench.row import machine
from common.files import write_whole
from common.intervals import bootstrap, rate
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.export.policy_file import load_policy, save_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.learn.networks.policy import Policy
from policies.learn.trainer import train
from policies.tasks.catalogue import build_task, settings_of, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.drive_kernels import MEASURES
from policies.tasks.episode import Outcome

LEGS = {"park": ("drive-park", "drive-park-careful"), "reach": ("drive-reach",)}
AIMS = {"park": "97 %", "reach": "95 %"}
FLOWN = "## Over MAVLink"  # the section of bench.drive_mavlink
EPISODES = 1000  # side by side: each environment plays one
SEED = 1_000_003  # no training run is given it
TRAINING_SEED = 1
LONGEST = 1500  # decisions; time is up before
FOLDER = Path("results") / "drive"
PAGE_FILE = Path(__file__).parent.parent / "docs" / "results" / "drive.md"
PAGE = """\
# Drive: parking, and poses on hills

Policies of a rover ([drive.md](../explanation/drive.md)) in held-out worlds, {episodes} episodes of each kind: on the
estimator, with sensor noise, wind and gusts, and masses, motors and tyres that differ. Success is to stand within 0.3 m
and 10 degrees of the goal, slower than 0.3 m/s, without having touched anything. Actions are the most probable ones;
rates have Wilson's 95 % interval, times the bootstrap's. Made by `make reproduce-drive`, which trains each from nothing
by its recipes (`honeyguide train drive-park`, then `drive-park-careful`; `drive-reach`) and judges what comes of it;
without a time of training the policies that ship are judged, of which
[drive.md](../explanation/drive.md#how-well) tells how they were trained.

| policy | aim | success | touched | out of time | other | time to the goal | trained in |
|---|---|---|---|---|---|---|---|
{rows}

Measured on {machine}.
"""


@dataclass(frozen=True, slots=True)
class Drives:
    """What the episodes came to; one element per episode."""

    outcomes: NDArray[np.int32]
    times_s: NDArray[np.float32]


def trained(preset: str) -> tuple[Path, float]:
    """A policy trained anew, leg after leg, and how long that took [s]."""
    path, took_s = FOLDER / f"drive-{preset}.pt", 0.0
    for leg, name in enumerate(LEGS[preset]):
        config = load_config(recipe(name)).config
        changes: dict[str, Any] = {
            "env_settings.seed": TRAINING_SEED,
            "checkpoint_settings.run_id": name,
            "checkpoint_settings.results_dir": str(FOLDER),
            "checkpoint_settings.force": True,
        }
        if leg > 0:
            changes["behavior.init_path"] = str(path)
        config = changed(config, changes)
        build_task("Drive", 1, settings_of("Drive", config.env_settings.env_args)).reset(0)  # compiles, off the clock
        result = train(config, Curve(config.behavior.max_steps))
        save_policy(path, *load_policy(result.policy), is_half=True)
        took_s += result.progress.elapsed_s
    return path, took_s


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


def row(preset: str, drives: Drives, took_s: float | None) -> str:
    """A line of the table."""
    named = (Outcome.SUCCESS, Outcome.HIT_OBSTACLE, Outcome.TIMEOUT)
    cells = [preset, AIMS[preset]]
    for is_it in (*(drives.outcomes == outcome for outcome in named), ~np.isin(drives.outcomes, named)):
        fraction = rate(is_it)
        cells.append(f"{100 * fraction.value:.1f} % ({100 * fraction.low:.1f} to {100 * fraction.high:.1f})")
    times = drives.times_s[drives.outcomes == Outcome.SUCCESS]
    mean = bootstrap(len(times), lambda rows: float(times[rows].mean()) if len(rows) else float("nan"))
    cells.append(f"{mean.value:.1f} s ({mean.low:.1f} to {mean.high:.1f})")
    cells.append("-" if took_s is None else f"{took_s / 60.0:.1f} min")
    return "| " + " | ".join(cells) + " |"


def main(arguments: list[str]) -> int:
    lines, policies = [], {}
    for preset in AIMS:
        try:
            path, took_s = (find_policy(f"drive-{preset}"), None) if "judge" in arguments else trained(preset)
        except CheckpointError as error:
            print(error)
            continue
        policy, _ = load_policy(path)
        policies[preset] = path
        lines.append(row(preset, judged(policy, preset), took_s))
        print(lines[-1], flush=True)
    if lines:
        page = PAGE.format(episodes=EPISODES, rows="\n".join(lines), machine=machine())
        write_whole(PAGE_FILE, (page + kept_from(PAGE_FILE.read_text(), FLOWN)).encode())
    if lines and "batch" not in arguments:
        from bench.drive_mavlink import SCENES, write_section  # which judges by this module

        write_section(policies, SCENES)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
