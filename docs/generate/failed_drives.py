"""A picture of drives that failed: the policies that ship, in the held-out worlds of docs/results/drive.md.

`python -m docs.generate.failed_drives`. Writes docs/results/images/failed-drives.png: of each policy the first drives
of the page's table that touched something, and the first that ran out of time. Another machine may round differently.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.drive import LONGEST, SEED
from bench.goal_episodes import Outcomes, first_episodes
from common.kernels import TICK_S
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.drive_top_view import LENGTH_M, WIDTH_M
from policies.tasks.episode import Outcome
from policies.tasks.flight.task import DECISION_TICKS
from policies.tasks.navigate.navigate_top_view import MOVER, build, plant
from policies.tasks.top_view import GOAL, GOOD, VEHICLE, Canvas
from sim.world.world import WorldMap

PICTURE = Path(__file__).parents[1] / "results" / "images" / "failed-drives.png"
DRIVES = 200  # of the page's 1000, the first: draws do not depend on how many there are
TOUCHED, LATE = Outcome.HIT_OBSTACLE, Outcome.TIMEOUT
SHOWN = {"park": (TOUCHED, TOUCHED, LATE), "reach": (TOUCHED, LATE, LATE)}
TILE_PX = 400
LEAST_HALF_M = 4.0
TRACE_S = 3.0  # of what moves, before the end
GAP_PX = 4  # between pictures


@dataclass(frozen=True, slots=True)
class Played:
    """What the drives of one policy were; of ended ones poses stay those of their last decision."""

    outcomes: Outcomes
    poses: NDArray[np.float64]  # (decisions, drives, 3): north, east [m], heading [rad]
    ticks: NDArray[np.int64]  # (drives,) of the last decision
    counts: NDArray[np.int64]  # (drives,) decisions


def drive_task(preset: str) -> Drive:
    """The page's first environments, at the start of their first episodes."""
    settings = task_settings("Drive", {"preset": preset, "has_estimator": True, "split": "test"})
    task = build_task("Drive", DRIVES, settings)
    if not isinstance(task, Drive):
        raise TypeError(task)
    task.reset(SEED)
    return task


def played(preset: str) -> Played:
    """Every environment plays its first episode."""
    policy, _ = load_policy(find_policy(f"drive-{preset}"))
    task = drive_task(preset)
    poses: list[NDArray[np.float64]] = []
    ticks, counts = np.zeros(DRIVES, dtype=np.int64), np.zeros(DRIVES, dtype=np.int64)

    def note(outcomes: Outcomes) -> None:
        truth, is_running = task.rig.truth.numpy(), outcomes == Outcome.RUNNING
        x, y, z, w = truth["q_ned_from_frd"].astype(np.float64).T
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        now = np.column_stack([truth["pos_ned"][:, :2], yaw])
        poses.append(now if not poses else np.where(is_running[:, None], now, poses[-1]))
        ticks[is_running] = task.rig.arrays.tick.numpy()[is_running]
        counts[is_running] += 1

    outcomes, _ = first_episodes(policy, task, LONGEST, note)
    return Played(outcomes, np.array(poses), ticks, counts)


def tile(drives: Played, i: int, world: WorldMap, goal: Any, words: str) -> NDArray[np.uint8]:
    """One drive from above, north up: its path, where it ended, and what stood and moved there then."""
    path = drives.poses[: drives.counts[i], i]
    places = np.vstack([path[:, :2], goal[None, :2]])
    low, high = places.min(axis=0), places.max(axis=0)
    (north, east), half_m = 0.5 * (low + high), max(LEAST_HALF_M, 0.5 * float((high - low).max()) + 1.5)
    canvas = Canvas((east - half_m, east + half_m), (north - half_m, north + half_m), TILE_PX)
    canvas.grid(2.0)
    plant(canvas, world.trees, north, east, half_m)
    tick = int(drives.ticks[i])
    trace = range(0, min(round(TRACE_S / TICK_S), tick), DECISION_TICKS)
    moments = [world.boxes.middle(tick - back) for back in trace]
    for k, row in enumerate(world.boxes.rows):
        if row["period_ticks"] and len(moments) > 1:
            canvas.line([(float(middle[k, 1]), float(middle[k, 0])) for middle in moments], MOVER, 2)
    build(canvas, world, tick)
    rover(canvas, goal, GOAL)
    canvas.line([(float(at[1]), float(at[0])) for at in path], VEHICLE, 2)
    rover(canvas, path[-1], VEHICLE)
    canvas.text(words)
    canvas.pixels[-GAP_PX:] = 255
    canvas.pixels[:, -GAP_PX:] = 255
    return canvas.pixels


def rover(canvas: Canvas, pose: Any, colour: Any) -> None:
    """A hull, with a line over its nose."""
    at, yaw = (float(pose[1]), float(pose[0])), float(pose[2])
    canvas.box(at, (LENGTH_M, WIDTH_M), np.pi / 2 - yaw, colour)
    canvas.line([at, (at[0] + 0.5 * np.sin(yaw), at[1] + 0.5 * np.cos(yaw))], GOOD, 2)


def main() -> None:
    rows = []
    for preset, wanted in SHOWN.items():
        drives, task = played(preset), drive_task(preset)  # the worlds of the first episodes, and their goals
        goals = task.driving.goals.numpy().astype(np.float64)
        tiles = []
        for k, outcome in enumerate(wanted):
            i = int(np.flatnonzero(drives.outcomes == outcome)[wanted[:k].count(outcome)])
            time_s = drives.counts[i] * task.decision_s
            words = f"{preset} {i}: {'touched' if outcome is TOUCHED else 'out of time'}, {time_s:.1f} s"
            print(words)
            tiles.append(tile(drives, i, task.worlds.map(i), goals[i], words))
        rows.append(np.hstack(tiles))
        ends = ", ".join(f"{int((drives.outcomes == each).sum())} {each.name.lower()}" for each in Outcome if each)
        print(f"{preset}, {DRIVES} drives: {ends}")
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(PICTURE), np.vstack(rows)[..., ::-1], (cv2.IMWRITE_PNG_COMPRESSION, 9))
    print(f"{PICTURE.name}: {PICTURE.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
