"""What the policy sees and says in flight, by the very kernel functions it was trained with.

In: telemetry of the vehicle and the last report of the owner's phone, as they came over MAVLink. Out: one observation
vector, and the setpoint that an action asks for. One row, one launch each; 10 Hz.
"""

from math import isfinite
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import Vector, inverse, quat_of, rotated, yaw_of
from common.warp_start import start_warp
from policies.companion.names import TASK
from policies.companion.telemetry import Own, Owner
from policies.tasks.flight.own_state import (
    ACTIONS,
    CLIMB_MAX_M_S,
    SPEED_MAX_M_S,
    YAW_RATE_MAX_RAD_S,
    Command,
    OwnState,
    command_rows,
)
from policies.tasks.follow_me.observe import (
    IMAGE_CHANNELS,
    IMAGE_SIZE,
    LAYOUT_VERSION,
    REPORT_LAG_S,
    REPORT_OLD_S,
    OwnerReport,
    observe_rows,
    vector_elements,
)
from policies.tasks.layout import ImageElement, Layout

Floats = NDArray[np.float32]


def image_layout(kind: int) -> Layout:
    """What a policy that looks at images sees and says.

    Args:
        kind: which vector: EGO or EGO_BLIND of the task's observe.py.
    """
    image = ImageElement(IMAGE_SIZE, IMAGE_SIZE, IMAGE_CHANNELS)
    return Layout(TASK, LAYOUT_VERSION, vector_elements(kind), ACTIONS, image=image)


class CommandKernel:
    """What actions ask for, by the kernel function of training."""

    def __init__(self) -> None:
        start_warp()
        own, action, command = wp.zeros(1, dtype=OwnState), wp.zeros(1, dtype=wp.vec4), wp.zeros(1, dtype=Command)
        self._own: NDArray[Any] = own.numpy()  # live views, as of the others
        self._action: Floats = action.numpy()
        self._command: NDArray[Any] = command.numpy()
        self._ask = wp.launch(command_rows, 1, [action, own, command], record_cmd=True)

    def setpoint(self, action: Floats, own: Own) -> tuple[Vector, float]:
        """Velocity in ned [m/s] and yaw rate [rad/s] of an action in [-1, 1], shape (4,)."""
        self._own["q_ned_from_frd"][0] = own.q_ned_from_frd
        self._action[0] = action
        self._ask.launch()
        row = self._command[0]
        north, east, down = (float(element) for element in row["vel_ned"])
        return (north, east, down), float(row["yaw_rate"])

    @staticmethod
    def action_of(velocity: Vector, yaw_rate: float, own: Own, action: Floats) -> Floats:
        """The other way round, of a setpoint; of an action that asked for something else, where no yaw rate is sent."""
        ahead, right, down = rotated(inverse(quat_of(yaw_of(own.q_ned_from_frd), 0.0)), velocity)
        turns = yaw_rate / float(YAW_RATE_MAX_RAD_S) if isfinite(yaw_rate) else float(action[3])
        most = (float(SPEED_MAX_M_S), float(SPEED_MAX_M_S), float(CLIMB_MAX_M_S))
        return np.array([ahead / most[0], right / most[1], down / most[2], turns], np.float32)


def write_own_row(row: Any, own: Own) -> None:
    """Telemetry as a row of `OwnState`.

    Args:
        row: to be written.
        own: telemetry.
    """
    row["pos_ned"] = own.pos_ned
    row["vel_ned"] = own.vel_ned
    row["q_ned_from_frd"] = own.q_ned_from_frd
    row["yaw_rate"] = rotated(own.q_ned_from_frd, own.omega_frd)[2]
    height_m = own.carried_height_m
    is_valid = isfinite(height_m)
    row["height_m"] = height_m if is_valid else 0.0
    row["is_height_valid"] = int(is_valid)


class Observer:
    """One vehicle's observations and commands.

    Args:
        kind: which vector: EGO or EGO_BLIND of the task's observe.py.
    """

    def __init__(self, kind: int) -> None:
        start_warp()
        own, report = wp.zeros(1, dtype=OwnState), wp.zeros(1, dtype=OwnerReport)
        action, age = wp.zeros(1, dtype=wp.vec4), wp.zeros(1, dtype=float)
        out = wp.zeros((1, len(vector_elements(kind))), dtype=float)
        self._own: NDArray[Any] = own.numpy()  # live views, as of the others
        self._report: NDArray[Any] = report.numpy()
        self._action: Floats = action.numpy()
        self._age_s: Floats = age.numpy()
        self._out: Floats = out.numpy()
        self._observe = wp.launch(observe_rows, 1, [kind, own, report, action, age, out], record_cmd=True)
        self._command = CommandKernel()

    def vector(self, own: Own, owner: Owner, last_action: Floats, time_us: int, image_age_s: float = 0.0) -> Floats:
        """The observation as of now.

        Args:
            own: telemetry.
            owner: the phone's last report.
            last_action: in [-1, 1], shape (4,).
            time_us: the companion's own clock.
            image_age_s: since the newest picture was taken.
        """
        self._age_s[0] = image_age_s
        write_own_row(self._own[0], own)
        self._write_report(owner, time_us)
        self._action[0] = last_action
        self._observe.launch()
        vector: Floats = self._out[0]
        return vector

    def setpoint(self, action: Floats, own: Own) -> tuple[Vector, float]:
        """Velocity in ned [m/s] and yaw rate [rad/s] of an action in [-1, 1], shape (4,)."""
        return self._command.setpoint(action, own)

    def action_of(self, velocity: Vector, yaw_rate: float, own: Own, action: Floats) -> Floats:
        """The other way round."""
        return self._command.action_of(velocity, yaw_rate, own, action)

    def _write_report(self, owner: Owner, time_us: int) -> None:
        row = self._report[0]
        age_s = (time_us - owner.arrived_us) * 1e-6 + REPORT_LAG_S
        is_known = owner.count > 0 and age_s < REPORT_OLD_S
        row["pos_ned"] = owner.pos_ned if is_known else (0.0, 0.0, 0.0)
        row["vel_ned"] = owner.vel_ned if is_known else (0.0, 0.0, 0.0)
        row["age_s"] = age_s if is_known else 0.0
        row["is_known"] = int(is_known)
