"""A MAVLink server with files and no flight, in a process of its own.

`python -m tests.system.clients.file_server PORT FOLDER [DIALECT]`

pymavlink waits for its replies in a loop that never sleeps; in one process it would leave a server little time.
"""

import sys
from pathlib import Path
from time import sleep

from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import UdpLink
from common.folder import ConfinedFolder
from mission.flight import DIALECTS
from tests.unit.autopilot.mavlink.rig import AskedVehicle

FRAME_US = 20_000
FRAME_WALL_S = 0.004


def main(port, folder, dialect="px4"):
    vehicle = AskedVehicle()
    vehicle.host.files = ConfinedFolder(Path(folder))
    server = MavlinkServer(vehicle, [UdpLink(int(port))], DIALECTS[dialect])
    while True:
        vehicle.state.time_us += FRAME_US
        server.frame(vehicle.state.time_us)
        sleep(FRAME_WALL_S)


if __name__ == "__main__":
    main(*sys.argv[1:])
