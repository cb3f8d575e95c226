"""The film of the README: the owner is not to be seen for 8 s, and what the guard does then.

`python -m docs.generate.lost_owner_film`. Writes docs/images/lost-owner.webp, at five images a second of flight.
"""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.benchmark.conditions import BY_NAME
from mission.follow.follow_session import chosen_pilot
from mission.follow.lockstep import flight_with_companion, follow_for
from mission.view.chase_camera import IMAGE_S
from mission.view.film_images import film
from mission.view.replay_file import keep_for_replay, load_recording
from policies.companion.guard.guard import Stance
from policies.companion.guard.settings import GuardSettings
from policies.tasks.follow_me.world import FOLLOW_WORLD

FILM = Path(__file__).parents[1] / "images" / "lost-owner.webp"
SEED, SECONDS = 11, 60.0
EVERY = 5  # images of the film
BEFORE_S, AFTER_S = 1.5, 3.5  # shown before the guard becomes slower, and after the policy goes on
SIZE = (480, 270)
QUALITY = 30


def main() -> None:
    pilot, _ = chosen_pilot(None)
    condition = BY_NAME["gone-8"]
    owner = OwnerConfig(pace=condition.pace, numbers=dict(condition.numbers))
    stances: list[tuple[float, Stance]] = []
    with tempfile.TemporaryDirectory() as folder:
        config = FlightConfig(world=FOLLOW_WORLD, owner=owner, seed=SEED)
        flight, companion = flight_with_companion(config, pilot, folder=Path(folder), guard=GuardSettings())
        keep_for_replay(flight, action=lambda: companion.action)
        follow_for(flight, companion, SECONDS, lambda _: stances.append((flight.time_us * 1e-6, companion.skill.guard.stance)))
        flight.close()
        begins_s, ends_s = shown(stances)
        said = dict((round(time_s / IMAGE_S), stance) for time_s, stance in stances)
        images = []
        for i, image in enumerate(film(load_recording(Path(folder)), flight.world)):
            if begins_s <= i * IMAGE_S <= ends_s and i % EVERY == 0:
                images.append(captioned(cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA), said.get(i, Stance.FREE)))
    first, *rest = images
    wait_ms = round(1000.0 * EVERY * IMAGE_S)
    first.save(FILM, save_all=True, append_images=rest, duration=wait_ms, loop=0, quality=QUALITY, method=6)
    print(f"{FILM.name}: {len(images)} images, {FILM.stat().st_size // 1000} kB")


def shown(stances: list[tuple[float, Stance]]) -> tuple[float, float]:
    """From when to when [s] the film shows: round the first time that the guard searches."""
    searched = next(i for i, (_, stance) in enumerate(stances) if stance is Stance.SEARCH)
    lost = max(i for i in range(searched) if stances[i][1] is Stance.FREE)
    back = next(i for i in range(searched, len(stances)) if stances[i][1] is Stance.FREE)
    return stances[lost][0] - BEFORE_S, stances[back][0] + AFTER_S


def captioned(image: np.ndarray, stance: Stance) -> Image.Image:
    """With what the guard does, in the upper left corner."""
    cv2.putText(image, stance.value, (9, 23), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(image, stance.value, (9, 23), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (255, 255, 255), 1, cv2.LINE_AA)
    return Image.fromarray(image)


if __name__ == "__main__":
    main()
