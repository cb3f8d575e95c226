"""The MAVLink of PX4's SITL as its start script opens it, for a stand-in: ports and system id of an instance.

In: what the stand-in is told of the truth, and commands. Out: heartbeat, attitude and place at both of its onboard
ports, and an acknowledgement to every command that is for it.
"""

import socket
from math import atan2

from pymavlink.dialects.v20 import common as mavlink

from bench.standins.px4 import ARMED, Px4StandIn

OFFBOARD, PAYLOAD = (14580, 14540), (14280, 14030)  # of instance 0: its own port, and where it speaks to
OFFBOARD_LAST = 14549  # from the tenth instance on
PERIOD_US = 40_000
COPTER, PX4, HOLD = 2, 12, 4 << 16 | 3 << 24


class Px4Links:
    """The links of one instance.

    Args:
        instance: its number.
    """

    def __init__(self, instance: int) -> None:
        self.system_id = instance + 1
        self.commands: list[mavlink.MAVLink_command_long_message] = []
        """Those that were for it."""
        self.strays: list[mavlink.MAVLink_message] = []
        """Messages that were for somebody else."""
        self._mav = mavlink.MAVLink(None, srcSystem=self.system_id, srcComponent=1)
        self._mav.robust_parsing = True
        self._ends = []
        for (own, other), last in ((OFFBOARD, OFFBOARD_LAST), (PAYLOAD, PAYLOAD[1] + 255)):
            end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            end.bind(("127.0.0.1", own + instance))
            end.setblocking(False)
            self._ends.append((end, ("127.0.0.1", min(other + instance, last))))
        self._said_us = -PERIOD_US

    def frame(self, px4: Px4StandIn) -> None:
        """Called before each answer to a sample: takes commands, and says what there is to say."""
        for end, address in self._ends:
            self._listen(end, address)
        if px4.time_us - self._said_us >= PERIOD_US:
            self._said_us = px4.time_us
            for message in self._telemetry(px4):
                data = message.pack(self._mav)
                for end, address in self._ends:
                    end.sendto(data, address)

    def _listen(self, end: socket.socket, address: tuple[str, int]) -> None:
        while True:
            try:
                data = end.recv(65_536)
            except (BlockingIOError, ConnectionError):
                return
            for message in self._mav.parse_buffer(data) or ():
                target = getattr(message, "target_system", 0)
                if target not in (0, self.system_id):
                    self.strays.append(message)
                elif message.get_type() == "COMMAND_LONG":
                    self.commands.append(message)
                    acknowledged = mavlink.MAVLink_command_ack_message(message.command, 0)
                    end.sendto(acknowledged.pack(self._mav), address)

    def _telemetry(self, px4: Px4StandIn) -> list[mavlink.MAVLink_message]:
        truth, ms = px4.truth, px4.time_us // 1000
        if truth is None:
            return []
        w, x, y, z = truth.attitude_quaternion
        yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        mode = 1 | (ARMED if px4.is_armed else 0)
        return [
            mavlink.MAVLink_heartbeat_message(COPTER, PX4, mode, HOLD, 4, 3),
            mavlink.MAVLink_attitude_message(ms, 0.0, 0.0, yaw, 0.0, 0.0, 0.0),
            mavlink.MAVLink_global_position_int_message(
                ms, truth.lat, truth.lon, truth.alt, 0, truth.vx, truth.vy, truth.vz, 65535
            ),
        ]

    def close(self) -> None:
        for end, _ in self._ends:
            end.close()
