"""What is round the vehicle besides world and air: devices it carries, other aircraft, corrections for its receiver."""

from collections import deque
from collections.abc import Sequence

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
        ring_lag_us: from what the ring measures until the flight controller has it [us].
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
        ring_lag_us: int = 0,
    ) -> None:
        state = controller.state
        self._controller = controller
        self._traffic = SimulatedTraffic(traffic_count, home, seed)
        self._ring = ring
        self._ring_lag_us = ring_lag_us
        self._under_way: deque[tuple[int, Sequence[float], float]] = deque()  # of the ring
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
            self._under_way.append((time_us, self._ring.measure(yaw), yaw))
        while self._under_way and time_us >= self._under_way[0][0] + self._ring_lag_us:
            self._controller.obstacles.sensed(*self._under_way.popleft())
        if time_us >= self._next_traffic_us:
            self._next_traffic_us = time_us + TRAFFIC_PERIOD_US
            for aircraft in self._traffic.heard(time_us):
                self._controller.traffic.report(aircraft)
