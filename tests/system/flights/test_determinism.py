"""Lockstep flights are pure functions of their configuration, and other tools read their logs."""

import json
import subprocess

import numpy as np
import pytest
from pymavlink import mavutil
from pyulog import ULog

from mission.flight import Flight, FlightConfig
from mission.flight_config import TREELESS_M
from mission.log.flight_summary import planned_path
from mission.plan.plan_file import DEFAULT_PLAN, moved_plan, read_plan
from mission.script import fly_plan
from mission.view.replay_file import keep_for_replay
from sim.world.world import WorldConfig
from tests.system.vehicle import HONEYGUIDE, ROOT

LOGS = ("flight.ulg", "flight.tlog")
OPTIONS = ("fly", "--once", "--speed", "max", "--wind", "5", "--seed", "3", "--seconds", "40")
PX4_TOPICS = {
    "actuator_motors",
    "battery_status",
    "sensor_combined",
    "vehicle_attitude",
    "vehicle_attitude_groundtruth",
    "vehicle_gps_position",
    "vehicle_land_detected",
    "vehicle_local_position",
    "vehicle_local_position_groundtruth",
    "vehicle_magnetometer",
    "vehicle_status",
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Run folders of two flights of the same configuration, each in its own process, at the same time."""
    folders = [tmp_path_factory.mktemp("flight") for _ in range(2)]
    processes = [
        subprocess.Popen([HONEYGUIDE, *OPTIONS, "--run-folder", folder], stdout=subprocess.DEVNULL, cwd=ROOT)
        for folder in folders
    ]
    for process in processes:
        assert process.wait(300.0) == 1  # its time is over before the mission is
    return folders


@pytest.mark.parametrize("name", LOGS)
def test_two_processes_write_the_same_bytes(folders, name):
    first, second = ((folder / name).read_bytes() for folder in folders)
    assert len(first) > 100_000
    assert first == second


def test_a_flight_inside_a_program_writes_the_same_bytes_as_the_command(folders, tmp_path):
    world = WorldConfig(treeless_radius_m=TREELESS_M)  # the command's: no trees where clients fly first
    flight = Flight(FlightConfig(seed=3, wind_m_s=5.0, world=world), folder=tmp_path)
    plan = moved_plan(read_plan(DEFAULT_PLAN), flight.config.home)
    keep_for_replay(flight, [point for _, point in planned_path(plan, flight.config.home)])  # as the command does
    flight.fly(lambda drone: fly_plan(drone, plan), seconds=40.0)
    flight.close()
    for name in LOGS:
        assert (tmp_path / name).read_bytes() == (folders[0] / name).read_bytes(), name


def test_another_seed_writes_other_bytes(folders, tmp_path):
    flight = Flight(FlightConfig(seed=4, wind_m_s=5.0), folder=tmp_path)
    flight.fly(lambda drone: drone.sleep(5.0))
    flight.close()
    gyro = [
        ULog(str(path / "flight.ulg")).get_dataset("sensor_combined").data["gyro_rad[0]"]
        for path in (tmp_path, folders[0])
    ]
    count = len(gyro[0])
    assert not np.array_equal(gyro[0], gyro[1][:count])


def test_pyulog_reads_the_topics_of_px4(folders):
    log = ULog(str(folders[0] / "flight.ulg"))
    topics = {data.name: data.data for data in log.data_list}
    assert set(topics) >= PX4_TOPICS
    assert not log.file_corruption
    assert log.msg_info_dict["sys_name"] == "Honeyguide"
    assert log.initial_parameters["MPC_XY_CRUISE"] > 0.0
    assert any("Armed" in message.message for message in log.logged_messages)

    attitude = np.stack([topics["vehicle_attitude"][f"q[{k}]"] for k in range(4)])
    np.testing.assert_allclose(np.linalg.norm(attitude, axis=0), 1.0, atol=1e-5)
    estimate, truth = topics["vehicle_local_position"], topics["vehicle_local_position_groundtruth"]
    np.testing.assert_array_equal(np.diff(truth["timestamp"]), 20_000)
    np.testing.assert_array_equal(np.diff(topics["sensor_combined"]["timestamp"]), 4_000)
    assert truth["z"].min() < -5.0
    late = truth["timestamp"] > 10_000_000
    np.testing.assert_allclose(estimate["z"][late], truth["z"][late], atol=1.0)


def test_pymavlink_reads_the_telemetry_log(folders):
    log = mavutil.mavlink_connection(str(folders[0] / "flight.tlog"), dialect="all")
    kinds, times_s = {}, []
    while (message := log.recv_match()) is not None:
        kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
        times_s.append(message._timestamp)
    log.close()
    assert "BAD_DATA" not in kinds
    assert kinds["ATTITUDE"] > 1000
    assert kinds["COMMAND_LONG"] >= 2  # what the client sent is there too
    assert kinds["MISSION_ITEM_INT"] == len(read_plan(DEFAULT_PLAN).items)
    assert times_s == sorted(times_s)
    assert times_s[-1] - times_s[0] == pytest.approx(40.0, abs=0.5)


def test_summary_is_json(folders):
    first, second = (json.loads((folder / "summary.json").read_text()) for folder in folders)
    assert first == second
    assert first["simulated_s"] == pytest.approx(40.0)
    assert not first["is_success"]
