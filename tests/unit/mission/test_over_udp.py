"""A script's time over a vehicle that restarts: the vehicle's clock begins again, the script's goes on."""

from autopilot.mavlink.transport.links import LinkRole
from autopilot.mavlink.wire.codec import encode
from mission.over_udp import RemoteVehicle

STEP_MS = 100


class RestartingVehicle:
    """A link on which ATTITUDE is heard at each look, and whose clock begins again once."""

    def __init__(self, restart_ms):
        self.role = LinkRole.ONBOARD
        self._times_ms = [*range(STEP_MS, restart_ms, STEP_MS), *range(STEP_MS, 60_000, STEP_MS)]
        self._heard = 0

    def receive(self):
        time_ms = self._times_ms[self._heard]
        self._heard += 1
        return [encode("ATTITUDE", 1, 1, self._heard & 0xFF, time_boot_ms=time_ms)]

    def send(self, data):
        pass


def test_a_restart_of_the_vehicle_does_not_turn_the_scripts_time_back():
    times_s = []

    async def script(drone):
        for _ in range(4):
            await drone.sleep(1.0)
            times_s.append(drone.time_us * 1e-6)

    vehicle = RemoteVehicle(RestartingVehicle(2_500), "here")
    running = vehicle.drone.start(script(vehicle.drone))
    while not running.is_done:
        vehicle.poll()
    assert times_s == sorted(times_s)
    assert times_s[-1] < 4.6
