"""How long does the film of a flight take, beside the flight itself?

60 s of following somebody among trees, then its film with vehicle, onboard image and caption, encoded; on all cores.
"""

import io
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import av
from rich.console import Console

from bench.row import Row, require
from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_companion
from mission.follow.owner_device import OwnerConfig
from mission.script import take_off
from mission.view.chase_camera import IMAGE_S
from mission.view.film import write_film
from mission.view.film_images import HEIGHT, WIDTH
from mission.view.replay_file import keep_for_replay, load_recording
from policies.companion.pilot import SCRIPTED, load_pilot
from policies.tasks.follow_me.world import FOLLOW_WORLD

FLOWN_S = 60.0
TRIES = 2  # the first loads kernels
COMMAND = "python -m bench film"


def measure() -> list[Row]:
    config = FlightConfig(world=FOLLOW_WORLD, owner=OwnerConfig())
    wall_s, cpu_s = [], []
    with TemporaryDirectory() as folder:
        flight, _ = flight_with_companion(config, load_pilot(SCRIPTED), folder=Path(folder))
        keep_for_replay(flight)
        flight.drone.start(take_off(flight.drone))
        flight.run(lambda f: f.time_us >= FLOWN_S * 1e6)
        flight.close()
        recording = load_recording(Path(folder))
        target = Path(folder) / "flight.mp4"
        for _ in range(TRIES):
            start = time.perf_counter(), time.process_time()
            write_film(recording, flight.world, target, Console(file=io.StringIO()))
            wall_s.append(time.perf_counter() - start[0])
            cpu_s.append(time.process_time() - start[1])
        with av.open(str(target)) as film:
            images = film.streams.video[0].frames
    require(images == round(FLOWN_S / IMAGE_S), f"the film has {images} pictures")
    name = f"film of {FLOWN_S:g} s, {WIDTH} x {HEIGHT}, over the flight's own time"
    return [
        Row(f"{name}, by the wall clock", min(wall_s) / FLOWN_S, "s/s", "lower", 1.0, COMMAND),
        Row(f"{name}, CPU on all cores", min(cpu_s) / FLOWN_S, "CPU s/s", "lower", 2.0, COMMAND),
    ]
