"""A vehicle that hovers in lockstep while stations send it whatever they like.

It hovers 10 m above home on perfect sensors, so that truth and estimate can be held to the same bound. Where it hovers
is measured, not commanded: the position at which it had come to rest before the traffic began. Distances are between
that and each frame's position, once by the simulator's truth and once by the vehicle's own estimate.
"""

from time import process_time

import numpy as np

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from common.state_folder import StateFolder
from mission.flight import Flight, FlightConfig
from tests.fuzz.messages import Messages

HEIGHT_M = 10.0
HOLD_M = 0.5
STATIONS = 8


class Hover:
    """One flight and its stations.

    Args:
        seed: of the traffic.
        folder: an empty one for what the vehicle keeps: files, logs, parameters.
        dialect: what the stations take it for.
    """

    def __init__(self, seed, folder, dialect="px4"):
        pairs = [memory_pair(LinkRole.GROUND) for _ in range(STATIONS)]
        self.flight = Flight(
            FlightConfig(noise=0.0, dialect=dialect),
            links=[vehicle_end for vehicle_end, _ in pairs],
            state=StateFolder(folder),
        )
        self.ends = [station_end for _, station_end in pairs]
        server = self.flight.server
        rng = np.random.default_rng(seed)
        self.messages = [
            Messages(
                rng,
                server.message_handlers(),
                server.command_handlers(),
                server._endpoint.parameters.names,
                (255 - i, 190),
            )
            for i in range(STATIONS)
        ]
        self.sent = 0
        self.truth_m = self.estimate_m = 0.0  # farthest from where it was at rest
        self.worst_frame_s = 0.0  # of processor time
        running = self.flight.fly(self._climb)
        assert running.error is None, running.error
        for _ in range(250):
            self.flight.frame()
        self._truth_ned, self._estimate_ned = self._positions()

    @staticmethod
    async def _climb(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(HEIGHT_M)

    def _positions(self):
        truth = self.flight.rig.rows["truth"][0]["pos_ned"]
        return truth.copy(), np.array(self.flight.controller.state.estimate.pos_ned)

    def send(self, count, kind, per_frame, on_frame=None):
        """Sends `count` pieces and lets the vehicle work them off.

        Args:
            count: how many.
            kind: "valid" or "broken".
            per_frame: how many per station and frame.
            on_frame: gets how many have been sent.
        """
        for start in range(0, count, per_frame * STATIONS):
            for i in range(start, min(start + per_frame * STATIONS, count)):
                station = i % STATIONS
                self.ends[station].send(getattr(self.messages[station], kind)())
                self.sent += 1
            self.frame()
            if on_frame is not None:
                on_frame(min(start + per_frame * STATIONS, count))

    def frame(self):
        """One frame of the flight; checks that it is still where and what it was."""
        start_s = process_time()
        self.flight.frame()
        self.worst_frame_s = max(self.worst_frame_s, process_time() - start_s)
        for end in self.ends:
            end.receive()
        truth, estimate = self._positions()
        self.truth_m = max(self.truth_m, float(np.linalg.norm(truth - self._truth_ned)))
        self.estimate_m = max(self.estimate_m, float(np.linalg.norm(estimate - self._estimate_ned)))
        state = self.flight.controller.state
        assert state.is_armed, "disarmed in the air"
        assert state.mode is Mode.HOLD, f"left Hold for {Mode(state.mode).name}: {self.flight.drone.texts[-5:]}"
        assert self.truth_m < HOLD_M, f"moved {self.truth_m:.2f} m: {self.flight.drone.texts[-5:]}"
        assert self.estimate_m < HOLD_M, f"believes to have moved {self.estimate_m:.2f} m"

    def work_off(self):
        """Lets everything that waits be handled, and returns in how many frames."""
        for count in range(100_000):
            if not sum(channel.intake.fill() for channel in self.flight.server._endpoint.channels):
                return count
            self.frame()
        raise AssertionError("the server does not get through what has been sent")
