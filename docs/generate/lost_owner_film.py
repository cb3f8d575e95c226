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
from mission.follow.follow_scoring import FollowWatch
from mission.follow.lockstep import flight_with_companion, follow_for
from mission.view.chase_camera import IMAGE_S
from mission.view.film_images import film
from mission.view.replay_file import keep_for_replay, load_recording
from policies.companion.guard.guard import Stance
from policies.companion.guard.settings import GuardSettings
from policies.companion.names import FOLLOWER
from policies.companion.skills.load_skill import load_follower
from policies.tasks.follow_me.world import FOLLOW_WORLD

FILM = Path(__file__).parents[1] / "images" / "lost-owner.webp"
SEED, SECONDS = 11, 60.0
EVERY = 5  # images of the film
BEFORE_S, AFTER_S = 1.5, 3.5  # shown before the guard becomes slower, and after the policy goes on
SIZE = (400, 225)
STRIP = 27  # [pixels]
QUALITY = 25


def main() -> None:
    pilot = load_follower(FOLLOWER)
    condition = BY_NAME["gone-8"]
    owner = OwnerConfig(pace=condition.pace, numbers=dict(condition.numbers))
    stances: dict[int, Stance] = {}  # by the image of the film
    with tempfile.TemporaryDirectory() as folder:
        config = FlightConfig(world=FOLLOW_WORLD, owner=owner, seed=SEED)
        flight, companion = flight_with_companion(config, pilot, folder=Path(folder), guard=GuardSettings())
        keep_for_replay(flight, action=lambda: companion.action)

        def look(_: FollowWatch) -> None:
            stances[round(flight.time_us * 1e-6 / IMAGE_S)] = companion.skill.guard.stance

        follow_for(flight, companion, SECONDS, look)
        first, last = shown(stances)
        images = [
            captioned(cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA), stances[i])
            for i, image in enumerate(film(load_recording(Path(folder)), flight.world))
            if first <= i <= last and i % EVERY == 0
        ]
    image, *rest = images
    wait_ms = round(1000.0 * EVERY * IMAGE_S)
    image.save(FILM, save_all=True, append_images=rest, duration=wait_ms, loop=0, quality=QUALITY, method=6)
    print(f"{FILM.name}: {len(images)} images, {FILM.stat().st_size // 1000} kB")


def shown(stances: dict[int, Stance]) -> tuple[int, int]:
    """The first and the last image that the film shows: round the first time that the guard searches."""
    searched = min(i for i, stance in stances.items() if stance is Stance.SEARCH)
    lost = max(i for i, stance in stances.items() if i < searched and stance is Stance.FREE)
    back = min(i for i, stance in stances.items() if i > searched and stance is Stance.FREE)
    return lost - round(BEFORE_S / IMAGE_S), back + round(AFTER_S / IMAGE_S)


def captioned(image: np.ndarray, stance: Stance) -> Image.Image:
    """With what the guard does, on a darkened strip along the upper edge."""
    image[:STRIP] >>= 1
    cv2.putText(image, stance.value, (9, 19), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
    return Image.fromarray(image)


if __name__ == "__main__":
    main()
