"""A thousand connections to each port that opens: what do they do to the vehicle's memory and pace?

`python -m tests.thousand_connections [COUNT]` starts an idle vehicle with live page, video and TCP port, connects COUNT
times to each (a third silent, a third with half a request, a third from a foreign website), and prints its memory.
"""

import resource
import socket
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

PORTS = {"page": 8123, "video": 8124, "MAVLink over TCP": 5790}
SENT = (b"", b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://evil.example\r\n\r\n")
MEMORY_MAX_MB = 1000.0
READY_S, STAY_S = 60.0, 8.0


def memory_mb(pid):
    """Resident, of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1000


def crowd(port, count):
    """Connects so often, stays, and leaves; returns how many were let in."""
    sockets = []
    for k in range(count):
        try:
            connection = socket.create_connection(("127.0.0.1", port), 2.0)
            connection.sendall(SENT[k % len(SENT)])
            sockets.append(connection)
        except OSError:
            continue
    time.sleep(STAY_S)
    for connection in sockets:
        connection.close()
    return len(sockets)


def main(count):
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4 * count + 100, limit), limit))
    command = [str(Path(sys.executable).with_name("honeyguide")), "fly", "--idle", "--view"]
    command += ["--view-port", str(PORTS["page"]), "--stream-port", str(PORTS["video"])]
    command += ["--tcp-port", str(PORTS["MAVLink over TCP"])]
    with TemporaryDirectory() as folder:
        log = Path(folder) / "said.txt"
        with (
            log.open("w") as said,
            subprocess.Popen([*command, "--run-folder", f"{folder}/run"], stdout=said) as flight,
        ):
            end_s = time.monotonic() + READY_S
            while "live page" not in log.read_text() and time.monotonic() < end_s:
                time.sleep(0.5)
            time.sleep(5.0)
            print(f"before: {memory_mb(flight.pid):.0f} MB")
            for name, port in PORTS.items():
                let_in = crowd(port, count)
                print(f"{name}: {let_in} of {count} let in, {memory_mb(flight.pid):.0f} MB", flush=True)
            is_alive, most_mb = flight.poll() is None, memory_mb(flight.pid)
            flight.terminate()
        print(next((line for line in reversed(log.read_text().splitlines()) if line.endswith(" x")), ""))
    return 0 if is_alive and most_mb < MEMORY_MAX_MB else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000))
