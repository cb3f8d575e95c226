"""Rig of the tests of driving by a policy: a rover in a car park, in lockstep, its place known to centimetres."""

from math import atan2, degrees, hypot, pi

from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_driver
from policies.companion.vector_pilot import DrivingPilot
from policies.learn.export.policy_file import load_policy
from policies.pretrained.pretrained_policies import pretrained
from sim.world.driving_worlds import CAR_PARK
from tests.unit.mission.follow.goto_flight import advance, goto_fields

COMPANION = 191
LOT = CAR_PARK.model_copy(update={"seed": 6, "mover_count": 0})


def shipped_pilot(name="drive-park"):
    path = pretrained(name)
    return DrivingPilot(load_policy(path)[0], str(path))


def standing(*, is_reported=True, is_by_sticks=False, pilot=None, folder=None, links=(), **changed):
    """A rover that is armed and holds, and its companion."""
    config = {"airframe": "rover", "has_lidar": True, "has_base": True, "world": LOT, "seed": 6}
    config["parameters"] = {"HG_RO_OFFB_BODY": 1.0}
    options = {"is_reported": is_reported, "is_by_sticks": is_by_sticks, "folder": folder, "links": links}
    flight, companion = flight_with_driver(FlightConfig(**config | changed), pilot or shipped_pilot(), **options)

    async def arm(drone):
        await drone.wait_ready()
        await drone.arm()

    flight.fly(arm, seconds=40.0)
    advance(flight, 1.0)
    return flight, companion


def pose_fields(flight, pose):
    """Of a COMMAND_INT that asks the companion for a pose: north, east [m] and heading [rad]."""
    return goto_fields(flight, (pose[0], pose[1], 0.0), COMPANION, pose[2])


def send_goto(flight, pose):
    """Asks the companion for a pose: north, east [m] and heading [rad]."""
    flight.drone.send("COMMAND_INT", **pose_fields(flight, pose))


def miss(flight, pose):
    """How far [m] and by which angle [deg] the vehicle truly is off a pose."""
    truth = flight.rig.rows["truth"][0]
    x, y, z, w = (float(value) for value in truth["q_ned_from_frd"])
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    north, east = (float(value) for value in truth["pos_ned"][:2])
    return hypot(pose[0] - north, pose[1] - east), abs(degrees((pose[2] - yaw + pi) % (2.0 * pi) - pi))


def impact_m_s(flight):
    return float(flight.rig.rows["truth"][0]["impact_speed"])
