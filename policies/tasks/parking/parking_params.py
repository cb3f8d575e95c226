"""The numbers of the parking tasks: motion, sizes, tests, rewards, sensors. Any can be set or randomised by name.

`CAR_PARAMS` belong to both levels, `LEVEL1_PARAMS` and `LEVEL2_PARAMS` to one alone. Rewards have one set of names;
which of them count, and their defaults, follow from the chosen reward.
"""

import warp as wp

from policies.tasks.parking.settings import Choices
from policies.tasks.task_params import Sampler, TaskParam

wp.set_module_options({"enable_backward": False})

_PREFAB = "code: prefab"
_CODE = "code"
_DOC = "document, table 2"
_OURS = "guess: ours"


@wp.struct
class CarParams:
    """One row per environment; declared in `CAR_PARAMS`."""

    push_n: float
    turn_deg: float
    mass_kg: float
    drag_per_s: float
    car_width_m: float
    car_length_m: float
    box_ahead_m: float
    goal_yaw_deg: float
    start_range_m: float
    reach_m: float
    align_deg: float
    stop_m_s: float
    step_limit: float
    park_reward: float
    wall_hit_reward: float
    obstacle_hit_reward: float
    near_reward: float
    near_m: float
    best_reward: float
    best_start_m: float
    nearer_reward: float
    farther_reward: float
    wall_reward: float
    wall_near_m: float
    obstacle_reward: float
    obstacle_near_m: float
    progress_per_m: float
    align_m_per_rad: float
    discount: float
    time_reward: float
    ray_degrees: float
    ray_length_m: float
    ray_radius_m: float
    pad_width_m: float
    pad_length_m: float


CAR_PARAMS = (
    TaskParam("push_n", 800.0, 0.0, 5000.0, "N", "force of one push, for one physics step", _CODE),
    TaskParam("turn_deg", 3.0, 0.1, 45.0, "deg", "yaw of one applied turn, at once", _CODE),
    TaskParam("mass_kg", 8.0, 0.5, 100.0, "kg", "mass of the car", _PREFAB),
    TaskParam("drag_per_s", 8.0, 0.0, 50.0, "1/s", "linear drag", _PREFAB),
    TaskParam("car_width_m", 1.1317, 0.2, 3.0, "m", "of the trigger box: 0.780 x scale 1.4509", _PREFAB),
    TaskParam("car_length_m", 1.6584, 0.2, 4.0, "m", "of the trigger box: 1.143 x scale 1.4509", _PREFAB),
    TaskParam("box_ahead_m", 0.29, -2.0, 2.0, "m", "from the car's origin forward to its box's centre", _PREFAB),
    TaskParam("goal_yaw_deg", -39.2, -180.0, 180.0, "deg", "yaw of the pad", "code: scene"),
    TaskParam("start_range_m", 100.0, 4.0, 100.0, "m", "how far from a goal, per axis, a car starts anywhere", _OURS),
    TaskParam("reach_m", 0.3, 0.05, 5.0, "m", "greatest distance of the centres that counts as parked in pose", _OURS),
    TaskParam("align_deg", 10.0, 1.0, 180.0, "deg", "greatest angle to the pad that counts as parked in pose", _OURS),
    TaskParam("stop_m_s", 0.3, 0.01, 100.0, "m/s", "speed under which a car counts as parked in pose", _OURS),
    TaskParam("step_limit", 0.0, 0.0, 1e6, "1", "decisions until the episode is cut; 0: no limit", _CODE),
    TaskParam("park_reward", 5.0, -100.0, 100.0, "1", "row 3: parked", _DOC),
    TaskParam("wall_hit_reward", -0.5, -100.0, 100.0, "1", "row 1: a wall was hit", _DOC),
    TaskParam("obstacle_hit_reward", -0.5, -100.0, 100.0, "1", "row 2: an obstacle was hit", _DOC),
    TaskParam("near_reward", 3e-5, -10.0, 10.0, "1", "row 4: near the goal, per applied action", _DOC),
    TaskParam("near_m", 2.5, 0.0, 100.0, "m", "row 4: what is near", _DOC),
    TaskParam("best_reward", 2e-5, -10.0, 10.0, "1", "row 5: nearer than ever in this episode", _DOC),
    TaskParam(
        "best_start_m", 30.0, 0.0, 1000.0, "m", "row 5: the distance that is to be beaten first", "document and code"
    ),
    TaskParam("nearer_reward", 1e-5, -10.0, 10.0, "1", "row 6: nearer than last time, not best", _DOC),
    TaskParam("farther_reward", -2e-5, -10.0, 10.0, "1", "row 7: farther than last time", _DOC),
    TaskParam("wall_reward", -0.005, -10.0, 10.0, "1", "row 8: near a wall, once for each", _DOC),
    TaskParam("wall_near_m", 2.0, 0.0, 100.0, "m", "row 8: what is near", _DOC),
    TaskParam("obstacle_reward", -0.005, -10.0, 10.0, "1", "row 9: near an obstacle, once for each", _DOC),
    TaskParam("obstacle_near_m", 2.0, 0.0, 100.0, "m", "row 9: what is near", _DOC),
    TaskParam("progress_per_m", 0.05, 0.0, 10.0, "1/m", "progress: potential per metre of way to go", _OURS),
    TaskParam("align_m_per_rad", 1.0, 0.0, 100.0, "m/rad", "progress: way that an angle to the pad counts as", _OURS),
    TaskParam("discount", 0.99, 0.0, 1.0, "1", "progress: the learner's gamma", _OURS),
    TaskParam("time_reward", -0.002, -10.0, 10.0, "1", "progress: per decision", _OURS),
    TaskParam(
        "ray_degrees", 120.0, 0.0, 180.0, "deg", "angle of the outermost rays, to each side of forward", "document"
    ),
    TaskParam("ray_length_m", 1000.0, 1.0, 1000.0, "m", "reach of the rays", "document: example"),
    TaskParam("ray_radius_m", 0.5, 0.0, 10.0, "m", "radius of the sphere that is cast", "ML-Agents default"),
    TaskParam("pad_width_m", 2.5, 0.2, 3.0, "m", "of the spot, along its own x", _PREFAB),
    TaskParam("pad_length_m", 1.0, 0.2, 2.0, "m", "of the spot, along its own z", _PREFAB),
)


