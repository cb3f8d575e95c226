"""The scripting client of a real PX4: what differs from our own vehicle, which speaks its language."""

from mission.client import CommandRefused
from mission.script import Drone

TAKES_IN_S = 3.0  # guess: until its navigator has read a mission that has been acknowledged
RETRY_S = 0.2


class Px4Drone(Drone):
    """See `Drone`."""

    async def start_mission(self, first: int = 0) -> None:
        end_us = self.time_us + int(TAKES_IN_S * 1e6)
        while True:
            try:
                return await super().start_mission(first)
            except CommandRefused:
                if self.time_us >= end_us:
                    raise
            await self.sleep(RETRY_S)
