"""Draws docs/images/owner.png, an owner among trees and their track: `python -m docs.generate.owner_picture`.

Three minutes of a running owner. A camera 2 m behind sees them 15 s out of 20, with the errors the tracker expects.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection

from common.attitude import product, quat_of
from common.kernels import TICK_US
from policies.tasks.follow_me.world import FOLLOW_WORLD
from policies.tracker import OwnerTracker, PhoneReport, Sighting, TrackerSettings
from sim.walking_owner import Owner
from sim.world.people import CHEST_M, RUN_SPEED_M_S, person_model
from sim.world.world import WorldMap, build_world

PICTURE = Path(__file__).parents[1] / "images" / "owner.png"
SECONDS, SEED = 180, 8
DECISION_TICKS = 25
SEEN, OF = 150, 200  # decisions
Q_FRD_FROM_RDF = (0.5, 0.5, 0.5, 0.5)


def follow(world: WorldMap) -> dict[str, np.ndarray]:
    """Path, speed, reports and track of one owner, rows 0.1 s apart."""
    owner = Owner(world, [[3.0, 0.0, 0.0]], SEED, model=person_model(RUN_SPEED_M_S))
    tracker, rng, settings = OwnerTracker(), np.random.default_rng(SEED), TrackerSettings()
    rows: dict[str, list[np.ndarray]] = {name: [] for name in ("pos", "speed", "report", "track", "std", "is_seen")}
    for k in range(SECONDS * 10):
        time_us = k * DECISION_TICKS * TICK_US
        has_report = owner.step_to(k * DECISION_TICKS)
        person, fix = owner.people.numpy()[0], owner.phones.numpy()[0]["fix"]
        if has_report:
            tracker.hear(time_us, PhoneReport(int(fix["time_us"]), fix["pos_ned"].tolist(), fix["vel_ned"].tolist()))
        chest = person["pos_ned"].astype(np.float64) - [0.0, 0.0, float(CHEST_M)]
        if k % OF < SEEN:
            yaw = float(person["heading_rad"])
            camera = chest - 2.0 * np.array([np.cos(yaw), np.sin(yaw), 0.0])
            noise = rng.standard_normal(3) * [*(2 * [settings.direction_std_rad]), settings.range_std_m + 0.1]
            q = product(quat_of(yaw, 0.0), Q_FRD_FROM_RDF)
            tracker.see(time_us, Sighting(noise[0], noise[1], 2.0 + noise[2], camera.tolist(), q))
        track = tracker.at(time_us)
        rows["pos"].append(chest)
        rows["speed"].append(np.asarray(person["speed"]))
        rows["report"].append(fix["pos_ned"].copy() if has_report else np.full(3, np.nan))
        rows["track"].append(track.pos_ned)
        rows["std"].append(np.sqrt(np.trace(track.pos_cov[:2, :2])))
        rows["is_seen"].append(np.asarray(k % OF < SEEN))
    return {name: np.array(values) for name, values in rows.items()}


def draw(world: WorldMap, rows: dict[str, np.ndarray]) -> None:
    """Writes the image."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415  after the choice of the backend

    figure, (plan, over_time) = plt.subplots(1, 2, figsize=(10.0, 5.6), width_ratios=(0.62, 1.0), layout="constrained")
    trees = world.trees
    places = np.column_stack([trees["east"], trees["north"]])
    for radius, colour in ((trees["crown_radius"], "#dcebd5"), (trees["trunk_radius"] + 0.25, "#7a5230")):
        circles = EllipseCollection(
            2 * radius, 2 * radius, np.zeros(len(radius)), units="xy", offsets=places, offset_transform=plan.transData
        )
        circles.set_facecolor(colour)
        plan.add_collection(circles)
    path = rows["pos"][:, 1::-1]
    lines = LineCollection(np.stack([path[:-1], path[1:]], axis=1), array=rows["speed"][1:], cmap="plasma", lw=4.5)
    plan.add_collection(lines)
    plan.plot(rows["report"][:, 1], rows["report"][:, 0], ".", color="#3b76b5", ms=2.5, label="phone's reports")
    plan.plot(rows["track"][:, 1], rows["track"][:, 0], "-", color="black", lw=0.7, label="track")
    low, high = path.min(axis=0) - [22.0, 6.0], path.max(axis=0) + 6.0
    plan.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="east [m]", ylabel="north [m]", aspect="equal")
    plan.legend(loc="lower left", fontsize=8)
    figure.colorbar(lines, ax=plan, label="the owner's speed [m/s]", shrink=0.8)
    seconds = np.arange(len(path)) * 0.1
    hidden = ~rows["is_seen"].astype(bool)
    over_time.fill_between(seconds, 0, 1, where=hidden, transform=over_time.get_xaxis_transform(), color="#eeeeee")
    for name, colour, mark, label in (
        ("report", "#3b76b5", ".", "phone, as it comes"),
        ("track", "black", "-", "track"),
    ):
        off = np.linalg.norm((rows[name] - rows["pos"])[:, :2], axis=1)
        over_time.plot(seconds, off, mark, color=colour, ms=3, lw=1.0, label=label)
    over_time.plot(seconds, rows["std"], "-", color="#c44536", lw=0.7, label="track's own standard deviation")
    over_time.set(xlabel="time [s]; grey: the camera sees nobody", ylabel="horizontal error [m]", xlim=(0, SECONDS))
    over_time.set_ylim(0.0, 5.5)
    over_time.legend(loc="upper right", fontsize=8)
    figure.savefig(PICTURE, dpi=85)


def main() -> None:
    """Walks, tracks and draws."""
    world = build_world(FOLLOW_WORLD.model_copy(update={"seed": 5}))
    draw(world, follow(world))


if __name__ == "__main__":
    main()
