"""`python -m bench.drive_mavlink [SCENES] [park|reach] [sticks] [guard] [seed=N] [lag=S] [POLICY]`: Drive over MAVLink.

One rover at a time, in lockstep: the whole flight controller, the messages of its ring of range finders, a companion
computer with the policy, a goto sent to it. The scenes are those of the batch: held-out worlds, goals, headings at the
start, wind, noise, masses, motors and tyres are drawn by the task, which then plays the same scenes itself. In: how
many scenes, of what, by sticks or setpoints, under the guard or not, of which seed, how late the ranges come, which
policy. Out: both rates side by side; of the policies that ship, in docs/results/drive.md.
"""

import sys
from collections import Counter
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from bench.drive import AIMS, FLOWN, PAGE_FILE, SEED, Drives, judged
from bench.page_section import with_section
from bench.row import machine
from common.files import write_whole
from common.intervals import rate
from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_driver
from mission.park.park_session import REVERSES
from mission.park.parking import Arrival, drive, get_ready
from mission.script import Drone, ScriptError
from mission.view.pose_goals import Pose
from policies.companion.guard.settings import GuardSettings
from policies.companion.vector_pilot import DrivingPilot
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.episode import Outcome
from sim.world.world import WorldMap

SCENES = 300
WORDS = ("sticks", "guard")
READY_S, ALL_S = 60.0, 240.0
UNGUARDED = GuardSettings(is_on=False)  # the policy alone, as in the batch
SECTION = f"""\
{FLOWN}

The same policies, driven by their [companion](../how-to/companion.md): a goto is sent to it, estimate and ranges come
to it as messages, its setpoints go to mode Offboard, without the guard. {{scenes}} scenes of each kind, one rover at
a time, in lockstep; the batch plays the same scenes beside it. There is success when it has been handed back in mode
Hold, and 2 s later stands in the pose as above, by the truth. Made by `python -m bench.drive_mavlink`.

| policy | over MAVLink | batch, same scenes | touched | not there | time to the goal |
|---|---|---|---|---|---|
{{rows}}

Measured on {{machine}}.
"""


@dataclass(frozen=True, slots=True)
class Scene:
    """What the task has drawn for one episode; rows of the rig as NumPy values."""

    world: WorldMap
    goal: Pose
    out: float  # 1: the goal's nose is to the aisle, -1: its tail is, 0: on a course
    noise: float
    seed: int
    rows: dict[str, Any]


def scenes_of(preset: str, count: int, seed: int = SEED) -> list[Scene]:
    """The scenes of the batch's first episodes."""
    settings = task_settings("Drive", {"preset": preset, "has_estimator": True, "split": "test"})
    task = build_task("Drive", count, settings)
    if not isinstance(task, Drive):
        raise TypeError(task)
    task.reset(seed)
    goals, noise = task.driving.goals.numpy(), task.driving.flight.numpy()["sensor_noise"]
    outs, seeds = task.driving.outs.numpy(), task.noise_seeds.numpy()
    names = ("model", "wind_model", "body", "truth")
    return [
        Scene(
            world=task.worlds.map(i),
            goal=(float(goals[i][0]), float(goals[i][1]), float(goals[i][2])),
            out=float(outs[i]),
            noise=round(4.0 * float(noise[i])) / 4.0,
            seed=int(seeds[i]),
            rows={name: task.rig.rows[name][i].copy() for name in names},
        )
        for i in range(count)
    ]


def driven(
    scene: Scene,
    pilot: DrivingPilot,
    *,
    is_by_sticks: bool = False,
    guard: GuardSettings = UNGUARDED,
    scan_lag_s: float = 0.0,
) -> Arrival:
    """One drive over MAVLink, the ranges so late [s]."""
    config = FlightConfig(
        airframe="rover",
        has_lidar=True,
        has_base=True,
        world=scene.world.config,
        seed=scene.seed,
        noise=scene.noise,
        parameters=REVERSES,
        scan_lag_s=scan_lag_s,
    )
    flight, companion = flight_with_driver(config, pilot, is_by_sticks=is_by_sticks, world=scene.world, guard=guard)
    try:
        for name in ("model", "body", "truth"):  # as the episode's vehicle stands there
            flight.rig.rows[name][0] = scene.rows[name]
        flight.rig.rows["wind_model"][0] = scene.rows["wind_model"]
        ready = flight.fly(get_ready, seconds=READY_S)
        if ready.error is not None:
            return Arrival("missed", nan, nan, nan, str(ready.error))

        async def script(drone: Drone) -> Arrival:
            return await drive(drone, flight, companion, scene.goal)

        running = flight.fly(script, seconds=ALL_S)
        if isinstance(running.error, ScriptError):
            return Arrival("missed", nan, nan, nan, str(running.error))
        result: Arrival = running.result
        return result
    finally:
        flight.close()


