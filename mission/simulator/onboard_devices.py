"""What is round the vehicle besides world and air: devices it carries, other aircraft, corrections for its receiver."""

from autopilot.flight_controller import FlightController
from common.geodesy import GeoPoint
from common.records import row_reader
from sim.devices import Gripper, Winch
from sim.rig import Rig
from sim.rtk import RtkReceiver
from sim.sensors.ground_ring import GroundRing
from sim.sensors.ring import RingSensor
from sim.simulated_traffic import SimulatedTraffic

TRAFFIC_PERIOD_US = 1_000_000
RING_PERIOD_US = 100_000


def ring_of(*, drives: bool) -> type[RingSensor] | type[GroundRing]:
    """The ring of range finders that such a vehicle carries."""
    return GroundRing if drives else RingSensor


class Surroundings:
    """Connects the simulation's devices and aircraft to the flight controller.

    Args:
        controller: gets them.
        rig: its sensors.
        receiver: gets the corrections.
        traffic_count: aircraft in the sky.
        ring: looks round the vehicle, if it carries one.
        home: the middle of their area.
        seed: of their ways.
    """

    def __init__(
        self,
        controller: FlightController,
        rig: Rig,
        receiver: RtkReceiver,
        traffic_count: int,
        ring: RingSensor | GroundRing | None,
        home: GeoPoint,
        seed: int,
    ) -> None:
        state = controller.state
        self._controller = controller
        self._traffic = SimulatedTraffic(traffic_count, home, seed)
        self._ring = ring
        self._next_ring_us = 0 if ring is not None else 1 << 62
        self._next_traffic_us = 0 if traffic_count else 1 << 62
        self._receiver = receiver
        winch = Winch(lambda: state.time_us)
        controller.payload.add(Gripper())
        controller.payload.add(winch)
        state.read_winch = winch.status
        controller.host.read_truth = row_reader(rig.rows["truth"], 0, "Truth")

    def frame(self, time_us: int) -> None:
        """What happens by itself; before the flight controller's frame."""
        self._receiver.frame(time_us)
        if self._ring is not None and time_us >= self._next_ring_us:
            self._next_ring_us = time_us + RING_PERIOD_US
            yaw = self._controller.state.yaw_rad
            self._controller.obstacles.sensed(time_us, self._ring.measure(yaw), yaw)
        if time_us >= self._next_traffic_us:
            self._next_traffic_us = time_us + TRAFFIC_PERIOD_US
            for aircraft in self._traffic.heard(time_us):
                self._controller.traffic.report(aircraft)
