"""FollowMe's numbers: the world, the owner, their phone, distances, and what the reward weighs, with their sources.

The numbers of the air and the vehicle come first (`FLIGHT_PARAMS`); all can be set or randomised by name.
"""

import warp as wp

from policies.tasks.flight.flight_params import FLIGHT_PARAMS
from policies.tasks.follow_me.world import STOP_FRACTION
from policies.tasks.task_params import Sampler, TaskParam

TREES_PER_HA_MAX = 300.0
_DOCUMENT = "Personal Navigation UAV"
_EVT = "EVT-Bench (TrackVLA, arXiv 2505.23189), at its size"


@wp.struct
class FollowParams:
    """One row per environment; declared in `FOLLOW_PARAMS`, in the same order."""

    hill_height_m: float
    trees_per_ha: float
    owner_speed_max: float
    owner_stop_share: float
    owner_graze_share: float
    owner_course_std_deg: float
    owner_size: float
    owner_crouch_fraction: float
    owner_hides_per_min: float
    owner_hide_s: float
    owner_clothes_fraction: float
    owner_hue: float
    bystanders: float
    bystander_likeness: float
    start_distance_min_m: float
    start_distance_max_m: float
    start_bearing_deg: float
    phone_period_s: float
    phone_lag_s: float
    phone_error: float
    phone_dropouts_per_min: float
    phone_dropout_scale: float
    camera_noise: float
    exposure: float
    light: float
    shutter_s: float
    depth_max_m: float
    depth_holes: float
    lens_scale: float
    lens_tilt_deg: float
    lens_distortion: float
    image_lag_s: float
    image_jitter_s: float
    image_loss: float
    image_freezes_per_min: float
    setpoint_lag_s: float
    guard: float
    decision_limit: float
    near_m: float
    far_m: float
    touch_m: float
    lost_m: float
    unseen_limit_s: float
    best_distance_m: float
    best_height_m: float
    distance_reward: float
    distance_width_m: float
    view_reward: float
    view_width_deg: float
    far_cost: float
    near_cost: float
    height_cost: float
    jerk_cost: float
    jerk_max: float
    turn_cost: float
    blind_cost: float
    clearance_m: float
    clearance_cost: float
    collision_cost: float
    lost_cost: float
    document_within: float
    document_beyond: float
    document_collision: float
    sensor_roughness: float


