"""`python -m bench.navigate_training [judge]`: Navigate's policy from nothing, three seeds, and which of them is best.

In: the recipes of its three legs. Out: results/navigate-seed-N with a run of each leg, a table of how the last ones do
in validation forests, their scans 0 to 0.2 s late, and the best as results/navigate-chosen.pt. With `judge`, or policy
files, it judges only. What is chosen by is neither trained on nor flown in the tests.
"""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.navigate import Flights, build, fly
from common.files import write_whole
from policies.learn.export.policy_file import load_policy
from policies.tasks.episode import Outcome

LEGS = ("navigate", "navigate-careful", "navigate-late")  # each goes on from the one before
SEEDS = (1, 2, 3)
LAGS_S = (0.0, 0.1, 0.2)
TREES_PER_HA = 600.0
EPISODES = 250  # of each lag
RESULTS = Path("results")
CHOSEN = RESULTS / "navigate-chosen.pt"
HEAD = (
    "| policy | " + " | ".join(f"{1000 * lag_s:.0f} ms late" for lag_s in LAGS_S) + " |\n|" + "---|" * (1 + len(LAGS_S))
)


@dataclass(frozen=True, slots=True)
class Judged:
    """A policy in validation forests: what it came to with scans of each lag."""

    path: Path
    flights: tuple[Flights, ...]

    @property
    def low(self) -> float:
        """How good it is at least: the mean of where the intervals begin."""
        return sum(flown.fraction(Outcome.SUCCESS).low for flown in self.flights) / len(self.flights)

    @property
    def row(self) -> str:
        cells = [str(self.path)]
        for flown in self.flights:
            reached, speed = flown.fraction(Outcome.SUCCESS), flown.speed(is_straight=False)
            within = f"{100 * reached.low:.1f} to {100 * reached.high:.1f}"
            cells.append(f"{100 * reached.value:.1f} % ({within}), {speed.value:.2f} m/s")
        return "| " + " | ".join(cells) + " |"


def train(seed: int) -> Path:
    """The policy of the last leg; the legs are runs in a folder of their seed."""
    folder = RESULTS / f"navigate-seed-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    for leg in LEGS:  # a recipe names the policy that it goes on from as it lies beside it
        command = [sys.executable, "-c", "from mission.cli import main; main()"]
        subprocess.run(
            [*command, "train", leg, "--run-id", leg, "--seed", str(seed), "--force"], cwd=folder, check=True
        )
    return policy_of(seed)


def policy_of(seed: int) -> Path:
    """Where the policy of a seed lies once it is trained."""
    return RESULTS / f"navigate-seed-{seed}" / "results" / LEGS[-1] / "Navigate.pt"


def judged(path: Path) -> Judged:
    """A policy in the validation forests, on the flight controller's estimate."""
    policy, card = load_policy(path)
    settings = {key: str(value) for key, value in card.settings.items()} | {"has_estimator": "true"}
    flights = []
    for lag_s in LAGS_S:
        task = build(settings, TREES_PER_HA, EPISODES, scan_lag_s=lag_s, split="validation")
        task.layout.require(policy.layout, str(path))
        flights.append(fly(policy, task))
    return Judged(path, tuple(flights))


def main(arguments: Sequence[str]) -> int:
    named = [Path(text) for text in arguments if text != "judge"]
    paths = named or [policy_of(seed) if arguments else train(seed) for seed in SEEDS]
    print(HEAD, flush=True)
    found = []
    for path in paths:
        found.append(judged(path))
        print(found[-1].row, flush=True)
    best = max(found, key=lambda each: each.low)
    print(f"chosen: {best.path}, whose intervals begin at {100 * best.low:.1f} % on average")
    if not named:
        write_whole(CHOSEN, best.path.read_bytes())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
