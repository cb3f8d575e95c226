"""The camera in a flight: pictures of the world it flies in, a mission that takes them, and the live picture."""

from math import nan, radians
from threading import Event, Thread
from urllib.request import urlopen

import cv2
import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from mission.plan.plan_file import PlanItem
from mission.video.mjpeg_server import StreamServer
from sim.world.world import WorldConfig

SMALL = FlightConfig(world=WorldConfig(trees_per_ha=20.0))
TIMEOUT_S = 60.0  # wall clock, with the kernel to compile


def taken(folder):
    """Every picture of a flight, by name."""
    return {path.name: path.read_bytes() for path in sorted((folder / "media").iterdir())}


async def photos_of_the_pad(drone):
    """From 12 m: the pad straight down, then the horizon."""
    await drone.until(lambda: drone.is_ready, 30.0, "ready")
    await drone.arm()
    await drone.takeoff(12.0)
    for pitch_deg in (-90.0, 0.0):
        await drone.command(1000, pitch_deg, 0.0, nan, nan)
        await drone.sleep(2.0)
        with drone.subscribe("CAMERA_IMAGE_CAPTURED") as inbox:
            await drone.command(2000, 0.0, 0.0, 1.0)
            shot = await inbox.next(2.0, "a photo")
            assert shot.capture_result == 1
    await drone.command(2500, 0.0, 0.0)
    await drone.sleep(1.0)
    await drone.command(2501, 0.0)


def test_photos_show_where_the_gimbal_points_and_are_the_same_for_the_same_flight(tmp_path):
    pictures = []
    for name in ("first", "second"):
        folder = tmp_path / name
        folder.mkdir()
        flight = Flight(SMALL, folder=folder)
        running = flight.fly(photos_of_the_pad)
        flight.close()
        assert running.error is None
        pictures.append(taken(folder))
    assert pictures[0] == pictures[1]
    down, level = (cv2.imread(str(tmp_path / "first" / "media" / f"IMG_0000{i}.jpg")) for i in (1, 2))
    blue, green, red = down[150:210, 290:350].astype(float).mean(axis=(0, 1))
    assert max(blue, green, red) - min(blue, green, red) < 25.0  # the grey pad at home, 12 m below
    lawn = down[:40, :100].astype(float).mean(axis=(0, 1))
    assert lawn[1] > lawn[0] + 30.0
    sky = level[:60].astype(float).mean(axis=(0, 1))
    assert sky[0] > sky[2]


def test_mission_takes_photos_along_its_way(tmp_path):
    flight = Flight(SMALL, folder=tmp_path)
    home = flight.config.home
    north = home.lat_deg + 60.0 / 111_195.0

    async def survey(drone):
        await drone.until(lambda: drone.is_ready, 30.0, "ready")
        items = [
            PlanItem(0, 3, 22, (0.0, 0.0, 0.0, nan), home.lat_deg, home.lon_deg, 20.0),
            PlanItem(1, 3, 205, (-90.0, 0.0, 0.0, 0.0), 0.0, 0.0, 2.0),
            PlanItem(2, 2, 206, (20.0, 0.0, 1.0, 0.0), 0.0, 0.0, 0.0),
            PlanItem(3, 3, 16, (0.0, 0.0, 0.0, nan), north, home.lon_deg, 20.0),
            PlanItem(4, 2, 206, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0),
        ]
        await drone.upload(items)
        await drone.arm()
        with drone.subscribe("CAMERA_IMAGE_CAPTURED") as inbox:
            await drone.command(300)
            shots = [await inbox.next(40.0, "a photo") for _ in range(3)]
        places = [(shot.lat * 1e-7 - home.lat_deg) * 111_195.0 for shot in shots]
        assert flight.controller.gimbal.gimbal.pitch == pytest.approx(radians(-90.0))
        assert np.diff(places) == pytest.approx(20.0, abs=1.0)

    running = flight.fly(survey)
    flight.close()
    assert running.error is None
    assert len(taken(tmp_path)) in (3, 4)


def frames_of(response, count):
    """The first pictures of a multipart stream."""
    pictures = []
    while len(pictures) < count:
        line = response.readline()
        assert line, "the stream has ended"
        if line.startswith(b"Content-Length:"):
            response.readline()
            pictures.append(cv2.imdecode(np.frombuffer(response.read(int(line.split(b":")[1])), np.uint8), 1))
    return pictures


def test_browser_sees_the_live_picture_and_the_stored_ones(tmp_path):
    stream = StreamServer(0)
    flight = Flight(SMALL, folder=tmp_path, stream=stream)
    flight.frame()
    assert flight.controller.camera.take_photo().reason == ""
    is_over, seen = Event(), {}

    def watch():
        try:
            with urlopen(f"{stream.page_uri}still.jpg", timeout=TIMEOUT_S) as response:
                seen["still"] = cv2.imdecode(np.frombuffer(response.read(), np.uint8), 1)
            with urlopen(stream.uri, timeout=TIMEOUT_S) as response:
                seen["kind"] = response.headers["Content-Type"]
                seen["frames"] = frames_of(response, 3)
            for name in ("", "camera.xml", "media/IMG_00001.jpg"):
                with urlopen(f"{stream.page_uri}{name}", timeout=TIMEOUT_S) as response:
                    seen[name] = response.read()
        finally:
            is_over.set()

    watcher = Thread(target=watch)
    watcher.start()
    flight.run(lambda _: is_over.is_set(), speed=20.0)
    watcher.join()
    flight.close()
    assert seen["still"].shape == (180, 320, 3)
    assert seen["kind"].startswith("multipart/x-mixed-replace")
    assert [frame.shape for frame in seen["frames"]] == [(180, 320, 3)] * 3
    assert b"/stream.mjpg" in seen[""]
    assert b"mavlinkcamera" in seen["camera.xml"]
    assert seen["media/IMG_00001.jpg"] == taken(tmp_path)["IMG_00001.jpg"]


def test_nothing_is_rendered_while_nobody_watches(tmp_path):
    stream = StreamServer(0)
    flight = Flight(SMALL, stream=stream)
    flight.run(lambda flight: flight.time_us > 2_000_000)
    assert stream.serial == 0
    flight.close()