FOLLOW_PARAMS = (
    TaskParam("hill_height_m", 8.0, 0.0, 30.0, "m", "bound of the hills above and valleys below the start", "guess"),
    TaskParam("trees_per_ha", 100.0, 0.0, TREES_PER_HA_MAX, "1/ha", "trees per hectare", "guess: open woodland"),
    TaskParam("owner_speed_max", 2.0, 0.4, 6.0, "m/s", "the owner's fastest walk or run", "2: walks, 5: runs"),
    TaskParam("owner_stop_share", STOP_FRACTION, 0.0, 1.0, "1", "share of the owner's plans that are a stop", "guess"),
    TaskParam(
        "owner_graze_share", 0.3, 0.0, 1.0, "1", "share of the owner's plans that lead closely past a tree", "guess"
    ),
    TaskParam(
        "owner_course_std_deg", 51.6, 0.0, 180.0, "deg", "change of the owner's course from plan to plan", "guess"
    ),
    TaskParam("owner_size", 1.0, 0.6, 1.2, "1", "factor on the owner's stature; children: 0.7", "guess"),
    TaskParam("owner_crouch_fraction", 0.0, 0.0, 1.0, "1", "of the times they stand, that they crouch", "guess"),
    TaskParam("owner_hides_per_min", 0.0, 0.0, 20.0, "1/min", "how often nothing of the owner can be seen", "guess"),
    TaskParam("owner_hide_s", 3.0, 0.0, 1e4, "s", "for how long; from 1000 on: for good", "guess"),
    TaskParam("owner_clothes_fraction", 0.0, 0.0, 1.0, "1", "of owners who wear anything, not the usual blue", "guess"),
    TaskParam("owner_hue", -1.0, -1.0, 1.0, "1", "of the other owners' shirts, 0: red; below 0: the usual", "guess"),
    TaskParam("bystanders", 0.0, 0.0, 3.0, "1", "other people who cross the owner's way, rounded", "guess"),
    TaskParam("bystander_likeness", 0.0, 0.0, 1.0, "1", "share of them in the owner's clothes", "guess"),
    TaskParam("start_distance_min_m", 2.0, 1.0, 20.0, "m", "the owner starts at least this far away", "guess"),
    TaskParam("start_distance_max_m", 4.0, 1.0, 20.0, "m", "and at most this far", "guess"),
    TaskParam("start_bearing_deg", 30.0, 0.0, 180.0, "deg", "and at most this far to either side of the nose", "guess"),
    TaskParam("phone_period_s", 0.5, 0.1, 5.0, "s", "between FOLLOW_TARGET messages", "ground stations: 1 to 2 Hz"),
    TaskParam("phone_lag_s", 0.3, 0.0, 1.0, "s", "age of a report on its arrival", "guess"),
    TaskParam("phone_error", 1.0, 0.0, 4.0, "1", "factor on the phone's errors; 1: 1.5 m, drifting", "guess"),
    TaskParam("phone_dropouts_per_min", 1.0, 0.0, 20.0, "1/min", "how often the phone is silent for 2 to 6 s", "guess"),
    TaskParam("phone_dropout_scale", 1.0, 0.0, 1e4, "1", "factor on these times; 1e4: for good", "guess"),
    TaskParam("camera_noise", 1.0, 0.0, 4.0, "1", "factor on the noise of the picture", "guess"),
    TaskParam("exposure", 1.0, 0.25, 4.0, "1", "factor on the light of the picture", "guess"),
    TaskParam(
        "light",
        1.0,
        0.005,
        1.0,
        "1",
        "of what the longest exposure needs; the rest is gain, and noise",
        "guess",
    ),
    TaskParam("shutter_s", 0.0, 0.0, 0.05, "s", "in which what moves is smeared", "guess: up to 1/30 s at dusk"),
    TaskParam("depth_max_m", 1000.0, 0.0, 1000.0, "m", "beyond it no depth is measured; 0: nowhere", "D435: 10 m"),
    TaskParam("depth_holes", 0.0, 0.0, 1.0, "1", "fraction of the picture without depth, in patches", "guess"),
    TaskParam("lens_scale", 1.0, 0.9, 1.1, "1", "factor on the width of what the lens shows", "guess"),
    TaskParam("lens_tilt_deg", 0.0, -5.0, 5.0, "deg", "of the camera's mount, up, unknown to the policy", "guess"),
    TaskParam("lens_distortion", 0.0, -0.15, 0.15, "1", "of a lens that bends lines; above 0 a barrel", "guess"),
    TaskParam("image_lag_s", 0.0, 0.0, 0.5, "s", "from shutter to policy; in training in steps of 0.1 s", "guess"),
    TaskParam("image_jitter_s", 0.0, 0.0, 0.3, "s", "at most this much more, of each picture anew", "guess"),
    TaskParam("image_loss", 0.0, 0.0, 0.9, "1", "fraction of pictures that never come", "guess"),
    TaskParam("image_freezes_per_min", 0.0, 0.0, 20.0, "1/min", "times of 0.4 to 1.2 s without pictures", "guess"),
    TaskParam("setpoint_lag_s", 0.0, 0.0, 0.08, "s", "from policy to flight controller, in steps of 20 ms", "guess"),
    TaskParam(
        "guard",
        0.0,
        0.0,
        1.0,
        "1",
        "1: the guard's rules of people bound what a policy without images asks",
        "guess",
    ),
    TaskParam("decision_limit", 600.0, 1.0, 1e6, "1", "decisions of an episode; 600 are 60 s", "guess"),
    TaskParam("near_m", 1.0, 0.0, 20.0, "m", "to the owner's chest: nearer is too near", _EVT),
    TaskParam("far_m", 3.0, 0.0, 100.0, "m", "farther is not following", _EVT + " and " + _DOCUMENT),
    TaskParam("touch_m", 0.5, 0.0, 5.0, "m", "nearer to any part of the owner is a collision", _EVT),
    TaskParam("lost_m", 10.0, 1.0, 1e6, "m", "farther away the owner is lost, which ends the episode", "guess"),
    TaskParam("unseen_limit_s", 5.0, 0.1, 1e6, "s", "out of sight for longer the owner is lost", "the requirement"),
    TaskParam(
        "best_distance_m", 2.0, 0.5, 20.0, "m", "distance to the owner's chest that is paid best", "middle of the band"
    ),
    TaskParam("best_height_m", 0.5, -1.0, 10.0, "m", "height above the owner's chest that costs nothing", "guess"),
    TaskParam("distance_reward", 0.06, 0.0, 10.0, "1", "per decision at the best distance", "tuned"),
    TaskParam("distance_width_m", 0.6, 0.05, 10.0, "m", "off the best distance by which e^-0.5 of it is left", "tuned"),
    TaskParam("view_reward", 0.04, 0.0, 10.0, "1", "per decision for an owner in sight, ahead", "tuned"),
    TaskParam("view_width_deg", 20.0, 1.0, 180.0, "deg", "off the nose by which e^-0.5 of it is left", "tuned"),
    TaskParam("far_cost", 0.02, 0.0, 10.0, "1", "per decision and metre beyond the band, at most 5", "tuned"),
    TaskParam("near_cost", 0.2, 0.0, 10.0, "1", "per decision and metre nearer than 1.3 times the near limit", "tuned"),
    TaskParam("height_cost", 0.02, 0.0, 10.0, "1", "per decision and metre off the best height, at most 3", "tuned"),
    TaskParam("jerk_cost", 0.01, 0.0, 1000.0, "1", "per decision for the squared change of the action", "tuned"),
    TaskParam(
        "jerk_max",
        16.0,
        0.0,
        16.0,
        "1",
        "what a squared change is more counts by its root only: a stop in need",
        "tuned",
    ),
    TaskParam("turn_cost", 0.002, 0.0, 10.0, "1", "per decision for the squared yaw rate asked for", "tuned"),
    TaskParam(
        "blind_cost",
        0.015,
        0.0,
        10.0,
        "1",
        "per decision and (m/s)² asked for to where the camera does not look",
        "tuned",
    ),
    TaskParam("clearance_m", 1.5, 0.0, 2.0, "m", "room to obstacles and others below which there is a cost", "tuned"),
    TaskParam("clearance_cost", 0.2, 0.0, 10.0, "1", "per decision for no room at all, growing as the square", "tuned"),
    TaskParam("collision_cost", 8.0, 0.0, 1000.0, "1", "of a collision, which ends the episode", "tuned"),
    TaskParam("lost_cost", 3.0, 0.0, 1000.0, "1", "of losing the owner, which ends the episode", "tuned"),
    TaskParam(
        "document_within", 0.1, -10.0, 10.0, "1", "document: per payment within `far_m` of the person", _DOCUMENT
    ),
    TaskParam("document_beyond", -0.05, -10.0, 10.0, "1", "document: per payment otherwise", _DOCUMENT),
    TaskParam("document_collision", -10.0, -1e3, 10.0, "1", "document: of any collision", _DOCUMENT),
    TaskParam(
        "sensor_roughness",
        0.0,
        0.0,
        1.0,
        "1",
        "vibration and magnetic noise; 1: as in the roughest of five logs",
        "PX4's logs",
    ),
)
PARAMS = (*FLIGHT_PARAMS, *FOLLOW_PARAMS)

