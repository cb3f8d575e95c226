"""Which campaigns can be flown in a batch. Light to import.

All vehicles of a batch are in one world and of one airframe, and no client is there: what needs MAVLink, a companion or
a world of its own is flown by processes.
"""

from mission.campaign.campaign import Campaign

STEPS = ("arm", "takeoff", "goto_ned", "hold", "wait", "speed", "mark", "land", "return_home", "wait_disarmed")
FAULTS = ("wind", "sensor", "motor", "battery")
LEFT_OUT_CHECKS = ("separation", "following", "scorecard", "interventions", "figures", "reached")
SHARED_KEYS = (
    "world",
    "home",
    "vehicle.airframe",
    "vehicles.0.airframe",
    "vehicle.start.ne_m",
    "vehicles.0.start.ne_m",
)


def batch_refusal(campaign: Campaign) -> str:
    """Why it cannot be flown in a batch, in a sentence; "": it can."""
    scenario = campaign.flown
    fleet = scenario.fleet
    vehicle = fleet[0]
    wrong = {
        "there are several vehicles": len(fleet) > 1,
        "it has an owner": scenario.owner is not None,
        "it has a policy": vehicle.policy is not None,
        "its vehicle flies a plan": vehicle.plan is not None,
        "its vehicle is flown by Python": vehicle.python is not None,
        "its vehicle is thrown": vehicle.throw_m_s is not None,
        "it has other aircraft": scenario.traffic > 0,
        "it has a ground station": scenario.has_ground_station,
        "its vehicle has a lidar or a base station": vehicle.has_lidar or vehicle.has_base,
        f"its engine is {scenario.engine}": scenario.engine != "native",
    }
    reasons = [reason for reason, is_so in wrong.items() if is_so]
    reasons += [f"step {s.name_chosen} needs MAVLink" for s in vehicle.script if s.name_chosen not in STEPS]
    reasons += [f"fault {f.name_chosen} needs links" for f in scenario.faults if f.name_chosen not in FAULTS]
    checks = [each.name_chosen for each in scenario.checks]
    reasons += [f"check {name} needs more than a batch has" for name in checks if name in LEFT_OUT_CHECKS]
    reasons += [f"{key} varies, and all are in one world" for key in campaign.vary if key.startswith(SHARED_KEYS)]
    return f"--batch: {reasons[0]}; fly it without --batch" if reasons else ""
