"""The camera's video over RTP, watched by FFmpeg: what comes is what the camera sees, at the right size."""

import time
from contextlib import closing

import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from mission.video.rtp_video import HEIGHT, WIDTH, RtpVideo
from sim.video_rig import VideoRig
from sim.world.world import WorldConfig
from tests.system.commands.receiver import Receiver
from tests.system.vehicle import is_free

SMALL = FlightConfig(world=WorldConfig(trees_per_ha=40.0), noise=0.0)
TIMEOUT_S = 120.0  # wall clock, with the kernel to compile


@pytest.fixture
def port():
    return next(port for port in range(15_600, 15_998, 2) if is_free(port) and is_free(port + 1))


def run_until(flight, condition):
    end_s = time.monotonic() + TIMEOUT_S
    flight.run(lambda _: condition() or time.monotonic() > end_s, speed=2.0)
    assert condition()


def seen_by(flight):
    """What the camera sees now."""
    with closing(VideoRig(flight.rig, flight.world)) as rig:
        view = flight.controller.camera.view((WIDTH, HEIGHT), is_smooth=False)
        return rig.capture(view).result().rgb.astype(np.int16)


def test_ffmpeg_shows_what_the_camera_sees(tmp_path, port):
    flight = Flight(SMALL, video=RtpVideo("127.0.0.1", port))
    with closing(flight), Receiver(tmp_path, port) as receiver:
        run_until(flight, lambda: receiver.count > 5)
        assert receiver.size == (640, 360)
        ahead = seen_by(flight)
        assert np.abs(receiver.latest - ahead).mean() < 6.0
        flight.drone.start(flight.drone.command(1000, -60.0, 0.0, np.nan, np.nan))  # the gimbal looks down
        down_us = flight.time_us + 3_000_000
        flight.run(lambda f: f.time_us >= down_us, speed=2.0)
        count = receiver.count
        run_until(flight, lambda: receiver.count > count + 3)
        down = seen_by(flight)
        assert np.abs(down - ahead).mean() > 20.0
        assert np.abs(receiver.latest - down).mean() < 6.0


def test_who_comes_later_sees_a_picture_too(tmp_path, port):
    """Parameter sets and key frames come again every second: a ground station may be started after the vehicle."""
    flight = Flight(SMALL, video=RtpVideo("127.0.0.1", port))
    with closing(flight):
        flight.run(lambda f: f.time_us >= 2_000_000, speed=1.0)
        with Receiver(tmp_path, port) as receiver:
            run_until(flight, lambda: receiver.count > 2)


def test_a_stopped_stream_sends_nothing_until_it_is_started(tmp_path, port):
    video = RtpVideo("127.0.0.1", port, is_running=False)
    flight = Flight(SMALL, video=video)
    with closing(flight), Receiver(tmp_path, port) as receiver:
        flight.run(lambda f: f.time_us >= 1_000_000, speed=2.0)
        assert receiver.count == 0
        video.is_running = True
        run_until(flight, lambda: receiver.count > 2)
        video.is_running = False
        stopped_us = flight.time_us + 2_000_000
        flight.run(lambda f: f.time_us >= stopped_us, speed=2.0)
        count = receiver.count
        flight.run(lambda f: f.time_us >= stopped_us + 2_000_000, speed=2.0)
        assert receiver.count == count


def test_a_network_that_takes_nothing_is_told_once_and_the_flight_goes_on():
    video = RtpVideo("255.255.255.255", 5600)  # broadcast: the system refuses it
    flight = Flight(SMALL, video=video)
    reported, tell = [], video.on_trouble
    video.on_trouble = lambda text: (reported.append(text), tell(text))
    with closing(flight):
        run_until(flight, lambda: reported)
        later_us = flight.time_us + 3_000_000
        flight.run(lambda f: f.time_us >= later_us, speed=2.0)
    assert reported == ["Video: not sent to 255.255.255.255, port 5600: Permission denied"]
