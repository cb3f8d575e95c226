"""What the motors and servos were commanded, and whether the allocation could do what was asked."""

import numpy as np

from mission.review.curves import Panel, Rows, Section, curves
from mission.review.logged_flight import LoggedFlight, Topic

CONTROLS = ("roll", "pitch", "yaw", "thrust")
PWM_LEAST_US, PWM_MOST_US = 800.0, 2200.0  # what is outside is no pulse length


def motor_commands(flight: LoggedFlight) -> tuple[Rows, Rows, str] | None:
    """Times, commands from 0 to 1 (rows, motors), and the topic they are from; None where there is none.

    PX4 logs them as actuator_motors since 1.13; before as pulse lengths of the outputs.
    """
    topic = flight.topic("actuator_motors")
    if topic is not None and (count := topic.length("control")):
        columns = _used(topic.vector("control", count))
        if columns is not None:
            return topic.time_s, columns, topic.name
    topic = flight.topic("actuator_outputs")
    if topic is None or not (count := topic.length("output")):
        return None
    outputs = _outputs(topic, count)
    if outputs is None:
        return None
    least, most = (flight.parameters.get(name, usual) for name, usual in (("PWM_MIN", 1000.0), ("PWM_MAX", 2000.0)))
    least = min(least, float(np.nanmin(outputs)))
    most = max(most, float(np.nanmax(outputs)))
    return topic.time_s, (outputs - least) / max(most - least, 1.0), topic.name


def actuators(flight: LoggedFlight) -> Section:
    panels, missing = [], []
    motors = motor_commands(flight)
    if motors is None:
        missing.append("no motor commands (topic actuator_motors or actuator_outputs)")
    else:
        names = [f"motor {k + 1}" for k in range(motors[1].shape[1])]
        lines = curves(motors[0], motors[1], names)
        panels.append(Panel("motors", "Motor commands", "of full", tuple(lines), ((1.0, "full"),), 1.05, True))
    panels += _servos(flight) + _controls(flight) + _allocation(flight) + _rotation(flight)
    return Section("actuators", "Actuators", tuple(panels), tuple(missing))


def _used(columns: Rows | None) -> Rows | None:
    """The outputs that there are: NaN in all rows means none."""
    if columns is None:
        return None
    is_used = np.isfinite(columns).any(axis=0)
    return columns[:, is_used] if is_used.any() else None


def _outputs(topic: Topic, count: int) -> Rows | None:
    """Pulse lengths of the outputs that ever changed [us]."""
    columns = topic.vector("output", count)
    if columns is None:
        return None
    with np.errstate(invalid="ignore"):
        is_pulse = (columns >= PWM_LEAST_US) & (columns <= PWM_MOST_US)
    is_used = is_pulse.any(axis=0) & (np.nanstd(columns, axis=0) > 0.0)
    return np.where(is_pulse, columns, np.nan)[:, is_used] if is_used.any() else None


def _servos(flight: LoggedFlight) -> list[Panel]:
    topic = flight.topic("actuator_servos")
    columns = None if topic is None else _used(topic.vector("control", topic.length("control")))
    if topic is None or columns is None:
        return []
    lines = curves(topic.time_s, columns, [f"servo {k + 1}" for k in range(columns.shape[1])])
    return [Panel("servos", "Servo commands", "of full", tuple(lines), least_span=2.0)]


def _controls(flight: LoggedFlight) -> list[Panel]:
    """Torque and thrust asked for; actuator_controls_0 until PX4 1.12."""
    torque, thrust = flight.topic("vehicle_torque_setpoint"), flight.topic("vehicle_thrust_setpoint")
    if torque is not None and (columns := torque.vector("xyz", 3)) is not None:
        lines = curves(torque.time_s, columns, CONTROLS[:3])
        if thrust is not None and (up := thrust.get("xyz[2]")) is not None:
            lines += curves(thrust.time_s, -up, CONTROLS[3:])
        return [Panel("controls", "Torque and thrust asked for", "of full", tuple(lines), least_span=0.2)]
    topic = flight.topic("actuator_controls_0")
    columns = None if topic is None else topic.vector("control", 4)
    if topic is None or columns is None:
        return []
    lines = curves(topic.time_s, columns, CONTROLS)
    return [Panel("controls", "Torque and thrust asked for", "of full", tuple(lines), least_span=0.2)]


def _allocation(flight: LoggedFlight) -> list[Panel]:
    topic = flight.topic("control_allocator_status")
    columns = None if topic is None else topic.vector("unallocated_torque", 3)
    if topic is None or columns is None:
        return []
    lines = curves(topic.time_s, columns, CONTROLS[:3])
    return [Panel("unallocated", "Torque that could not be allocated", "of full", tuple(lines), least_span=0.1)]


def _rotation(flight: LoggedFlight) -> list[Panel]:
    topic = flight.topic("esc_status")
    if topic is None:
        return []
    names = [f"esc[{k}].esc_rpm" for k in range(8)]
    shown = [name for name in names if name in topic and np.any(topic[name] != 0)]
    if not shown:
        return []
    columns = np.stack([topic[name] for name in shown], axis=1)
    lines = curves(topic.time_s, columns, [f"motor {names.index(name) + 1}" for name in shown])
    return [Panel("rpm", "Motor speeds", "rpm", tuple(lines), starts_at_zero=True)]
