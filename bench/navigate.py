"""`python -m bench.navigate [POLICY]`: how well does the trained policy cross forests? Writes docs/results/navigate.md.

In: the policy that ships, or a policy file. Held-out forests of several densities, with estimator, wind, noise and
varied vehicles, as many episodes each. Out: a table with 95 % intervals, and an image of some flights from above. The
section of flights over MAVLink stays as it is.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.goal_episodes import first_episodes
from bench.page_section import kept_from
from bench.row import machine
from common.files import write_whole
from common.intervals import Interval, bootstrap, rate
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate import Navigate
from policies.tasks.navigate.navigate_kernels import MEASURES
from policies.tasks.navigate.navigate_top_view import plant
from policies.tasks.top_view import GOAL, OBSTACLE, VEHICLE, Canvas

FLOWN = "## Over MAVLink"  # the section of bench.navigate_mavlink
DENSITIES = (200.0, 400.0, 600.0)
EPISODES = 500  # of each density, side by side: each environment plays one
SEED = 1_000_003  # no training run is given it
PICTURES = 6
LONGEST = 500  # decisions; time is up before
DOCS = Path(__file__).parent.parent / "docs" / "results"
_PICTURE_HALF_M = 48.0
PAGE = """\
# Navigate: success by density

The policy that ships (`policies/pretrained/navigate.pt`, on ranges) in held-out forests, {episodes} episodes of each
density, goals 60 to 85 m away: estimator, sensor noise, wind up to 6 m/s with gusts, masses and motors that differ.
Actions are the most probable ones. Made by `python -m bench.navigate`; the task is told in
[navigate.md](../explanation/navigate.md).

Rates have Wilson's 95 % interval, speeds the bootstrap's over episodes. Mean speed is the length of the way flown over
its time, standing start included, of the flights that arrived; "straight" is how much nearer the goal came over that
time.

| trees/ha | success | mean speed | straight | collisions | over the forest | out of time |
|---|---|---|---|---|---|---|
{rows}

![Flights from above](images/navigate.jpg)

Flights through 600 trees/ha: blue arrived, red ended at a tree; trunks, crowns, and goals with their radius in red.

Others: full stacks in the loop with PX4 come to about 50 % (Aero-VPA: 52 % of 180 missions; EGO-Planner in the ICST
2027 UAV track: 147 collisions in 357 flights); DiffPhysDrone reports 90 % in simulation. Their worlds, vehicles and
densities differ.

