"""A class of vehicles: its control law, and what the Python part of the flight controller must know of it.

Adding a class is adding a folder beside `multirotor` whose `vehicle.py` has one of these.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from autopilot.control.law import ControlLaw
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_state import Mode
from common.airframe import Airframe
from common.params import Parameter, ParameterTable


class GroundDetector(Protocol):
    """Says whether the vehicle stands on the ground."""

    has_contact: bool
    """The ground carries it, perhaps not for long."""
    has_struck: bool
    """It has struck something while nothing held it in the air."""
    is_landed: bool

    @property
    def is_down(self) -> bool:
        """It lies still, its motors off, whatever the estimate says."""

    def reset(self) -> None:
        """The vehicle is on the ground and about to leave it."""

    def update(self, estimate: Any, thrust: float, descent_sp: float, dt_s: float) -> bool:
        """Takes one frame and returns whether the vehicle stands on the ground.

        Args:
            estimate: the Estimate record.
            thrust: [0..1] collective thrust setpoint.
            descent_sp: [m/s] downward speed asked for, 0 if it shall not end on the ground.
            dt_s: [s] since the last frame.
        """


class DriveWatch(Protocol):
    """Says whether a motor has failed."""

    def reset(self) -> None:
        """The vehicle has just been armed."""

    def has_failure(self) -> bool: ...


@dataclass(frozen=True, slots=True)
class VehicleClass:
    """One class of vehicles."""

    name: str
    law: ControlLaw
    """The kernel half."""
    parameters: Sequence[Parameter]
    """Those of the law and of the class's own detectors."""
    defaults: Callable[[Airframe], Mapping[str, int | float]]
    """Parameters whose default the airframe file decides."""
    ground_detector: Callable[[ParameterTable, Airframe], GroundDetector]
    modes: ModeTable
    """Its flight modes."""
    last_resort: Mode
    """Where a mode leads that cannot be flown on: down for what flies, a stop for what drives."""
    hover_thrust: Callable[[Airframe], float]
    """[0..1] collective thrust that carries the vehicle; 0 where the ground does."""
    mav_type: Callable[[Airframe], int]
    """MAV_TYPE of the heartbeat."""
