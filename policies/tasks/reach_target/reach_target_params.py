"""ReachTarget's numbers: the car, the platform and the task, each with its source, each to be set or randomised.

Sources: the published prefab and scripts of "Learning to Drive" (AuroAi/learning-to-drive), Unity's documented defaults
where the prefab is silent, and the word guess.
"""

import warp as wp

from policies.tasks.task_params import TaskParam

_PREFAB = "Agent.prefab of learning-to-drive"
_SCENE = "ReachTargetPlatform.prefab of learning-to-drive"
_SCRIPT = "ReachTargetAgent.cs of learning-to-drive"
_UNITY = "Unity's default, unchecked"


@wp.struct
class ReachParams:
    """One row per environment; declared in `PARAMS`, in the same order."""

    mass_kg: float
    chassis_width_m: float
    chassis_height_m: float
    chassis_length_m: float
    track_m: float
    wheelbase_m: float
    axle_height_m: float
    wheel_radius_m: float
    wheel_mass_kg: float
    wheel_damping_nms: float
    suspension_travel_m: float
    spring_n_m: float
    damper_ns_m: float
    bump_stop_n_m: float
    forward_extremum_slip: float
    forward_extremum: float
    forward_asymptote_slip: float
    forward_asymptote: float
    forward_stiffness: float
    side_extremum_slip: float
    side_extremum: float
    side_asymptote_slip: float
    side_asymptote: float
    side_stiffness: float
    slip_speed_m_s: float
    steer_max_deg: float
    motor_torque_nm: float
    brake_torque_nm: float
    angular_drag_hz: float
    gravity_m_s2: float
    contact_n_m: float
    contact_ns_m: float
    contact_friction: float
    half_platform_m: float
    half_spawn_m: float
    start_height_m: float
    target_height_m: float
    step_limit: float
    reach_m: float
    shaping_scale: float
    potential_scale: float
    shaping_gamma: float
    goal_position_m: float
    goal_heading_deg: float
    goal_speed_m_s: float


