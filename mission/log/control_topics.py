"""Topics of what the control law commands."""

from math import nan

import numpy as np

from mission.log.euler_angles import wxyz
from mission.log.topic import SAMPLED, Batch, Columns, Topic, axes


def _motors(batch: Batch) -> Columns:
    command = batch.actuators["command"]
    control = np.full((len(command), 12), nan, dtype=np.float32)
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
