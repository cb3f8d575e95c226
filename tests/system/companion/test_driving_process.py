"""A companion that drives a rover, as a process of its own: MAVLink over UDP, real time, a goto to the companion."""

import pytest

from autopilot.interface.vehicle_state import Mode
from mission.flight import FlightConfig
from tests.system.companion.test_companion import STARTED_S
from tests.system.companion.test_navigation import Scene
from tests.unit.mission.follow.park_flight import impact_m_s, miss, send_goto
from tests.unit.mission.follow.test_driving import GOAL, PLAIN


@pytest.mark.slow
@pytest.mark.parametrize(("option", "mode"), [([], Mode.OFFBOARD), (["--by-sticks"], Mode.POSITION)])
def test_a_goto_is_driven_into_its_pose_over_udp(tmp_path, option, mode):
    config = FlightConfig(
        airframe="rover", has_lidar=True, has_base=True, world=PLAIN, parameters={"HG_RO_OFFB_BODY": 1.0}
    )
    scene = Scene(tmp_path, config, "drive-reach", *option)
    flight, heard = scene.flight, scene.flight.controller.state

    async def arm(drone):
        await drone.wait_ready()
        await drone.arm()

    try:
        running = flight.drone.start(arm(flight.drone))
        scene.wait_for(lambda: running.is_done, STARTED_S)
        scene.wait_for_companion()
        send_goto(flight, GOAL)
        scene.wait_for(lambda: heard.mode is mode, 30.0)
        scene.wait_for(lambda: scene.has_said("hold: goto reached") and heard.mode is Mode.HOLD, 60.0)
        distance_m, turn_deg = miss(flight, GOAL)
        assert (distance_m < 0.3, turn_deg < 10.0) == (True, True), (distance_m, turn_deg)
        assert impact_m_s(flight) == 0.0
    finally:
        scene.close()
