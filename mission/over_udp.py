"""Runs a script against any running vehicle, over UDP, on the vehicle's own clock.

The vehicle may fly at any multiple of real time: waits and time-outs of the script follow the time in its telemetry.
The wall clock only paces the polling and notices a vehicle that has gone silent.
"""

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
    try:
        return _run(Drone(link), script, f"UDP port {port}", silence_s)
    finally:
        link.close()


def _run(drone: Drone, script: Script, place: str, silence_s: float) -> Running:
    running = drone.start(script(drone))
    pacer, polled_us = Pacer(1.0), 0
    time_us, reported_us, boot_us = 0, 0, 0  # simulated time; the vehicle's clock, and when that began
    heard_s = wall_time_s()
    while not running.is_done:
        drone.frame(time_us)
        attitude = drone.latest("ATTITUDE")
        if attitude is not None and attitude.time_boot_ms * 1000 != reported_us:
            if attitude.time_boot_ms * 1000 < reported_us:  # restarted: the script's time goes on
                boot_us = time_us
            reported_us, heard_s = attitude.time_boot_ms * 1000, wall_time_s()
            time_us = boot_us + reported_us
        elif wall_time_s() - heard_s > silence_s:
            running.cancel()
            raise ScriptError(f"{place}: no vehicle has been heard for {silence_s:g} s")
        polled_us += POLL_US
        pacer.wait_until(polled_us)
    return running
