"""Runs a script against any running vehicle, over UDP, on the vehicle's own clock.

The vehicle may fly at any multiple of real time: waits and time-outs of the script follow the time in its telemetry.
The wall clock only paces the polling and notices a vehicle that has gone silent.
"""

from autopilot.mavlink.client_end import ByteLink
from autopilot.mavlink.transport.links import LinkRole, UdpLink
from common.clock import Pacer, wall_time_s
from mission.client import Running, ScriptError
from mission.script import Drone, Script

POLL_US = 5_000
SILENCE_S = 10.0  # of wall clock time, after which the vehicle counts as gone


def fly_over_udp(
    script: Script,
    *,
    port: int = 14540,
    vehicle_port: int = 14580,
    host: str = "127.0.0.1",
    silence_s: float = SILENCE_S,
) -> Running:
    """Runs a script to its end and returns it; its `error` is set if it failed.

    Args:
        script: a coroutine function of a `Drone`.
        port: where the vehicle sends to: 14540 for programs, 14550 for ground stations.
        vehicle_port: the vehicle's own end.
        host: where the vehicle is.
        silence_s: wall clock seconds without a message after which it is given up.

    Raises:
        LinkError: the port is in use.
        ScriptError: no vehicle is there, or it has gone silent.
    """
    link = UdpLink(vehicle_port, LinkRole.ONBOARD, host, local_port=port)
    vehicle = RemoteVehicle(link, f"UDP port {port}", silence_s=silence_s)
    running = vehicle.drone.start(script(vehicle.drone))
    pacer, polled_us = Pacer(1.0), 0
    try:
        while not running.is_done:
            vehicle.poll()
            polled_us += POLL_US
            pacer.wait_until(polled_us)
        return running
    finally:
        running.cancel()
        vehicle.close()


class RemoteVehicle:
    """A vehicle in another process, and its clock.

    Args:
        link: to it.
        place: where it is looked for, in words.
        system_id: its own.
        silence_s: wall clock seconds without a message after which it is given up.
        make_drone: who speaks its way.
    """

    def __init__(
        self,
        link: ByteLink,
        place: str,
        *,
        system_id: int = 1,
        silence_s: float = SILENCE_S,
        make_drone: type[Drone] = Drone,
    ) -> None:
        self._link, self._place, self._silence_s = link, place, silence_s
        self.drone = make_drone(link, system_id=system_id)
        self._time_us = 0  # simulated
        self._reported_us, self._boot_us = 0, 0  # the vehicle's clock, and when that began
        self._heard_s = wall_time_s()

    def poll(self) -> None:
        """Takes in what has arrived, and runs the drone's scripts on.

        Raises:
            ScriptError: the vehicle has gone silent.
        """
        self.drone.frame(self._time_us)
        attitude = self.drone.latest("ATTITUDE")
        if attitude is not None and attitude.time_boot_ms * 1000 != self._reported_us:
            if attitude.time_boot_ms * 1000 < self._reported_us:  # restarted: the script's time goes on
                self._boot_us = self._time_us
            self._reported_us, self._heard_s = attitude.time_boot_ms * 1000, wall_time_s()
            self._time_us = self._boot_us + self._reported_us
        elif wall_time_s() - self._heard_s > self._silence_s:
            raise ScriptError(f"{self._place}: no vehicle has been heard for {self._silence_s:g} s")

    def close(self) -> None:
        """Closes the link."""
        self._link.close()
