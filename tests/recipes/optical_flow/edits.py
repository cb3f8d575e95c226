"""Lines that the sensor adds to files that are there: path, the line after which they stand, and the lines."""

ADDED = (
    ("autopilot/ports.py", "    range: RangeSample", "    flow: FlowSample"),
    (
        "autopilot/ports.py",
        "    is_valid: int  # 0: out of range or no return",
        """

@wp.struct
class FlowSample:
    time_us: wp.int64
    vel_frd: wp.vec2  # [m/s] over ground along body x and y""",
    ),
    ("autopilot/estimator/state.py", "RANGE_RING = wp.constant(16)", "FLOW_RING = wp.constant(16)"),
    ("autopilot/estimator/state.py", "    range_inbox: Inbox", "    flow_inbox: Inbox"),
    ("autopilot/estimator/state.py", "    range: Aid  # along body down [m]", "    flow: Aid  # body x, y [m/s]"),
    (
        "autopilot/estimator/state.py",
        "    range_ring: wp.array2d(dtype=RangeSample)",
        "    flow_ring: wp.array2d(dtype=FlowSample)",
    ),
    ("autopilot/estimator/state.py", "import warp as wp", "\nfrom autopilot.ports import FlowSample"),
    ("autopilot/estimator/params.py", "    range_gate: float", "    flow_noise: float\n    flow_gate: float"),
    (
        "autopilot/estimator/params.py",
        '    Parameter("EKF2_RNG_GATE", 5.0, 1.0, 50.0, "SD", "range finder gate", _PX4, "range_gate"),',
        """    Parameter("EKF2_OF_N_MIN", 0.15, 0.05, 5.0, "m/s", "optical flow noise", _PX4, "flow_noise"),
    Parameter("EKF2_OF_GATE", 3.0, 1.0, 50.0, "SD", "optical flow gate", _PX4, "flow_gate"),""",
    ),
    (
        "autopilot/estimator/sensors.py",
        "import warp as wp",
        "\nfrom autopilot.estimator.sources.flow import FLOW, flow_time, receive_flow, take_flow",
    ),
    (
        "autopilot/estimator/sensors.py",
        "FUSED_SENSORS: tuple[SensorSpec, ...] = (GNSS, BARO, MAG, RANGE, WHEELS)",
        "FUSED_SENSORS = (*FUSED_SENSORS, FLOW)",
    ),
    (
        "autopilot/estimator/sensors.py",
        "    samples.range.time_us = range_time(ekf.rows[i].range_inbox, samples.range)",
        "    samples.flow.time_us = flow_time(ekf.rows[i].flow_inbox, samples.flow)",
    ),
    (
        "autopilot/estimator/sensors.py",
        "    receive_range(ekf, i, samples.range, is_still, vel_ned)",
        "    receive_flow(ekf, i, samples.flow, is_still, vel_ned)",
    ),
    (
        "autopilot/estimator/sensors.py",
        "        take_range(ekf, i, params, now_us)",
        "    if is_waiting(ekf.rows[i].flow_inbox):\n        take_flow(ekf, i, params, now_us)",
    ),
    (
        "autopilot/estimator/sensors.py",
        "    ekf.rows[i].range = listen(ekf.rows[i].range, ekf.rows[i].range_inbox, now_us)",
        "    ekf.rows[i].flow = listen(ekf.rows[i].flow, ekf.rows[i].flow_inbox, now_us)",
    ),
    (
        "autopilot/estimator/sensors.py",
        "    ekf.rows[i].range_inbox.tail = ekf.rows[i].range_inbox.head",
        "    ekf.rows[i].flow_inbox.tail = ekf.rows[i].flow_inbox.head",
    ),
    (
        "sim/sensors/sensors.py",
        "import warp as wp",
        "\nfrom sim.sensors.flow import FlowModel, flow_model, sense_flow",
    ),
    ("sim/sensors/sensors.py", "    range: RangeModel", "    flow: FlowModel"),
    ("sim/sensors/sensors.py", "    range: SensorFault", "    flow: SensorFault"),
    (
        "sim/sensors/sensors.py",
        "    model.range = range_model(noise_scale)",
        "    model.flow = flow_model(noise_scale)",
    ),
    (
        "sim/sensors/sensors.py",
        "    out.samples.range = "
        "sense_range(model.range, out.samples.range, faults.range, truth, world, seed, i, tick)",
        "    out.samples.flow = sense_flow(model.flow, out.samples.flow, faults.flow, truth, seed, i, tick)",
    ),
    ("sim/rng_streams.py", "RANGE_WHITE = wp.constant(42)", "FLOW_WHITE = wp.constant(44)"),
)

NEW = {"autopilot/estimator/sources/flow.py": "sources_flow.py", "sim/sensors/flow.py": "sensors_flow.py"}
"""Files that the sensor brings along, and where they lie here."""