@wp.struct
class Level1Params:
    """One row per environment; declared in `LEVEL1_PARAMS`."""

    block_width_m: float
    block_length_m: float


LEVEL1_PARAMS = (
    TaskParam("block_width_m", 3.467, 0.2, 5.0, "m", "of the blocks, along their own x", "code: scene"),
    TaskParam("block_length_m", 1.0, 0.2, 2.5, "m", "of the blocks, along their own z", "code: scene"),
)


@wp.struct
class Level2Params:
    """One row per environment; declared in `LEVEL2_PARAMS`."""

    mover_speed_m_s: float
    mover_length_m: float
    mover_radius_m: float
    portal_reward: float
    wrong_portal_reward: float
    storey_2_share: float
    start_elsewhere_share: float


LEVEL2_PARAMS = (
    TaskParam("mover_speed_m_s", 2.0, 0.0, 20.0, "m/s", "speed of the moving obstacles", _CODE),
    TaskParam("mover_length_m", 3.0, 0.2, 8.0, "m", "length of the moving obstacles, caps included", _CODE),
    TaskParam("mover_radius_m", 0.75, 0.05, 3.0, "m", "half their thickness", _CODE),
    TaskParam("portal_reward", 0.1, -10.0, 10.0, "1", "row 10: through the portal towards the target", _CODE),
    TaskParam("wrong_portal_reward", -0.1, -10.0, 10.0, "1", "row 11: through a portal away from it", _DOC),
    TaskParam("storey_2_share", 1.0, 0.0, 1.0, "1", "chance that the goal is on storey 2", _CODE),
    TaskParam(
        "start_elsewhere_share", 0.5, 0.0, 1.0, "1", "chance that a car starts on the goal's other storey", _OURS
    ),
)

_PPO_COLUMN: dict[str, float | Sampler] = {
    "near_reward": 8e-5,
    "nearer_reward": -4e-5,
    "farther_reward": -8e-5,
    "obstacle_reward": 0.0,
}
_PROGRESS: dict[str, float | Sampler] = {"park_reward": 1.0, "wall_hit_reward": -1.0, "obstacle_hit_reward": -1.0}


def reward_defaults(choices: Choices, level: int) -> dict[str, float | Sampler]:
    """What the chosen reward sets differently from the declarations above."""
    if choices.reward == "progress":
        return {**_PROGRESS, **({"portal_reward": 0.0, "wrong_portal_reward": 0.0} if level == 2 else {})}
    if level == 1:
        return _PPO_COLUMN if choices.reward == "as-documented" else {}
    if choices.reward == "as-coded":
        return {"wall_near_m": 2.5, "obstacle_near_m": 2.5}
    return {"portal_reward": 0.5}
