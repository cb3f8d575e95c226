"""Flies with the optical flow sensor, breaks it in the air, and prints what a ground station and the replay told."""

import json
import sys
from pathlib import Path

from pymavlink.dialects.v20 import all as mavlink

from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from mission.estimate.estimate_run import estimator_table, run_estimator
from mission.estimate.sensor_log import prepare
from mission.estimate.sensor_ulog import read_ulog
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

WORLD = WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0)
FLOW_UNIT, OFF = 5.0, 1.0


def flown(folder):
    """The SYS_STATUS messages of a flight whose sensor falls silent."""
    vehicle_end, station_end = memory_pair(LinkRole.GROUND)
    flight = Flight(FlightConfig(world=WORLD, parameters={"SYS_FAILURE_EN": 1}), links=[vehicle_end], folder=folder)
    reader, heard = mavlink.MAVLink(None), []

    def listen():
        for data in station_end.receive():
            heard.extend(reader.parse_buffer(data) or [])

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(6.0)
        await drone.goto_ned(8.0, 0.0, -6.0)
        listen()
        await drone.command(mavlink.MAV_CMD_INJECT_FAILURE, FLOW_UNIT, OFF)
        await drone.sleep(4.0)
        listen()

    running = flight.fly(script, seconds=60.0)
    flight.close()
    if running.error:
        raise running.error
    return [message for message in heard if message.get_type() == "SYS_STATUS"]


def replayed(path):
    """How many samples the estimator fuses when it gets the log's sensors again."""
    recording = read_ulog(path)
    table = estimator_table(recording, {})
    events = run_estimator(prepare(recording, table), table, lambda _: None).events["flow"]
    return int(events["is_fused"].sum())


def main():
    folder = Path(sys.argv[1])
    bit = mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW
    statuses = flown(folder)
    reported = {
        "sensors": [sensor.name for sensor in FUSED_SENSORS],
        "present": bool(statuses[-1].onboard_control_sensors_present & bit),
        "healthy": [bool(status.onboard_control_sensors_health & bit) for status in statuses],
        "replayed": replayed(folder / "flight.ulg"),
    }
    print(json.dumps(reported))


if __name__ == "__main__":
    main()