CAR_PARAMS = (
    TaskParam("mass_kg", 1302.0, 200.0, 5000.0, "kg", "mass of the car", _PREFAB),
    TaskParam("chassis_width_m", 1.9, 0.5, 4.0, "m", "chassis along x; inertia is that of an even box", _PREFAB),
    TaskParam("chassis_height_m", 1.0, 0.2, 3.0, "m", "chassis along y", _PREFAB),
    TaskParam("chassis_length_m", 4.5, 1.0, 10.0, "m", "chassis along z", _PREFAB),
    TaskParam("track_m", 2.5, 0.5, 5.0, "m", "from left to right wheels", _PREFAB),
    TaskParam("wheelbase_m", 3.0, 0.5, 8.0, "m", "from rear to front wheels", _PREFAB),
    TaskParam(
        "axle_height_m", -0.35, -2.0, 2.0, "m", "y of the hubs, suspension compressed, in the car's frame", _PREFAB
    ),
    TaskParam("wheel_radius_m", 0.5, 0.1, 2.0, "m", "radius of the wheels", _PREFAB),
    TaskParam("wheel_mass_kg", 20.0, 1.0, 200.0, "kg", "mass of a wheel; it turns as a disc", _UNITY),
    TaskParam("wheel_damping_nms", 0.25, 0.0, 100.0, "N m s", "torque against a wheel's turning", _UNITY),
    TaskParam("suspension_travel_m", 0.1, 0.01, 1.0, "m", "from full extension to full compression", _PREFAB),
    TaskParam(
        "spring_n_m",
        35000.0,
        1000.0,
        2e5,
        "N/m",
        "suspension spring, relaxed at full extension: the script leaves the target position at 0",
        _PREFAB,
    ),
    TaskParam("damper_ns_m", 4500.0, 0.0, 6000.0, "N s/m", "suspension damper", _PREFAB),
    TaskParam("bump_stop_n_m", 350000.0, 0.0, 5e5, "N/m", "spring past full compression; PhysX: a hard stop", "guess"),
    TaskParam("forward_extremum_slip", 0.4, 0.05, 5.0, "1", "slip of the forward curve's peak", _PREFAB),
    TaskParam("forward_extremum", 1.0, 0.05, 5.0, "1", "peak of the forward curve, force over load", _PREFAB),
    TaskParam("forward_asymptote_slip", 0.8, 0.05, 10.0, "1", "slip at which the forward curve is flat", _PREFAB),
    TaskParam("forward_asymptote", 0.5, 0.05, 5.0, "1", "forward curve from there on", _PREFAB),
    TaskParam("forward_stiffness", 2.0, 0.05, 5.0, "1", "factor of the forward curve", _PREFAB),
    TaskParam("side_extremum_slip", 0.2, 0.05, 5.0, "1", "slip of the sideways curve's peak", _PREFAB),
    TaskParam("side_extremum", 1.0, 0.05, 5.0, "1", "peak of the sideways curve, force over load", _PREFAB),
    TaskParam("side_asymptote_slip", 0.5, 0.05, 10.0, "1", "slip at which the sideways curve is flat", _PREFAB),
    TaskParam("side_asymptote", 0.8, 0.05, 5.0, "1", "sideways curve from there on", _PREFAB),
    TaskParam("side_stiffness", 1.0, 0.05, 5.0, "1", "factor of the sideways curve", _PREFAB),
    TaskParam(
        "slip_speed_m_s",
        3.0,
        1.5,
        10.0,
        "m/s",
        "speed under which slip is measured against this speed: keeps the side force stable at standstill",
        "guess",
    ),
    TaskParam("steer_max_deg", 25.0, 1.0, 60.0, "deg", "front wheels at full steering, both alike", _PREFAB),
    TaskParam("motor_torque_nm", 1500.0, 0.0, 10000.0, "N m", "on each wheel at full throttle", _PREFAB),
    TaskParam("brake_torque_nm", 2000.0, 0.0, 20000.0, "N m", "on each wheel at full brake", _PREFAB),
    TaskParam("angular_drag_hz", 0.05, 0.0, 5.0, "1/s", "decay of the chassis's turning", _PREFAB),
    TaskParam("gravity_m_s2", 9.81, 1.0, 30.0, "m/s²", "gravity", _UNITY),
    TaskParam("contact_n_m", 200000.0, 1000.0, 5e5, "N/m", "ground under each corner of the chassis", "guess"),
    TaskParam("contact_ns_m", 5000.0, 0.0, 10000.0, "N s/m", "damping of that contact", "guess"),
    TaskParam("contact_friction", 0.6, 0.0, 2.0, "1", "friction of that contact", _UNITY),
)

TASK_PARAMS = (
    TaskParam("half_platform_m", 50.0, 5.0, 1e6, "m", "half the length of the platform's sides", _SCENE),
    TaskParam("half_spawn_m", 47.0, 0.0, 1e5, "m", "how far from the middle targets may appear, per axis", _SCRIPT),
    TaskParam("start_height_m", 1.0, 0.0, 10.0, "m", "height of the car's centre at the start", _SCRIPT),
    TaskParam("target_height_m", 0.5, 0.0, 10.0, "m", "height of the target's centre", _SCRIPT),
    TaskParam("step_limit", 200.0, 1.0, 1e6, "1", "decisions until the episode is cut: 2,000 physics steps", _SCRIPT),
    TaskParam("reach_m", 1.0, 0.05, 20.0, "m", "distance of the centres under which the target is reached", _SCRIPT),
    TaskParam("shaping_scale", 5e-4, 0.0, 1.0, "s/m", "reward per speed towards the target: 1 / 2,000", _SCRIPT),
    TaskParam("potential_scale", 1.0, 0.0, 100.0, "1", "of the potential, which is -1 at 50 m", "guess"),
    TaskParam(
        "shaping_gamma", 0.99, 0.0, 1.0, "1", "discount inside the potential-based shaping: the learner's", "guess"
    ),
    TaskParam("goal_position_m", 0.3, 0.01, 5.0, "m", "position error allowed at the goal pose", "guess"),
    TaskParam("goal_heading_deg", 10.0, 1.0, 180.0, "deg", "heading error allowed at the goal pose", "guess"),
    TaskParam("goal_speed_m_s", 0.3, 0.01, 50.0, "m/s", "speed allowed at the goal pose", "guess"),
)

PARAMS = (*CAR_PARAMS, *TASK_PARAMS)