def row(preset: str, arrivals: list[Arrival], drives: Drives) -> str:
    """A line of the table."""

    def percent(is_it: Any) -> str:
        fraction = rate(np.asarray(is_it))
        return f"{100 * fraction.value:.1f} % ({100 * fraction.low:.1f} to {100 * fraction.high:.1f})"

    outcomes = np.array([arrival.outcome for arrival in arrivals])
    times = [arrival.seconds for arrival in arrivals if arrival.is_there]
    cells = [preset, percent(outcomes == "there"), percent(drives.outcomes == Outcome.SUCCESS)]
    cells += [percent(outcomes == "touched"), percent(outcomes == "missed"), f"{np.mean(times or nan):.1f} s"]
    return "| " + " | ".join(cells) + " |"


def measured(
    preset: str,
    policy: Policy,
    source: str,
    count: int,
    *,
    is_by_sticks: bool = False,
    guard: GuardSettings = UNGUARDED,
    seed: int = SEED,
    scan_lag_s: float = 0.0,
) -> str:
    """A line of the table, with what went wrong printed."""
    drives = judged(policy, preset, count, seed, scan_lag_s)
    pilot = DrivingPilot(policy, source)
    arrivals, scenes = [], scenes_of(preset, count, seed)
    for i, scene in enumerate(scenes):
        arrivals.append(driven(scene, pilot, is_by_sticks=is_by_sticks, guard=guard, scan_lag_s=scan_lag_s))
        if not arrivals[-1].is_there:
            print(i, arrivals[-1], Outcome(int(drives.outcomes[i])).name, flush=True)
    batch = drives.outcomes == Outcome.SUCCESS
    both = Counter((arrival.is_there, bool(is_good)) for arrival, is_good in zip(arrivals, batch, strict=True))
    print(f"{preset}: over MAVLink and in the batch {both[True, True]}, over MAVLink alone {both[True, False]}, "
          f"in the batch alone {both[False, True]}, neither {both[False, False]}")  # fmt: skip
    outs, there = np.array([scene.out for scene in scenes]), np.array([arrival.is_there for arrival in arrivals])
    for out, way in ((1.0, "the nose"), (-1.0, "the tail")):
        if (chosen := outs == out).any():
            print(f"{way} to the aisle: {there[chosen].sum()} over MAVLink, {batch[chosen].sum()} in the batch, "
                  f"of {chosen.sum()}")  # fmt: skip
    return row(preset, arrivals, drives)


def write_section(policies: dict[str, Path], scenes: int) -> None:
    """Measures the policies, by preset, and writes that into the page."""
    lines = []
    for preset, path in policies.items():
        lines.append(measured(preset, load_policy(path)[0], str(path), scenes))
        print(lines[-1], flush=True)
    section = SECTION.format(scenes=scenes, rows="\n".join(lines), machine=machine())
    write_whole(PAGE_FILE, with_section(PAGE_FILE.read_text(), FLOWN, section).encode())


def main(arguments: list[str]) -> int:
    changed = dict(text.split("=", 1) for text in arguments if text.startswith(("seed=", "lag=")))
    arguments = [text for text in arguments if not text.startswith(("seed=", "lag="))]
    count = next((int(text) for text in arguments if text.isdigit()), SCENES)
    presets = [preset for preset in AIMS if preset in arguments] or list(AIMS)
    named = [text for text in arguments if not text.isdigit() and text not in (*AIMS, *WORDS)]
    if not changed and not named and not {*WORDS} & {*arguments} and len(presets) == len(AIMS) and PAGE_FILE.is_file():
        write_section({preset: find_policy(f"drive-{preset}") for preset in presets}, count)
        return 0
    for preset in presets:
        path = find_policy(named[0] if named else f"drive-{preset}")
        seed, lag_s = int(changed.get("seed", SEED)), float(changed.get("lag", 0.0))
        policy, _ = load_policy(path)
        guard = GuardSettings() if "guard" in arguments else UNGUARDED
        how = " ".join(word for word in WORDS if word in arguments) or "setpoints, no guard"
        print(f"{preset}: {how}, seed {seed}, ranges {1000 * lag_s:.0f} ms late", flush=True)
        line = measured(
            preset,
            policy,
            str(path),
            count,
            is_by_sticks="sticks" in arguments,
            guard=guard,
            seed=seed,
            scan_lag_s=lag_s,
        )
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
