"""Drive's parameters: what the task, the ground and the vehicle are like, what is paid, and what presets draw."""

import warp as wp

from policies.tasks.flight.flight_params import FLIGHT_PARAMS
from policies.tasks.flight.reported import REPORT_PARAMS
from policies.tasks.task_params import Sampler, TaskParam


@wp.struct
class DriveParams:
    """One row per environment; declared in `DRIVE_PARAMS`, in the same order."""

    reach_m: float
    align_deg: float
    stop_m_s: float
    goal_min_m: float
    goal_max_m: float
    slowest_m_s: float
    extra_time_s: float
    hill_height_m: float
    trees_per_ha: float
    wall_count: float
    mover_count: float
    episodes_per_world: float
    range_noise: float
    friction_scale: float
    rolling_scale: float
    progress_reward: float
    arrive_reward: float
    time_cost: float
    idle_cost: float
    clearance_m: float
    clearance_cost: float
    jerk_cost: float
    hit_cost: float
    scan_lag_s: float
    attitude_error_deg: float


DRIVE_PARAMS = (
    TaskParam("reach_m", 0.3, 0.05, 5.0, "m", "distance from the goal that counts as there", "ours"),
    TaskParam("align_deg", 10.0, 1.0, 180.0, "deg", "error of the heading that counts as there", "ours"),
    TaskParam("stop_m_s", 0.3, 0.02, 5.0, "m/s", "speed that counts as standing", "ours"),
    TaskParam("goal_min_m", 5.0, 1.0, 36.0, "m", "least distance of the goal (`reach`)", "ours"),
    TaskParam("goal_max_m", 30.0, 1.0, 36.0, "m", "greatest distance of the goal (`reach`)", "ours"),
    TaskParam("slowest_m_s", 0.4, 0.1, 5.0, "m/s", "mean speed along the shortest path below which time is up", "ours"),
    TaskParam("extra_time_s", 25.0, 1.0, 300.0, "s", "and so much time besides", "ours"),
    TaskParam("hill_height_m", 1.0, 0.0, 5.0, "m", "bound of the hills above and valleys below the start", "ours"),
    TaskParam("trees_per_ha", 0.0, 0.0, 200.0, "1/ha", "how many trees stand there", "ours"),
    TaskParam("wall_count", 0.0, 0.0, 16.0, "1", "free-standing walls on the course, rounded down", "ours"),
    TaskParam("mover_count", 0.0, 0.0, 4.0, "1", "obstacles that run to and fro, rounded down", "ours"),
    TaskParam("episodes_per_world", 1.0, 1.0, 100.0, "1", "episodes in a world before the next is grown", "ours"),
    TaskParam("range_noise", 1.0, 0.0, 5.0, "1", "factor on the errors of the ranges", "guess"),
    TaskParam("friction_scale", 1.0, 0.4, 1.5, "1", "factor on what the tyres hold", "guess"),
    TaskParam("rolling_scale", 1.0, 0.5, 3.0, "1", "factor on the rolling resistance", "guess"),
    TaskParam("progress_reward", 2.0, 0.0, 100.0, "1/m", "for each metre of way that is left less", "tuned"),
    TaskParam("arrive_reward", 20.0, 0.0, 1000.0, "1", "for standing at the goal", "tuned"),
    TaskParam("time_cost", 0.03, 0.0, 10.0, "1", "per decision", "tuned"),
    TaskParam("idle_cost", 0.05, 0.0, 10.0, "1", "per decision of standing elsewhere", "tuned"),
    TaskParam("clearance_m", 0.15, 0.0, 1.0, "m", "room round the hull below which there is a cost", "tuned"),
    TaskParam("clearance_cost", 0.1, 0.0, 10.0, "1", "per decision for no room at all", "tuned"),
    TaskParam("jerk_cost", 0.002, 0.0, 10.0, "1", "per decision for the squared change of the action", "tuned"),
    TaskParam("hit_cost", 5.0, 0.0, 1000.0, "1", "of touching anything or tipping over, which ends it", "tuned"),
    *REPORT_PARAMS,
)
PARAMS = (*FLIGHT_PARAMS, *DRIVE_PARAMS)

_VEHICLE: dict[str, float | Sampler] = {
    "wind_m_s": Sampler(intervals=((0.0, 8.0),)),
    "wind_gust_m_s": Sampler(intervals=((0.0, 3.0),)),
    "sensor_noise": Sampler(intervals=((0.5, 1.5),)),
    "mass_scale": Sampler(intervals=((0.85, 1.25),)),
    "motor_scale": Sampler(intervals=((0.9, 1.1),)),
    "friction_scale": Sampler(intervals=((0.7, 1.1),)),
    "rolling_scale": Sampler(intervals=((0.6, 2.0),)),
}
PRESETS: dict[str, dict[str, float | Sampler]] = {
    "reach": {
        **_VEHICLE,
        "hill_height_m": Sampler(intervals=((0.5, 1.8),)),
        "trees_per_ha": Sampler(intervals=((0.0, 80.0),)),
        "wall_count": Sampler(intervals=((0.0, 16.0),)),
        "mover_count": Sampler(intervals=((0.0, 4.0),)),
    },
    "park": {
        **_VEHICLE,
        "hill_height_m": Sampler(intervals=((0.0, 1.0),)),
        "mover_count": Sampler(intervals=((0.0, 2.99),)),
        "extra_time_s": 30.0,
    },
}
