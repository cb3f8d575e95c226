"""`make mutants`: breaks safety-critical files in small ways, one at a time, and asks their unit tests.

Cosmic Ray makes the changes, in a copy of the repository. Of each file a few are drawn by a seed, so that a run is
bounded: it ends after some minutes at the latest. A mutant that survives is shown as a difference.
"""

import argparse
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from cosmic_ray.commands.init import _all_work_items
from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.work_item import TestOutcome

MAVLINK, NAVIGATOR, COMMANDER = (f"tests/unit/autopilot/{name}" for name in ("mavlink", "navigator", "commander"))
TARGETS = {
    "autopilot/mavlink/wire/signing.py": [f"{MAVLINK}/wire/test_signing.py"],
    "autopilot/mavlink/wire/number_bounds.py": [f"{MAVLINK}/wire/test_number_bounds.py"],
    "autopilot/mavlink/transport/receive_queue.py": [f"{MAVLINK}/transport/test_receive_queue.py"],
    "autopilot/navigator/target_filter.py": [f"{NAVIGATOR}/test_target_filter.py"],
    "autopilot/navigator/fence/fence.py": [f"{NAVIGATOR}/fence/test_fence.py"],
    "autopilot/navigator/fence/fence_region.py": [
        f"{NAVIGATOR}/fence/test_fence_region.py",
        f"{NAVIGATOR}/fence/test_fence.py",
    ],
    "autopilot/commander/crash_detector.py": [f"{COMMANDER}/test_crash_detector.py"],
    "autopilot/commander/battery.py": [f"{COMMANDER}/test_battery.py"],
    "autopilot/commander/arming.py": [f"{COMMANDER}/test_arming.py"],
    "autopilot/vehicles/multirotor/landing_detector.py": [
        "tests/unit/autopilot/vehicles/multirotor/test_landing_detector.py"
    ],
    "common/files.py": ["tests/unit/common/test_files.py"],
}
TIMEOUT_S = 120.0  # of the tests of one mutant: one that hangs is noticed, too


@dataclass
class Score:
    """Of one file."""

    killed: int = 0
    survived: int = 0


def main() -> None:
    """Prints a line per file, the survivors, and the score."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("files", nargs="*", help="of those that are known; default: all")
    parser.add_argument("--each", type=int, default=6, help="mutants of each file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=15.0, help="no mutant is begun after so many")
    options = parser.parse_args()
    unknown = set(options.files) - set(TARGETS)
    if unknown:
        parser.error(f"no tests are known of {', '.join(sorted(unknown))}")
    end_s = perf_counter() + 60.0 * options.minutes
    with TemporaryDirectory() as folder:
        copy_of_the_repository(Path(folder))
        os.chdir(folder)
        os.environ["PYTHONPATH"] = folder
        scores = {name: judge(name, options, end_s) for name in options.files or TARGETS}
    killed, survived = (sum(getattr(score, what) for score in scores.values()) for what in ("killed", "survived"))
    if not killed + survived:
        sys.exit("not one mutant was tried")
    share = 100.0 * killed / (killed + survived)
    print(f"{killed} of {killed + survived} mutants killed ({share:.0f} %), seed {options.seed}")


def copy_of_the_repository(folder):
    listed = subprocess.run(["git", "ls-files", "-z"], capture_output=True, check=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(name, target, follow_symlinks=False)


def judge(name, options, end_s):
    """Tries some mutants of a file."""
    rng = np.random.default_rng([options.seed, len(name)])
    mutations = [item.mutations[0] for item in _all_work_items([Path(name)], {}) if means_something(item.mutations[0])]
    command = shlex.join([sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *TARGETS[name]])
    score = Score()
    for i in rng.permutation(len(mutations))[: options.each]:
        if perf_counter() > end_s:
            break
        result = mutate_and_test([mutations[i]], command, TIMEOUT_S)
        if result.test_outcome == TestOutcome.SURVIVED:
            score.survived += 1
            print(f"survived: {result.diff}", flush=True)
        elif result.test_outcome == TestOutcome.KILLED:
            score.killed += 1
    print(f"{name}: {score.killed} killed, {score.survived} survived, of {len(mutations)} possible", flush=True)
    return score


def means_something(mutation):
    """Whether it changes what is done: not a type, which nobody asks for at run time."""
    line = mutation.module_path.read_text().splitlines()[mutation.start_pos[0] - 1]
    return "BitOr" not in mutation.operator_name or ("->" not in line and "None" not in line)


if __name__ == "__main__":
    main()