Measured on {machine}.
"""


@dataclass(frozen=True, slots=True)
class Flights:
    """What the episodes of one density came to; one element per episode."""

    outcomes: NDArray[np.int32]
    measures: NDArray[np.float32]  # (episodes, MEASURES), of the last decision
    paths: list[NDArray[np.float64]]  # (decisions, 2) north and east, of the first few
    goals_ned: NDArray[np.float32]

    def fraction(self, outcome: Outcome) -> Interval:
        return rate(self.outcomes == outcome)

    def speed(self, is_straight: bool) -> Interval:
        """Mean over the flights that arrived of the way flown, or made towards the goal, over the time [m/s]."""
        speeds = arrival_speeds(self.outcomes, self.measures, is_straight)
        return bootstrap(len(speeds), lambda rows: float(speeds[rows].mean()) if len(rows) else float("nan"))


def arrival_speeds(
    outcomes: NDArray[np.int32], measures: NDArray[np.float32], is_straight: bool = False
) -> NDArray[np.float32]:
    """Of each flight that arrived the way flown, or made towards the goal, over the time [m/s], shape (arrived,)."""
    arrived = measures[outcomes == Outcome.SUCCESS]
    made_m = arrived[:, MEASURES.index("path_m")]
    if is_straight:
        made_m = arrived[:, MEASURES.index("start_distance_m")] - arrived[:, MEASURES.index("distance_m")]
    speeds: NDArray[np.float32] = made_m / arrived[:, MEASURES.index("time_s")]
    return speeds


def build(
    settings: dict[str, str],
    trees_per_ha: float,
    episodes: int,
    name: str = "Navigate",
    seed: int = SEED,
) -> Navigate:
    """Held-out environments of one density."""
    task = build_task(name, episodes, task_settings(name, settings | {"split": "test"}))
    if not isinstance(task, Navigate):
        raise TypeError(task)
    task.set_params({"trees_per_ha": trees_per_ha})
    task.reset(seed)
    return task


def fly(policy: Policy, task: Navigate) -> Flights:
    """Every environment plays its first episode."""
    count = task.env_count
    goals_ned = task.navigation.goals_ned.numpy().copy()
    paths: list[list[NDArray[np.float64]]] = [[] for _ in range(min(PICTURES, count))]

    def note(outcomes: NDArray[np.int32]) -> None:
        pos_ned = task.rig.truth.numpy()["pos_ned"]
        for i, path in enumerate(paths):
            if outcomes[i] == Outcome.RUNNING:
                path.append(pos_ned[i, :2].astype(np.float64))

    outcomes, measures = first_episodes(policy, task, LONGEST, note)
    return Flights(outcomes, measures, [np.array(path) for path in paths], goals_ned)


def row(trees_per_ha: float, flights: Flights) -> str:
    """A line of the table."""

    def percent(outcome: Outcome) -> str:
        fraction = flights.fraction(outcome)
        return f"{100 * fraction.value:.1f} % ({100 * fraction.low:.1f} to {100 * fraction.high:.1f})"

    def speed(is_straight: bool) -> str:
        mean = flights.speed(is_straight)
        return f"{mean.value:.2f} m/s ({mean.low:.2f} to {mean.high:.2f})"

    cells = [f"{trees_per_ha:.0f}", percent(Outcome.SUCCESS), speed(is_straight=False), speed(is_straight=True)]
    cells += [percent(outcome) for outcome in (Outcome.HIT_OBSTACLE, Outcome.LOST, Outcome.TIMEOUT)]
    return "| " + " | ".join(cells) + " |"


def top_view(settings: dict[str, str], flights: Flights, trees_per_ha: float) -> NDArray[np.uint8]:
    """The first flights from above, three in a row, each with its goal straight up."""
    task = build(settings, trees_per_ha, PICTURES)  # the same forests: draws do not depend on the batch
    tiles = []
    for i, path in enumerate(flights.paths):
        goal = flights.goals_ned[i, :2].astype(np.float64)
        middle = 0.5 * goal
        half = _PICTURE_HALF_M
        canvas = Canvas((middle[1] - half, middle[1] + half), (middle[0] - half, middle[0] + half), 480)
        plant(canvas, task.worlds.map(i).trees, float(middle[0]), float(middle[1]), half)
        canvas.disc((goal[1], goal[0]), 3.0, GOAL)
        is_arrived = flights.outcomes[i] == Outcome.SUCCESS
        canvas.line([(east, north) for north, east in path], VEHICLE if is_arrived else GOAL, 3)
        canvas.disc((0.0, 0.0), 0.8, OBSTACLE)
        time_s = flights.measures[i, MEASURES.index("time_s")]
        speed = flights.measures[i, MEASURES.index("path_m")] / time_s
        canvas.text(f"{Outcome(int(flights.outcomes[i])).name.lower()}  {time_s:.1f} s  {speed:.1f} m/s")
        tiles.append(canvas.pixels)
    return np.vstack([np.hstack(tiles[k : k + 3]) for k in range(0, len(tiles) - 2, 3)])


def main(arguments: list[str]) -> int:
    policy, card = load_policy(Path(arguments[0]) if arguments else find_policy("navigate"))
    settings = {key: str(value) for key, value in card.settings.items()} | {"has_estimator": "true"}
    lines = []
    for trees_per_ha in DENSITIES:
        task = build(settings, trees_per_ha, EPISODES)
        flights = fly(policy, task)
        lines.append(row(trees_per_ha, flights))
        print(lines[-1], flush=True)
    if arguments:  # the page is of the policy that ships
        return 0
    image = top_view(settings, flights, DENSITIES[-1])
    (DOCS / "images").mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(DOCS / "images" / "navigate.jpg"), image[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, 82))
    page = PAGE.format(episodes=EPISODES, rows="\n".join(lines), machine=machine())
    write_whole(DOCS / "navigate.md", (page + kept_from((DOCS / "navigate.md").read_text(), FLOWN)).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
