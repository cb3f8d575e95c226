"""Twenty clients at once, one of them flooding: what do the others notice?

`python -m tests.many_clients` starts a vehicle, alternates between peace and flood, and prints what it measured. All
times are on the wall clock of this machine; the vehicle flies at real time, so that a frame lasts 20 ms.
"""

import select
import socket
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from autopilot.mavlink.channel import AUTOPILOT_COMPONENT
from autopilot.mavlink.wire.codec import FrameReader, encode, known_type
from tests.system.vehicle import IdleVehicle

CLIENTS = 20
ASK_EVERY_S = 0.1
FLOOD_PER_S = 20_000
_ACK, _HEARTBEAT = known_type("COMMAND_ACK").msg_id, known_type("HEARTBEAT").msg_id

FLOOD = f"""
import socket, sys, time
from autopilot.mavlink.wire.codec import encode
flood = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
flood.setblocking(False)
ask = dict(target_system=1, target_component=1, command=512, param1=148.0)
frames = [encode("COMMAND_LONG", 66, 190, i, **ask) for i in range(256)]
start, sent = time.perf_counter(), 0
while True:
    while sent < {FLOOD_PER_S} * (time.perf_counter() - start):
        try:
            flood.sendto(frames[sent & 255], ("127.0.0.1", int(sys.argv[1])))
        except OSError:
            pass
        sent += 1
    time.sleep(0.001)
"""


@dataclass
class Noticed:
    """What the clients saw in one stretch of time."""

    latencies_s: list = field(default_factory=list)  # from a command to its acknowledgement
    heartbeat_gaps_s: list = field(default_factory=list)
    unanswered: int = 0

    @property
    def latency_s(self):
        return float(np.median(self.latencies_s))

    @property
    def jitter_s(self):
        """Of the heartbeat: mean distance from 1 s."""
        return float(np.mean(np.abs(np.array(self.heartbeat_gaps_s) - 1.0)))


class Clients:
    """Twenty sockets that ask and listen."""

    def __init__(self, vehicle_port, seed=0):
        self._to = ("127.0.0.1", vehicle_port)
        self._rng = np.random.default_rng(seed)
        self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(CLIENTS)]
        self._readers = [FrameReader() for _ in range(CLIENTS)]
        self._asked_s = [None] * CLIENTS
        self._heartbeat_s = [None] * CLIENTS
        for client in self._sockets:
            client.bind(("127.0.0.1", 0))
            client.setblocking(False)
        self._poller = select.poll()
        for client in self._sockets:
            self._poller.register(client, select.POLLIN)
        self._by_fileno = {client.fileno(): i for i, client in enumerate(self._sockets)}

    def run(self, seconds, noticed):
        """Asks and listens; each client at times that have nothing to do with the vehicle's frames."""
        start_s = perf_counter()
        due_s = start_s + self._rng.uniform(0.0, ASK_EVERY_S, CLIENTS)
        self._asked_s = [None] * CLIENTS
        self._heartbeat_s = [None] * CLIENTS
        while (now_s := perf_counter()) < start_s + seconds:
            for i in np.flatnonzero(due_s <= now_s):
                due_s[i] = now_s + self._rng.uniform(0.5, 1.5) * ASK_EVERY_S
                noticed.unanswered += self._asked_s[i] is not None and now_s - self._asked_s[i] > 1.0
                if self._asked_s[i] is None or now_s - self._asked_s[i] > 1.0:
                    self._ask(int(i))
            for fileno, _ in self._poller.poll(1):
                self._listen(self._by_fileno[fileno], noticed)

    def _ask(self, i):
        ask = {"target_system": 1, "target_component": 1, "command": 512, "param1": 242.0}
        self._sockets[i].sendto(encode("COMMAND_LONG", 100 + i, 190, 0, **ask), self._to)
        self._asked_s[i] = perf_counter()

    def _listen(self, i, noticed):
        now_s = perf_counter()
        for frame in self._readers[i].feed(self._sockets[i].recv(65535), is_whole=True):
            if frame.sysid != 1:
                continue
            if frame.kind.msg_id == _ACK and self._asked_s[i] is not None:
                noticed.latencies_s.append(now_s - self._asked_s[i])
                self._asked_s[i] = None
            elif frame.kind.msg_id == _HEARTBEAT and frame.compid == AUTOPILOT_COMPONENT:
                if self._heartbeat_s[i] is not None:
                    noticed.heartbeat_gaps_s.append(now_s - self._heartbeat_s[i])
                self._heartbeat_s[i] = now_s

    def close(self):
        for client in self._sockets:
            client.close()


def measure(folder, rounds=3, seconds=4.0):
    """What was noticed in peace and under the flood, in turns."""
    peace, flood = Noticed(), Noticed()
    with IdleVehicle(folder, "--trees", 0, speed=1.0) as vehicle:
        port = vehicle.gcs_port + 4020
        clients = Clients(port)
        clients.run(4.0, Noticed())
        for _ in range(20):  # until the vehicle is up
            warm = Noticed()
            clients.run(1.0, warm)
            if len(warm.latencies_s) > CLIENTS:
                break
        for _ in range(rounds):
            clients.run(seconds, peace)
            flooding = subprocess.Popen([sys.executable, "-c", FLOOD, str(port)], cwd=Path(__file__).parents[1])
            try:
                clients.run(1.0, Noticed())  # until it has begun
                clients.run(seconds, flood)
            finally:
                flooding.kill()
                flooding.wait()
            clients.run(0.5, Noticed())
        clients.close()
    return peace, flood


def main():
    with TemporaryDirectory() as folder:
        peace, flood = measure(Path(folder))
    for name, noticed in (("peace", peace), (f"flood of {FLOOD_PER_S} messages/s", flood)):
        print(
            f"{name}: {len(noticed.latencies_s)} commands acknowledged in {1e3 * noticed.latency_s:.1f} ms (median), "
            f"{1e3 * float(np.percentile(noticed.latencies_s, 95)):.1f} ms (95 %), {noticed.unanswered} never; "
            f"heartbeat {1e3 * noticed.jitter_s:.1f} ms off its second"
        )


if __name__ == "__main__":
    main()
