"""The estimator's health: test ratios, innovations, uncertainty, what the state of the log's estimator said."""

import numpy as np

from mission.review.curves import Curve, Panel, Section, curves
from mission.review.innovations import Innovation, innovations, ratios
from mission.review.logged_flight import LoggedFlight

AXES = ("north", "east", "down")
RATIO_SHOWN_MAX = 3.0  # before a sensor is fused its ratio may be anything
BODY = ("x", "y", "z")


def estimator(flight: LoggedFlight) -> Section:
    found, missing = ratios(flight), []
    panels = []
    if found:
        lines = [line for each in found for line in curves(each.time_s, each.ratio, [each.name])]
        panels.append(
            Panel(
                "ratios",
                "Test ratios",
                "",
                tuple(lines),
                ((1.0, "rejected"),),
                1.2,
                True,
                is_of_flight=True,
                ceiling=RATIO_SHOWN_MAX,
            )
        )
    else:
        missing.append(
            "no test ratios (topics estimator_aid_src_*, estimator_innovation_test_ratios, estimator_status)"
        )
    measured = innovations(flight)
    panels += [_innovation(each) for each in measured]
    if not measured:
        missing.append("no innovations (topic estimator_innovations or ekf2_innovations)")
    accuracy = _uncertainty(flight)
    if accuracy is None:
        missing.append("no uncertainty (vehicle_local_position.eph)")
    else:
        panels.append(accuracy)
    panels += _biases(flight)
    remark = f"Test ratios from {found[0].source}." if found else ""
    return Section("estimator", "Estimator", tuple(panels), tuple(missing), remark)


def _innovation(each: Innovation) -> Panel:
    names = BODY if each.key == "mag" else AXES
    count = each.innov.shape[1]
    lines = curves(each.time_s, each.innov, ["innovation"] if count == 1 else names[:count])
    if each.std is not None:
        worst = np.nanmax(np.where(np.isfinite(each.std), each.std, -np.inf), axis=1)
        worst[~np.isfinite(worst)] = np.nan
        for sign, name in ((1.0, "1 sigma"), (-1.0, "")):
            lines += curves(each.time_s, sign * worst, [name], is_setpoint=True)
    return Panel(f"innov_{each.key}", f"Innovation: {each.name}", each.unit, tuple(lines), is_of_flight=True)


def _uncertainty(flight: LoggedFlight) -> Panel | None:
    topic = flight.topic("vehicle_local_position")
    columns = None if topic is None else topic.columns("eph", "epv")
    if topic is None or columns is None:
        return None
    lines = curves(topic.time_s, columns, ("horizontal", "vertical"))
    return Panel("accuracy", "Position uncertainty (1 sigma)", "m", tuple(lines), starts_at_zero=True, least_span=0.5)


def _biases(flight: LoggedFlight) -> list[Panel]:
    topic = flight.topic("estimator_sensor_bias")
    if topic is None:
        return []
    panels = []
    for field, title, unit, scale in (
        ("gyro_bias", "Gyro bias", "deg/s", np.degrees(1.0)),
        ("accel_bias", "Accelerometer bias", "m/s²", 1.0),
    ):
        columns = topic.vector(field, 3)
        if columns is not None:
            lines: list[Curve] = curves(topic.time_s, scale * columns, BODY)
            panels.append(Panel(field, title, unit, tuple(lines)))
    return panels
