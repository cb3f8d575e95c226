"""A killed `honeyguide fly --state` remembers what it has told a client, and lets the next one have the folder."""

import pytest
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw
from mavsdk.plugins.param import Param

from tests.system.vehicle import IdleVehicle

START_UP_S = 120.0  # wall clock, with the kernels to compile on a busy machine


def connected(vehicle):
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(f"udpin://127.0.0.1:{vehicle.api_port}")
    system = mavsdk.first_autopilot(START_UP_S)
    assert system is not None, "no heartbeat"
    return mavsdk, system


@pytest.mark.slow
def test_parameter_and_mission_survive_a_kill_after_their_acknowledgement(tmp_path):
    state = tmp_path / "state"
    items = [MissionItem(i, 6, 16, int(i == 0), 1, 0, 0, 0, 0, 473977418 + i, 85455939, 20.0 + i, 0) for i in range(5)]
    for number in range(2):
        folder = tmp_path / str(number)
        folder.mkdir()
        with IdleVehicle(folder, "--trees", 0, "--state", state) as vehicle:
            mavsdk, system = connected(vehicle)
            param, mission = Param(system), MissionRaw(system)
            if number == 0:
                param.set_param_float("MIS_TAKEOFF_ALT", 7.5)
                mission.upload_mission(items)
                vehicle.kill()
            else:
                assert param.get_param_float("MIS_TAKEOFF_ALT") == 7.5
                assert [item.z for item in mission.download_mission()] == [20.0, 21.0, 22.0, 23.0, 24.0]
            mavsdk.destroy()
