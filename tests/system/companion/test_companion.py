"""A companion as a process of its own: MAVLink over UDP, pictures over TCP, real time."""

import subprocess
import time
from math import hypot

import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole
from autopilot.mavlink.transport.udp_port import UdpPort
from mission.flight import Flight
from mission.follow.follow_scoring import FollowWatch
from mission.follow.image_server import ImageServer
from mission.script import take_off
from policies.companion.pilot import TASK
from policies.tasks.follow_me.scorecard import scorecard
from tests.system.vehicle import HONEYGUIDE, ROOT, free_ports
from tests.unit.mission.follow.follow_flight import config

SECONDS = 60.0
STARTED_S = 60.0  # wall clock: torch has to be imported
NOBODY_PORT = 9  # discard: the vehicle's first client is not there


class Scene:
    """A flight in this process, in real time, and a companion in another."""

    def __init__(self, folder, seed=3, pace="walk"):
        port = free_ports()[1]
        self.images = ImageServer(0)
        self.flight = Flight(
            config(pace, seed).model_copy(update={"wind_m_s": 3.0}),
            links=[UdpPort(NOBODY_PORT, LinkRole.ONBOARD, local_port=port)],
            folder=folder,
        )
        self.flight.onboard.add_sink(self.images.publish)
        self.flight.computers.append(self.images)
        self._output = (folder / "companion.txt").open("w+")
        command = [HONEYGUIDE, "companion", "--policy", TASK, "--engage"]
        command += ["--link", f"udpout://127.0.0.1:{port}", "--camera", self.images.url]
        self.companion = subprocess.Popen(command, stdout=self._output, stderr=subprocess.STDOUT, cwd=ROOT)

    @property
    def mode(self):
        return self.flight.controller.state.mode

    def wait_for(self, is_enough, seconds):
        """Flies on in real time until it is enough."""
        end_us = self.flight.time_us + round(seconds * 1e6)
        self.flight.run(lambda f: is_enough() or f.time_us >= end_us, speed=1.0)
        assert is_enough(), (self.mode, self.flight.drone.texts, self.said())

    def engaged(self):
        """Up, and followed by the companion."""
        drone = self.flight.drone
        self.wait_for(lambda: any("ready to follow" in text for text in drone.texts), STARTED_S)
        running = drone.start(take_off(drone))
        self.wait_for(lambda: running.is_done and self.mode is Mode.OFFBOARD, 40.0)
        return self

    def said(self):
        self._output.seek(0)
        return self._output.read()

    def close(self):
        if self.companion.poll() is None:
            self.companion.terminate()
        self.companion.wait(20.0)
        self.images.close()
        self.flight.close()
        self._output.close()


@pytest.fixture
def scene(tmp_path):
    scene = Scene(tmp_path)
    yield scene
    scene.close()


def flown_track(scene, seconds):
    watch = FollowWatch(scene.flight, lambda: scene.mode is Mode.OFFBOARD, seconds)
    scene.flight.run(lambda _: watch.is_over, speed=1.0, on_frame=lambda _: watch.frame())
    return watch.track()


@pytest.mark.slow
def test_a_minute_of_following_over_udp_meets_the_scorecard(scene):
    scene.engaged()
    card = scorecard([flown_track(scene, SECONDS)])
    assert card.minutes == pytest.approx(SECONDS / 60.0, abs=0.02), (scene.flight.drone.texts, scene.said())
    assert card.success.value == 1.0
    assert card.in_band.value > 0.95  # the vehicle has to come near first
    assert card.tracking.value > 0.95
    assert card.in_view.value > 0.98
    assert card.collision.value == 0.0


def test_a_companion_that_dies_leaves_the_vehicle_in_hold(scene):
    scene.engaged()
    scene.companion.kill()
    scene.wait_for(lambda: scene.mode is Mode.HOLD, 5.0)
    speed_m_s = hypot(*map(float, scene.flight.rig.rows["truth"][0]["vel_ned"]))
    assert speed_m_s < 5.0


def test_pictures_that_end_hand_control_back(scene):
    scene.engaged()
    scene.images.close()
    ended_us = scene.flight.time_us
    scene.flight.onboard.way.sinks.clear()
    scene.flight.computers.clear()
    scene.wait_for(lambda: scene.mode is Mode.HOLD, 5.0)
    assert scene.flight.time_us - ended_us < 3_500_000  # it stands after 0.8 s, and gives up after 2.5
    scene.wait_for(lambda: any("hold: no new pictures" in text for text in scene.flight.drone.texts), 1.0)


def test_the_command_line_serves_an_owner_and_a_companion_follows(tmp_path):
    gcs_port, api_port = free_ports()
    image_port = gcs_port + 2
    fly = [HONEYGUIDE, "fly", "--idle", "--owner", "walk", "--gcs-port", gcs_port, "--api-port", api_port]
    fly += ["--image-port", image_port, "--run-folder", tmp_path / "run"]
    follow = [HONEYGUIDE, "companion", "--policy", "scripted", "--link", f"udpout://127.0.0.1:{api_port + 40}"]
    follow += ["--camera", f"tcp://127.0.0.1:{image_port}"]
    with (tmp_path / "fly.txt").open("w") as fly_out, (tmp_path / "companion.txt").open("w") as out:
        vehicle = subprocess.Popen([str(word) for word in fly], stdout=fly_out, stderr=subprocess.STDOUT, cwd=ROOT)
        companion = subprocess.Popen([str(word) for word in follow], stdout=out, stderr=subprocess.STDOUT, cwd=ROOT)
        deadline = time.monotonic() + 2.0 * STARTED_S
        try:
            while "ready" not in (tmp_path / "companion.txt").read_text() and time.monotonic() < deadline:
                time.sleep(0.2)
        finally:
            companion.terminate()
            vehicle.terminate()
            companion.wait(20.0)
            vehicle.wait(30.0)
    said = (tmp_path / "companion.txt").read_text()
    assert "ready" in said, (said, (tmp_path / "fly.txt").read_text())
    assert f"tcp://127.0.0.1:{image_port}" in (tmp_path / "fly.txt").read_text()