# Not described in the document: no wind, ideal positions of both, and nothing but a collision or the limit ends it.
DOCUMENTED: dict[str, float | Sampler] = {
    "sensor_noise": 0.0,
    "phone_period_s": 0.1,
    "phone_lag_s": 0.0,
    "phone_error": 0.0,
    "phone_dropouts_per_min": 0.0,
    "camera_noise": 0.0,
    "lost_m": 1e6,
    "unseen_limit_s": 1e6,
}
# What a day outside may bring.
IMPROVED: dict[str, float | Sampler] = {
    "wind_m_s": Sampler(intervals=((0.0, 6.0),)),
    "wind_gust_m_s": Sampler(intervals=((0.0, 3.0),)),
    "sensor_noise": Sampler(intervals=((0.5, 1.5),)),
    "mass_scale": Sampler(intervals=((0.9, 1.15),)),
    "motor_scale": Sampler(intervals=((0.93, 1.07),)),
    "hill_height_m": Sampler(intervals=((2.0, 12.0),)),
    "exposure": Sampler(intervals=((0.7, 1.4),)),
    "trees_per_ha": Sampler(intervals=((30.0, 200.0),)),
}
# The same, and what `follow-me-tracked` may meet; its velocities shall be smooth, and going back is no sin.
SEEN_BY_TRACKER: dict[str, float | Sampler] = {
    "wind_m_s": Sampler(intervals=((0.0, 10.0),)),
    "sensor_roughness": Sampler(intervals=((0.0, 1.0),)),
    "lens_scale": Sampler(mean=1.0, st_dev=0.02),
    "lens_tilt_deg": Sampler(mean=0.0, st_dev=1.5),
    "lens_distortion": Sampler(mean=0.0, st_dev=0.03),
    "owner_size": Sampler(intervals=((0.65, 1.15),)),
    "owner_crouch_fraction": Sampler(mean=0.0, st_dev=0.3),
    "owner_stop_share": Sampler(intervals=((0.1, 0.35),)),
    "owner_course_std_deg": Sampler(intervals=((40.0, 70.0), (40.0, 70.0), (60.0, 120.0))),
    "owner_hides_per_min": Sampler(mean=0.2, st_dev=1.5),
    "owner_hide_s": Sampler(intervals=((0.3, 1.9),)),
    "bystanders": Sampler(mean=0.5, st_dev=1.5),  # one to three of them in half of the episodes
    "start_distance_min_m": 1.5,
    "start_distance_max_m": Sampler(intervals=((3.0, 5.0), (3.0, 8.0))),
    "image_lag_s": Sampler(intervals=((0.0, 0.1), (0.0, 0.35))),
    "image_jitter_s": Sampler(mean=0.0, st_dev=0.05),
    "image_loss": Sampler(mean=0.0, st_dev=0.05),
    "image_freezes_per_min": Sampler(mean=0.0, st_dev=1.0),
    "setpoint_lag_s": Sampler(intervals=((0.0, 0.06),)),
    "camera_noise": Sampler(intervals=((0.7, 1.5),)),
    "light": Sampler(mean=1.0, st_dev=0.35),
    "shutter_s": Sampler(mean=0.0, st_dev=0.012),
    "depth_max_m": Sampler(intervals=((0.0, 1.0), (0.0, 1.0), (3.0, 13.0))),
    "depth_holes": Sampler(mean=0.0, st_dev=0.12),
    "guard": 1.0,
    "unseen_limit_s": 3.0,
    "view_width_deg": 30.0,
    "jerk_cost": 15.0,
    "jerk_max": 0.004,
    "turn_cost": 0.05,
    "blind_cost": 0.003,
    "near_cost": 0.3,
}
