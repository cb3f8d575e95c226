"""A picture of parking that failed: the improved policies that ship, on the new spots of docs/results/cars.md.

`python -m docs.generate.failed_parking`. Writes docs/results/images/failed-parking.png: of each policy the first of the
page's episodes that failed in each way, and the next that failed. Another machine may round differently.
"""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray

from bench.cars.run import HELD_OUT_SEED
from policies.learn.evaluate import ENVIRONMENTS
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.rollout.task_tensors import TaskTensors
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.episode import Outcome
from policies.tasks.parking.parking_top_view import ParkingView, params_of
from policies.tasks.parking.world import ParkingTask
from policies.tasks.top_view import GOAL, GRID, INK, OBSTACLE, VEHICLE

PICTURE = Path(__file__).parents[1] / "results" / "images" / "failed-parking.png"
SHOWN = {"parking1-improved": (1, 3), "parking2-improved": (2, 2)}  # rows of pictures, and pictures in a row
WORDS = {Outcome.HIT_WALL: "wall", Outcome.HIT_OBSTACLE: "obstacle", Outcome.TIMEOUT: "out of time"}
LONGEST = 2000  # decisions; time is up before
WIDTH_PX = 1200
STRIP_PX = 26  # of words, over each picture
TRACE_S = 1.0  # of what moves, before the end


@dataclass(frozen=True, slots=True)
class Moment:
    """What the truth was at one decision, of all environments."""

    pos: NDArray[np.float32]  # (envs, 2)
    yaw: NDArray[np.float32]  # (envs,)
    obstacles: NDArray[np.float32]  # (envs, obstacles, 4)


@dataclass(frozen=True, slots=True)
class Played:
    """The first episode of every environment."""

    decision_s: float
    outcomes: NDArray[np.int32]
    counts: NDArray[np.int64]  # decisions
    goals: NDArray[np.float32]
    params: list[dict[str, float]]
    moments: list[Moment]
    is_level_2: bool


def played(name: str) -> Played:
    """As the page's evaluation begins."""
    policy, card = load_policy(find_policy(name))
    task = build_task(card.task, ENVIRONMENTS, settings_of(card.task, ["split=test"], card.settings))
    if not isinstance(task, ParkingTask):
        raise TypeError(task)
    task.layout.require(policy.layout, name)
    task.set_params(card.samplers())
    task.reset(HELD_OUT_SEED)
    is_level_2 = hasattr(task, "movers")
    obstacles: Any = getattr(task, "movers" if is_level_2 else "blocks")
    outcomes, counts = np.zeros(ENVIRONMENTS, dtype=np.int32), np.zeros(ENVIRONMENTS, dtype=np.int64)
    goals, params = task.world.goal.numpy().copy(), [params_of(task, i) for i in range(ENVIRONMENTS)]
    moments = []
    tensors, memory = TaskTensors(task), policy.start_memory(ENVIRONMENTS)
    with torch.inference_mode():
        while (outcomes == Outcome.RUNNING).any() and len(moments) < LONGEST:
            state = (task.world.pos, task.world.yaw, obstacles)
            moments.append(Moment(*(array.numpy().copy() for array in state)))
            is_running = outcomes == Outcome.RUNNING
            counts += is_running
            actions, memory = policy.act(tensors.observation, memory, None)
            tensors.step(policy.bounded(actions), actions.branches)
            outcomes[is_running] = task.buffers.outcomes.numpy()[is_running]
    return Played(task.decision_s, outcomes, counts, goals, params, moments, is_level_2)


def tile(episodes: Played, i: int, words: str, width_px: int) -> NDArray[np.uint8]:
    """One episode from above: the car's path, where it decided last, and what stood or moved there then."""
    params, moments = episodes.params[i], episodes.moments[: episodes.counts[i]]
    storeys = 2 if episodes.is_level_2 else 1
    scale = width_px / ParkingView(storeys, 480).canvas.pixels.shape[1]
    image = ParkingView(storeys, round(480 * scale))
    image.box(episodes.goals[i], (params["pad_width_m"], params["pad_length_m"]), GOAL)
    last = moments[-1]
    if episodes.is_level_2:
        image.portals()
        for moment in moments[-round(TRACE_S / episodes.decision_s) : -1]:
            for pose in moment.obstacles[i]:
                image.mover(pose, params, GRID)
        for pose in last.obstacles[i]:
            image.mover(pose, params)
    else:
        for block in last.obstacles[i]:
            image.box(block, (params["block_width_m"], params["block_length_m"]), OBSTACLE)
    for before, after in pairwise(moments):
        a, b = before.pos[i], after.pos[i]
        if np.linalg.norm(b - a) < params["car_length_m"]:  # not through a portal
            image.line(a, b, VEHICLE, 2)
    image.car(last.pos[i], float(last.yaw[i]), params)
    strip = np.full((STRIP_PX, image.canvas.pixels.shape[1], 3), 255, dtype=np.uint8)
    cv2.putText(strip, words, (8, STRIP_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA)
    return np.vstack([strip, image.canvas.pixels])


def chosen(outcomes: NDArray[np.int32], count: int) -> list[int]:
    """The first failure of each kind, and the next ones, in order of the episodes."""
    failed = np.flatnonzero(outcomes != Outcome.SUCCESS)
    kinds = [int(failed[outcomes[failed] == kind][0]) for kind in np.unique(outcomes[failed])]
    others = [int(i) for i in failed if int(i) not in kinds]
    return sorted([*kinds, *others][:count])


def main() -> None:
    rows = []
    for name, (row_count, width) in SHOWN.items():
        episodes = played(name)
        ends = ", ".join(f"{int((episodes.outcomes == each).sum())} {each.name.lower()}" for each in Outcome if each)
        print(f"{name}, {ENVIRONMENTS} episodes: {ends}")
        tiles = []
        for i in chosen(episodes.outcomes, row_count * width):
            words = (
                f"{i}: {WORDS[Outcome(int(episodes.outcomes[i]))]}, {episodes.counts[i] * episodes.decision_s:.1f} s"
            )
            print(words)
            tiles.append(tile(episodes, i, words, WIDTH_PX // width))
        rows += [np.hstack(tiles[k : k + width]) for k in range(0, len(tiles) - width + 1, width)]
    rows = [row[:, : min(each.shape[1] for each in rows)] for row in rows]
    cv2.imwrite(str(PICTURE), np.vstack(rows)[..., ::-1], (cv2.IMWRITE_PNG_COMPRESSION, 9))
    print(f"{PICTURE.name}: {PICTURE.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
