"""Topics of what the control law commands."""

from collections.abc import Sequence
from math import nan

import numpy as np

from autopilot.interface.outputs import Output, OutputKind
from mission.log.euler_angles import wxyz
from mission.log.topic import SAMPLED, Batch, Columns, Rows, Topic, axes

MOTORS, SERVOS = 12, 8  # in PX4's topics


def _motors(batch: Batch) -> Columns:
    command = batch.actuators["command"]
    if not _servos(batch.outputs):  # nothing but motors, as many as there is room for
        return _controls(batch, command, MOTORS)
    return _controls(
        batch, command[:, [i for i in range(len(batch.outputs)) if i not in _servos(batch.outputs)]], MOTORS
    )


def _servo_commands(batch: Batch) -> Columns:
    return _controls(batch, batch.actuators["command"][:, _servos(batch.outputs)], SERVOS)


def _servos(outputs: Sequence[Output]) -> list[int]:
    return [i for i, output in enumerate(outputs) if output.kind is OutputKind.SERVO]


def _controls(batch: Batch, command: Rows, room: int) -> Columns:
    """PX4's fields: NaN where there is no output."""
    control = np.full((len(command), room), nan, dtype=np.float32)
    control[:, : command.shape[1]] = command
    return {"timestamp": batch.time_us, "timestamp_sample": batch.time_us, "control": control}


def _attitude_setpoint(batch: Batch) -> Columns:
    actuators = batch.actuators
    thrust = np.zeros((len(actuators), 3), dtype=np.float32)
    thrust[:, 2] = -actuators["thrust_sp"]
    return {
        "timestamp": batch.time_us,
        "yaw_sp_move_rate": actuators["traj_yaw_rate"],
        "q_d": wxyz(actuators["q_sp_ned_from_frd"]),
        "thrust_body": thrust,
    }


def _rates_setpoint(batch: Batch) -> Columns:
    return {"timestamp": batch.time_us, **axes("roll pitch yaw", batch.actuators["omega_sp_frd"])}


def _local_setpoint(batch: Batch) -> Columns:
    actuators = batch.actuators
    return {
        "timestamp": batch.time_us,
        **axes("x y z", actuators["traj_pos_ned"]),
        **axes("vx vy vz", actuators["traj_vel_ned"]),
        "acceleration": actuators["traj_accel_ned"],
        "yaw": actuators["traj_yaw"],
        "yawspeed": actuators["traj_yaw_rate"],
    }


def servo_topic(outputs: Sequence[Output]) -> Topic | None:
    """PX4's topic of servos, of vehicles that have some."""
    if not _servos(outputs):
        return None
    return Topic("actuator_servos", {**SAMPLED, "control": f"float[{SERVOS}]"}, _servo_commands)


CONTROL_TOPICS = (
    Topic("actuator_motors", {**SAMPLED, "control": "float[12]"}, _motors),
    Topic(
        "vehicle_attitude_setpoint",
        {"yaw_sp_move_rate": "float", "q_d": "float[4]", "thrust_body": "float[3]"},
        _attitude_setpoint,
    ),
    Topic("vehicle_rates_setpoint", dict.fromkeys("roll pitch yaw".split(), "float"), _rates_setpoint),
    Topic(
        "vehicle_local_position_setpoint",
        {
            **dict.fromkeys("x y z yaw yawspeed vx vy vz".split(), "float"),
            "acceleration": "float[3]",
        },
        _local_setpoint,
    ),
)
