"""The steps that a policy on board does: follow, go to a place, park. They need the extra `learn`."""

from math import nan

from autopilot.mavlink.wire.convert import degrees_e7
from common.geodesy import geodetic_from_ned
from mission.client import ScriptError
from mission.follow.follow_scoring import FollowWatch
from mission.park.park_session import pose_in
from mission.park.parking import drive, get_ready
from mission.scenario.flight.run import Run, VehicleRun
from mission.scenario.parts.steps import LetPolicyFly, PolicyGoto, PolicyPark
from mission.script import CMD_REPOSITION, FRAME_GLOBAL
from policies.companion.engagement import Phase
from policies.companion.vehicle_link import COMPONENT
from sim.world.spots import spots_of

ENGAGE_S = 20.0


async def follow(run: Run, vehicle: VehicleRun, step: LetPolicyFly) -> None:
    """Follows the owner for so long, or until it is over."""
    companion, drone = run.companion, vehicle.drone
    await drone.until(lambda: companion.phase is Phase.FLYING, ENGAGE_S, "the companion's taking over")
    run.watch = watch = FollowWatch(vehicle.flight, lambda: companion.phase is Phase.FLYING, step.for_s)
    watch.begin()
    await drone.until(lambda: watch.is_over, step.for_s + 1.0, "following")


async def go(run: Run, vehicle: VehicleRun, step: PolicyGoto) -> None:
    """Goes there, and waits until the vehicle has been handed back."""
    companion, flight, drone = run.companion, vehicle.flight, vehicle.drone
    north, east = step.to
    down = -float(flight.world.height(north, east)) - step.height_m
    lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, flight.config.home)
    place = degrees_e7(lat_deg), degrees_e7(lon_deg), alt_m
    await drone.command_int(
        CMD_REPOSITION, FRAME_GLOBAL, (-1.0, 0.0, 0.0, nan), *place, name="goto", component=COMPONENT
    )
    await drone.until(lambda: companion.phase is Phase.FLYING, ENGAGE_S, "the companion's taking over")
    begun_s = run.time_s
    await drone.until(lambda: companion.phase is not Phase.FLYING, step.timeout_s, "the way")
    run.measure(policy_goto_s=run.time_s - begun_s)


async def park(run: Run, vehicle: VehicleRun, step: PolicyPark) -> None:
    """Drives into a spot."""
    flight = vehicle.flight
    spots = {spot.number: spot for spot in spots_of(flight.world)}
    if step.spot not in spots or not spots[step.spot].is_free:
        free = ", ".join(str(number) for number, spot in spots.items() if spot.is_free)
        raise ScriptError(f"spot {step.spot} is not free; there are {free}")
    await get_ready(vehicle.drone)
    arrival = await drive(vehicle.drone, flight, run.companion, pose_in(spots[step.spot], is_reverse=step.is_reverse))
    run.measure(park_distance_m=arrival.distance_m, park_turn_deg=arrival.turn_deg, park_s=arrival.seconds)
    if not arrival.is_there:
        raise ScriptError(
            f"it {arrival.outcome} ({arrival.distance_m:.2f} m from the middle){arrival.why and ': '}{arrival.why}"
        )
