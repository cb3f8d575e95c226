"""A flight in a batch: one row of the kernels and its own flight controller, without links, logs and cameras."""

from collections.abc import Iterator
from typing import Any

from autopilot.flight_controller import FlightController
from common.airframe import load_airframe
from common.kernels import FRAME_US
from mission.campaign.batch.row_rig import RowRig
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig, flight_parameters
from mission.log.flight_recorder import History
from mission.scenario.scenario import Scenario
from mission.simulator.failure_injection import RigInjector
from mission.simulator.flight_rig import flight_wind
from mission.simulator.host_ports import host_ports
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.world.world import WorldMap

QUIET_FRAMES = 5  # while a script waits, its flight controller's Python part looks ten times a second


class BatchFlight(FlightBase):
    """One vehicle of a batch; it has just booted.

    Args:
        config: what it is made from.
        scenario: of its run.
        rig: of all.
        i_vehicle: its row.
        world: the ground.
    """

    def __init__(self, config: FlightConfig, scenario: Scenario, rig: Rig, i_vehicle: int, world: WorldMap) -> None:
        super().__init__(config, load_airframe(config.airframe))
        vehicle = class_of(self.airframe).vehicle
        self.drives, self.world = False, world
        row: Any = RowRig(rig, i_vehicle)
        self.rig = row
        row.seed(config.seed)
        row.set_sensors(sensor_model(noise_scale=config.noise, home=config.home))
        row.set_air(flight_wind(config.wind_m_s, config.wind_from_deg))
        if scenario.wind.turbulence_m_s is not None:
            self.set_air(scenario.wind.speed_m_s, scenario.wind.from_deg, scenario.wind.turbulence_m_s)
        self.params = flight_parameters(config, self.airframe)
        row.load_parameters(self.params, config.home)
        motors = len(vehicle.motors(self.airframe))
        self.injector = RigInjector(row, self.airframe, config.noise, motors)
        self.controller = FlightController(
            host_ports(rig, i_vehicle), self.params, self.airframe, config.home, self.texts,
            injector=self.injector, vehicle=vehicle,
        )  # fmt: skip
        self._seen_us = 0

    def begin_frame(self) -> None:
        self.injector.frame(self.time_us)

    def advancing(self, ticks: range) -> Iterator[None]:
        """The batch advances all."""
        del ticks
        return iter(())

    def end_frame(self) -> None:
        self.time_us += FRAME_US
        self.see()

    def see(self) -> None:
        """Runs the Python part of the flight controller."""
        self._seen_us = self.time_us
        self.controller.frame(self.time_us)
        self._note_ready()

    def pass_frame(self) -> None:
        """Lets a frame pass in which nothing is to be decided."""
        self.time_us += FRAME_US
        if self.time_us - self._seen_us >= QUIET_FRAMES * FRAME_US:
            self.see()

    def restart(self) -> None:
        """Nobody asks for it in a batch."""

    def close(self) -> History:
        """The batch keeps the history."""
        raise NotImplementedError
