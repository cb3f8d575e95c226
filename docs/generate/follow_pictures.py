"""The images of docs/how-to/follow-me.md and the README: the live page in Chromium, and three moments of the film.

`python -m docs.generate.follow_pictures`; needs Chromium. Writes docs/images/live.jpg and follow.jpg.
"""

import tempfile
from pathlib import Path

import cv2
import numpy as np

from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.follow_session import score_lines, watch_of
from mission.follow.lockstep import flight_with_companion
from mission.script import take_off
from mission.view.chase_camera import IMAGE_S
from mission.view.film_images import film
from mission.view.live import LiveView
from mission.view.page import PageServer
from mission.view.replay_file import keep_for_replay, load_recording
from policies.companion.names import FOLLOWER
from policies.companion.skills.load_skill import load_follower
from policies.tasks.follow_me.world import FOLLOW_WORLD
from tests.browser import Browser

IMAGES = Path(__file__).parents[1] / "images"
SEED = 5
FOLLOWED_S = 25.0
MOMENTS_S = (17.0, 25.0, 33.0)  # of the film
SHOT_SIZE = (640, 360)
QUALITY = (cv2.IMWRITE_JPEG_QUALITY, 88)


def main() -> None:
    pilot = load_follower(FOLLOWER)
    run = tempfile.TemporaryDirectory()
    config = FlightConfig(world=FOLLOW_WORLD, owner=OwnerConfig(), seed=SEED)
    flight, companion = flight_with_companion(config, pilot, folder=Path(run.name))
    keep_for_replay(flight, action=lambda: companion.action)
    watch = watch_of(flight, companion, FOLLOWED_S)
    page = PageServer(0, "Honeyguide")
    view = LiveView(
        flight, page, speed=None, action=lambda: companion.action, score=lambda: score_lines(watch, companion)
    )
    watched = [watch.frame, view.frame]
    flight.drone.start(take_off(flight.drone))
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(Path(profile), 1280, 800)
        browser.open(page.url)
        browser.wait("document.body?.innerText.includes('Hold')")
        end_us = flight.time_us + int((FOLLOWED_S + 12.0) * 1e6)
        flight.run(lambda f: f.time_us >= end_us, speed=2.0, on_frame=lambda _: [watch() for watch in watched])
        browser.evaluate("document.querySelector('.mantine-Notification-closeButton')?.click()")
        shown_us = flight.time_us + 3_000_000
        flight.run(lambda f: f.time_us >= shown_us, speed=1.0, on_frame=lambda _: [watch() for watch in watched])
        image = browser.picture()
        browser.close()
    view.close()
    flight.close()
    cv2.imwrite(str(IMAGES / "live.jpg"), image[..., ::-1], QUALITY)
    chosen = {round(moment_s / IMAGE_S) for moment_s in MOMENTS_S}
    shots = [shot for i, shot in enumerate(film(load_recording(Path(run.name)), flight.world)) if i in chosen]
    small = [cv2.resize(shot, SHOT_SIZE, interpolation=cv2.INTER_AREA) for shot in shots]
    cv2.imwrite(str(IMAGES / "follow.jpg"), np.hstack(small)[..., ::-1], QUALITY)


if __name__ == "__main__":
    main()
