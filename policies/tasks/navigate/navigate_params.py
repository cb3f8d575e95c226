"""Navigate's numbers: the forest, the way to the goal, the rangefinder, and what the reward weighs.

The numbers of the air and the vehicle come first (`FLIGHT_PARAMS`); all can be set or randomised by name.
"""

from dataclasses import replace

import warp as wp

from policies.tasks.flight.flight_params import FLIGHT_PARAMS
from policies.tasks.flight.reported import REPORT_PARAMS
from policies.tasks.navigate.observe import GOAL_MAX_M, ROVER_GOAL_MAX_M
from policies.tasks.task_params import Sampler, TaskParam
from sim.world.forest_world import TREES_PER_HA_MAX

_WANTED = "the requirement: 600 trees/ha at 5 m/s"


@wp.struct
class NavigateParams:
    """One row per environment; declared in `NAVIGATE_PARAMS`, in the same order."""

    hill_height_m: float
    trees_per_ha: float
    episodes_per_world: float
    goal_min_m: float
    goal_max_m: float
    goal_height_m: float
    goal_radius_m: float
    slowest_m_s: float
    ceiling_m: float
    range_noise: float
    speed_m_s: float
    progress_reward: float
    goal_reward: float
    time_cost: float
    collision_cost: float
    ceiling_cost: float
    clearance_m: float
    clearance_cost: float
    height_cost: float
    heading_cost: float
    jerk_cost: float
    turn_cost: float
    kept_m: float
    walk_m_s: float
    scan_lag_s: float
    attitude_error_deg: float


NAVIGATE_PARAMS = (
    TaskParam("hill_height_m", 4.0, 0.0, 30.0, "m", "bound of the hills above and valleys below the start", "guess"),
    TaskParam("trees_per_ha", 600.0, 0.0, TREES_PER_HA_MAX, "1/ha", "trees per hectare", _WANTED),
    TaskParam(
        "episodes_per_world", 1.0, 1.0, 1000.0, "1", "episodes flown in a forest, each to a goal of its own", "tuned"
    ),
    # trees stand up to 91 m from home
    TaskParam("goal_min_m", 60.0, 10.0, GOAL_MAX_M, "m", "the goal is at least this far away", "guess"),
    TaskParam("goal_max_m", 85.0, 10.0, GOAL_MAX_M, "m", "and at most this far", "guess"),
    TaskParam("goal_height_m", 2.0, 0.0, 10.0, "m", "of the goal above the ground, and the height to fly at", "guess"),
    TaskParam("goal_radius_m", 3.0, 0.5, 20.0, "m", "nearer is arrived", "guess: twice what GNSS is off"),
    TaskParam("slowest_m_s", 3.0, 0.5, 20.0, "m/s", "time is up for who is slower, in a straight line", "guess"),
    TaskParam("ceiling_m", 4.0, 2.0, 100.0, "m", "higher above the ground counts as over the forest", "guess"),
    TaskParam("range_noise", 1.0, 0.0, 4.0, "1", "factor on the errors of ranges and depths", "guess"),
    TaskParam("speed_m_s", 6.0, 0.5, 7.0, "m/s", "faster progress is not paid more; the mean is to be 5", _WANTED),
    TaskParam("progress_reward", 0.2, 0.0, 10.0, "1", "per metre towards the goal", "tuned"),
    TaskParam("goal_reward", 5.0, 0.0, 1000.0, "1", "of arriving, which ends the episode", "tuned"),
    TaskParam("time_cost", 0.05, 0.0, 10.0, "1", "per decision: careful is not to be slow", "tuned"),
    TaskParam("collision_cost", 8.0, 0.0, 1000.0, "1", "of touching anything, which ends the episode", "tuned"),
    TaskParam("ceiling_cost", 8.0, 0.0, 1000.0, "1", "of leaving the forest upwards, which ends the episode", "tuned"),
    TaskParam("clearance_m", 1.2, 0.0, 2.0, "m", "room to obstacles below which there is a cost", "tuned"),
    TaskParam("clearance_cost", 0.1, 0.0, 10.0, "1", "per decision for no room at all, growing as the square", "tuned"),
    TaskParam("height_cost", 0.01, 0.0, 10.0, "1", "per decision and squared metre off the goal's height", "tuned"),
    TaskParam("heading_cost", 0.03, 0.0, 10.0, "1", "per decision of flying backwards; half of it sideways", "tuned"),
    TaskParam("jerk_cost", 0.005, 0.0, 10.0, "1", "per decision for the squared change of the action", "tuned"),
    TaskParam("turn_cost", 0.001, 0.0, 10.0, "1", "per decision for the squared yaw rate asked for", "tuned"),
    TaskParam("kept_m", 0.0, -10.0, 10.0, "m", "above 0 the goal walks, and is followed so far behind", "ours"),
    TaskParam("walk_m_s", 1.8, 0.0, 5.0, "m/s", "how fast it walks at most", "guess"),
    *REPORT_PARAMS,
)
PARAMS = (*FLIGHT_PARAMS, *NAVIGATE_PARAMS)
ROVER_GOALS_M = {"goal_min_m": 30.0, "goal_max_m": ROVER_GOAL_MAX_M}  # trees and walls stand up to 51 m from home
ROVER_PARAMS = tuple(
    replace(number, default=ROVER_GOALS_M[number.name], maximum=ROVER_GOAL_MAX_M)
    if number.name in ROVER_GOALS_M
    else number
    for number in PARAMS
)

# What a day outside may bring.
IMPROVED: dict[str, float | Sampler] = {
    "wind_m_s": Sampler(intervals=((0.0, 6.0),)),
    "wind_gust_m_s": Sampler(intervals=((0.0, 3.0),)),
    "sensor_noise": Sampler(intervals=((0.5, 1.5),)),
    "mass_scale": Sampler(intervals=((0.9, 1.15),)),
    "motor_scale": Sampler(intervals=((0.93, 1.07),)),
    "hill_height_m": Sampler(intervals=((0.0, 6.0),)),
}
ROVER: dict[str, float | Sampler] = {
    **IMPROVED,
    "hill_height_m": Sampler(intervals=((0.0, 3.0),)),
    "trees_per_ha": 400.0,
    "goal_height_m": 0.0,
    "slowest_m_s": 1.0,
    "speed_m_s": 4.0,
    "clearance_m": 0.8,
}
