"""Pictures of flights that failed: the policy that ships, in harder conditions.

`python -m docs.generate.failure_plots`. Writes docs/results/images/failures.png. Every flight is one of the table in
docs/results/harder.md that is of the usual vehicle; another machine may round differently, and a flight then end
otherwise.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from mission.flight_config import FlightConfig
from mission.follow.benchmark.conditions import BY_NAME
from mission.follow.benchmark.flights import SECONDS, flight_of
from mission.follow.follow_scoring import FollowWatch
from mission.follow.lockstep import flight_with_companion, follow_for
from policies.companion.guard.settings import GuardSettings
from policies.companion.names import FOLLOWER
from policies.companion.skills.load_skill import load_follower
from policies.tasks.follow_me.track import Ranges
from policies.tasks.follow_me.tracked.keep_off import SLOW_S

PLOT = Path(__file__).parents[1] / "results" / "images" / "failures.png"
FLIGHTS = (("crossed", 3951063), ("twins", 3951055), ("gone-3-run-silent", 3951043))
USUAL = {"MPC_ACC_HOR": 4.0, "MPC_JERK_MAX": 20.0}
SHOWN_S = 16.0
BEFORE_S = 4.0  # of these are from before it left the band
MARKS_S = 4.0
BAND = Ranges()


@dataclass
class Seen:
    """What the truth was, ten times a second."""

    title: str
    trees: Any
    vehicle: list[Any] = field(default_factory=list)  # [m] north, east
    people: list[Any] = field(default_factory=list)  # the same, the owner first; NaN where nobody is
    distance_m: list[float] = field(default_factory=list)  # to the owner's chest
    silence_s: list[float] = field(default_factory=list)  # since the guard saw the owner
    has_hit: bool = False


def _as_flown(config: FlightConfig) -> FlightConfig:
    """With the vehicle of the table's rows."""
    return config.model_copy(update={"parameters": config.parameters | USUAL})


def fly(name: str, seed: int) -> Seen:
    """One flight of the benchmark, watched."""
    condition = BY_NAME[name]
    flight, companion = flight_with_companion(
        _as_flown(flight_of(condition, seed)), load_follower(FOLLOWER), guard=GuardSettings()
    )
    seen = Seen(f"{condition.title},\nseed {seed}", flight.world.trees)

    def look(watch: FollowWatch) -> None:
        if watch.sample_count <= len(seen.vehicle):
            return
        people = flight.owner.cast.rows.drawn.numpy()[0]
        there = np.where((people["stature_m"] > 0.0)[:, None], people["pos_ned"], np.nan)
        there[0] = people["pos_ned"][0]
        vehicle = flight.rig.rows["truth"][0]["pos_ned"]
        seen.vehicle.append(np.array(vehicle[:2]))
        seen.people.append(there[:, :2])
        seen.distance_m.append(watch.track().distance_m[-1])
        seen.silence_s.append(companion.skill.guard.senses.silence_s(companion.vehicle.own))

    watch = follow_for(flight, companion, SECONDS, look)
    seen.has_hit = bool(watch.track().is_collided.any())
    return seen


def moment(seen: Seen) -> int:
    """The last sample that is shown: of all, if something was hit; else some time into the longest out of the band."""
    if seen.has_hit:
        return len(seen.vehicle) - 1
    longest = run = began = 0
    for k, far_m in enumerate(seen.distance_m):
        run = 0 if BAND.near_m <= far_m <= BAND.far_m else run + 1
        if run > longest:
            longest, began = run, k + 1 - run
    return min(began + round((SHOWN_S - BEFORE_S) / 0.1), len(seen.vehicle) - 1)


def draw(seen: Seen, above: Any, below: Any) -> None:
    """From above, and the distance over time."""
    last = moment(seen)
    first = max(last - round(SHOWN_S / 0.1), 0)
    shown = slice(first, last + 1)
    vehicle, people = np.array(seen.vehicle)[shown], np.array(seen.people)[shown]
    for other in people[:, 1:].swapaxes(0, 1):
        above.plot(other[:, 1], other[:, 0], color="tab:gray", linewidth=1.0, label="_")
    above.plot(people[:, 0, 1], people[:, 0, 0], color="tab:orange", label="owner")
    above.plot(vehicle[:, 1], vehicle[:, 0], color="tab:blue", label="vehicle")
    marks = slice(None, None, round(MARKS_S / 0.1))
    for at, of in zip(vehicle[marks], people[marks, 0], strict=True):
        above.plot([at[1], of[1]], [at[0], of[0]], color="black", linewidth=0.7, linestyle=":")
    if seen.has_hit:
        above.plot(vehicle[-1, 1], vehicle[-1, 0], "*", color="tab:red", markersize=14, label="hit")
    low, high = (edge(np.vstack([vehicle, people[:, 0]]), axis=0) for edge in (np.nanmin, np.nanmax))
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max()) + 1.5
    for tree in seen.trees:
        north, east = float(tree["north"]), float(tree["east"])
        if abs(north - middle[0]) < half + 1.0 and abs(east - middle[1]) < half + 1.0:
            above.add_patch(mpl.patches.Circle((east, north), float(tree["trunk_radius"]), color="tab:green"))
    above.set(xlim=(middle[1] - half, middle[1] + half), ylim=(middle[0] - half, middle[0] + half), aspect="equal")
    above.set(title=seen.title, xlabel="east [m]", ylabel="north [m]")
    above.title.set_fontsize("medium")
    above.legend(loc="best", fontsize="small")
    time_s = 0.1 * np.arange(first, last + 1)
    below.axhspan(BAND.near_m, BAND.far_m, color="tab:green", alpha=0.15, linewidth=0.0)
    unseen = np.array(seen.silence_s)[shown] > SLOW_S
    below.fill_between(
        time_s, 0.0, 1.0, where=unseen, transform=below.get_xaxis_transform(), color="tab:gray", alpha=0.3
    )
    below.plot(time_s, np.array(seen.distance_m)[shown], color="tab:blue")
    below.set(xlabel="time [s]", ylabel="to the chest [m]", ylim=(0.0, None))


def main() -> None:
    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415  after the choice of the backend

    figure, axes = plt.subplots(
        2, len(FLIGHTS), figsize=(4.2 * len(FLIGHTS), 6.0), height_ratios=(2.6, 1.0), layout="constrained"
    )
    for column, (name, seed) in enumerate(FLIGHTS):
        seen = fly(name, seed)
        draw(seen, *axes[:, column])
        print(f"{name}, {seed}: {'hit' if seen.has_hit else 'nothing hit'}, {0.1 * moment(seen):.1f} s")
    figure.savefig(PLOT, dpi=90)
    print(f"{PLOT.name}: {PLOT.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
