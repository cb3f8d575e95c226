"""A camera under a vehicle that sees the target of a precision landing, and reports it by LANDING_TARGET."""

from math import atan2, hypot

import numpy as np

from common.attitude import Vector
from mission.client import ScriptTimeout
from mission.scenario.flight.quantities import hold_now
from mission.scenario.flight.run import Run, VehicleRun
from mission.scenario.parts.conditions import terms_of
from mission.scenario.parts.steps import PrecisionLand

PERIOD_S, NOISE_RAD = 0.1, 0.01
NEAREST_M = 0.05  # nearer, it sees nothing
BODY_FRD = 12  # MAV_FRAME
_STREAM = 0x5054  # of its noise


async def send_sightings(run: Run, vehicle: VehicleRun, step: PrecisionLand) -> None:
    """Reports what it sees until the vehicle is disarmed, or what the step waits for holds.

    Raises:
        ScriptTimeout: neither comes in time.
    """
    drone = vehicle.drone
    rng = np.random.default_rng([vehicle.flight.config.seed, _STREAM])
    end_us = drone.time_us + round(step.timeout_s * 1e6)
    terms = None if step.until is None else terms_of(step.until)
    while drone.is_armed and not (terms is not None and hold_now(vehicle.flight, terms)):
        if drone.time_us >= end_us:
            raise ScriptTimeout(f"{step.until or 'landed and disarmed'}: nothing within {step.timeout_s:g} s")
        angles = _angles(vehicle, _target_ned(run, vehicle, step))
        noise = rng.normal(0.0, NOISE_RAD, 2)
        if angles is not None:
            x, y = angles[0] + float(noise[0]), angles[1] + float(noise[1])
            drone.send("LANDING_TARGET", angle_x=x, angle_y=y, frame=BODY_FRD)
        await drone.sleep(PERIOD_S)


def _target_ned(run: Run, vehicle: VehicleRun, step: PrecisionLand) -> Vector:
    if step.target_vehicle is not None:
        return run.pos_ned(step.target_vehicle)
    north, east = step.target_ne_m or (0.0, 0.0)
    return north, east, -float(vehicle.flight.world.height(north, east))


def _angles(vehicle: VehicleRun, target_ned: Vector) -> tuple[float, float] | None:
    """To the right and forward of straight down [rad]; None: it is outside the picture, 45 degrees to each side."""
    truth = vehicle.flight.rig.rows["truth"][0]
    x, y, z, w = (float(value) for value in truth["q_ned_from_frd"])
    down_frd = np.array([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)])
    north_frd = np.array([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)])
    east_frd = np.cross(down_frd, north_frd)
    offset = np.array(target_ned) - truth["pos_ned"].astype(float)
    ray = offset[0] * north_frd + offset[1] * east_frd + offset[2] * down_frd
    if ray[2] <= NEAREST_M or hypot(ray[0], ray[1]) > ray[2]:
        return None
    return atan2(ray[1], ray[2]), atan2(-ray[0], ray[2])
