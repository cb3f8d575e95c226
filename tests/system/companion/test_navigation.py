"""A companion that navigates, as a process of its own: MAVLink over UDP, real time, a goto to the vehicle."""

import subprocess

import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole
from autopilot.mavlink.transport.udp_port import UdpPort
from mission.flight import Flight
from mission.script import take_off
from policies.companion.vehicle_link import COMPONENT
from tests.system.companion.test_companion import NOBODY_PORT, STARTED_S
from tests.system.vehicle import HONEYGUIDE, ROOT, free_ports
from tests.unit.mission.follow.forest_flight import AUTOPILOT, config, miss_m, place, send_goto


class Scene:
    """A flight in this process, in real time, and a companion with a policy in another."""

    def __init__(self, folder, config, *policy):
        port = free_ports()[1]
        links = [UdpPort(NOBODY_PORT, LinkRole.ONBOARD, local_port=port)]
        self.flight = Flight(config, links=links)
        self._output = (folder / "companion.txt").open("w+")
        link = f"udpout://127.0.0.1:{port}"
        command = [HONEYGUIDE, "companion", "--policy", *policy, "--engage", "--link", link]
        self.companion = subprocess.Popen(command, stdout=self._output, stderr=subprocess.STDOUT, cwd=ROOT)

    def wait_for(self, is_enough, seconds):
        """Flies on in real time until it is enough."""
        end_us = self.flight.time_us + round(seconds * 1e6)
        self.flight.run(lambda f: is_enough() or f.time_us >= end_us, speed=1.0)
        self._output.seek(0)
        assert is_enough(), (self.flight.controller.state.mode, self.flight.drone.texts, self._output.read())

    def wait_for_companion(self):
        """Until what it has asked for has begun to come in."""
        heard = self.flight.server._endpoint
        self.wait_for(lambda: any(channel.heard.has(1, COMPONENT) for channel in heard.channels), STARTED_S)
        hearing_us = self.flight.time_us + 1_500_000
        self.wait_for(lambda: self.flight.time_us >= hearing_us, 2.0)

    def has_said(self, text):
        return any(text in said for said in self.flight.drone.texts)

    def close(self):
        if self.companion.poll() is None:
            self.companion.terminate()
        self.companion.wait(20.0)
        self.flight.close()
        self._output.close()


@pytest.fixture
def scene(tmp_path):
    scene = Scene(tmp_path, config(wind_m_s=3.0), "navigate")
    yield scene
    scene.close()


def test_a_goto_is_flown_through_the_forest_over_udp(scene):
    flight = scene.flight
    heard = flight.controller.state
    running = flight.drone.start(take_off(flight.drone))
    scene.wait_for(lambda: running.is_done and heard.mode is Mode.HOLD, STARTED_S)
    scene.wait_for_companion()
    goal_ned = place(flight, 30.0, 10.0)
    flight.rig.forget_impacts()
    send_goto(flight, goal_ned, AUTOPILOT)
    scene.wait_for(lambda: heard.mode is Mode.OFFBOARD, 30.0)
    scene.wait_for(lambda: scene.has_said("hold: goto reached") and heard.mode is Mode.HOLD, 60.0)
    assert miss_m(flight, goal_ned) < 4.5
    assert float(flight.rig.rows["truth"][0]["impact_speed"]) == 0.0
