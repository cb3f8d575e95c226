"""A flight in a batch: one row of the kernels and its own flight controller, without links, logs and cameras."""

from collections.abc import Iterator
from typing import Any

from autopilot.flight_controller import FlightController
from common.airframe import load_airframe
from mission.campaign.batch.row_rig import RowRig
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig, flight_parameters
from mission.log.flight_recorder import History
from mission.scenario.scenario import Scenario
from mission.simulator.failure_injection import RigInjector
from mission.simulator.flight_rig import flight_sensors, flight_wind
from mission.simulator.host_ports import host_ports
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.world.world import WorldMap


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
        row.set_sensors(flight_sensors(config))
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

    def see(self) -> None:
        """Runs the Python part of the flight controller."""
        self.controller.frame(self.time_us)
        self._note_ready()

    def begin_frame(self) -> None:
        """Nothing, as the three after it: the batch advances all, and keeps their history."""

    def advancing(self, ticks: range) -> Iterator[None]:
        del ticks
        return iter(())

    def end_frame(self) -> None:
        self.see()

    def restart(self) -> None:
        raise NotImplementedError

    def close(self) -> History:
        raise NotImplementedError
