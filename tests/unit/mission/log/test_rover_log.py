"""What the log and the summary say of a vehicle that stays on the ground."""

import numpy as np
import pytest
from pyulog import ULog

from autopilot.interface.vehicle_state import Mode
from mission.flight import Flight, FlightConfig
from mission.log.flight_plots import plot_flight
from mission.log.flight_summary import summarise
from sim.world.world import WorldConfig

PLAIN = WorldConfig(size_m=64.0, trees_per_ha=0.0, hill_height_m=0.0)


class Driven:
    """A short drive round a corner, and its log."""

    def __init__(self, name, folder):
        flight = Flight(FlightConfig(airframe=name, world=PLAIN), folder=folder)
        running = flight.fly(self._drive, seconds=12.0)
        self.outputs = flight.controller.state.outputs
        self.command = flight.rig.arrays.autopilot.control.numpy()["actuators"][0]["command"].copy()
        self.history = flight.close()
        self.history.mode[:] = Mode.MISSION
        plans = ([(-1, np.zeros(3)), (0, np.array([20.0, 0.0, down]))] for down in (0.0, -30.0))
        self.level, self.high = (summarise(flight, self.history, running, plan) for plan in plans)
        self.world = flight.world
        log = ULog(str(folder / "flight.ulg"))
        self.topics = {data.name: data.data for data in log.data_list}

    @staticmethod
    async def _drive(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.goto_ned(6.0, 8.0, 0.0)


@pytest.fixture(scope="module", params=["rover", "rover-skid"])
def driven(request, tmp_path_factory):
    return Driven(request.param, tmp_path_factory.mktemp(request.param))


def test_motors_and_servos_are_logged_apart_and_what_is_not_there_is_nan(driven):
    motors, servos = driven.topics["actuator_motors"], driven.topics["actuator_servos"]
    kinds = [output.kind.value for output in driven.outputs]
    for topic, kind, room in ((motors, "motor", 12), (servos, "servo", 8)):
        here = [i for i, each in enumerate(kinds) if each == kind]
        last = [topic[f"control[{k}]"][-1] for k in range(room)]
        assert last[: len(here)] == driven.command[here].tolist()
        assert np.isnan(last[len(here) :]).all()


def test_encoders_are_logged_as_fast_as_the_vehicle_drives(driven):
    encoders, truth = driven.topics["wheel_encoders"], driven.topics["vehicle_local_position_groundtruth"]
    mean = 0.5 * (encoders["left_m_s"] + encoders["right_m_s"])
    true = np.interp(encoders["timestamp"], truth["timestamp"], np.hypot(truth["vx"], truth["vy"]))
    assert true.max() > 1.0
    assert np.median(np.abs(mean - true)) < 0.1


def test_the_height_of_a_plan_is_no_error_of_what_drives(driven):
    assert driven.high.cross_track_p95_m == pytest.approx(driven.level.cross_track_p95_m, abs=1e-9)
    assert driven.level.cross_track_p95_m > 2.0  # it drove elsewhere


def test_the_picture_of_a_drive_is_written(driven, tmp_path):
    plot_flight(driven.history, driven.world, [], "rover", tmp_path / "flight.png", True)
    assert (tmp_path / "flight.png").stat().st_size > 10_000
