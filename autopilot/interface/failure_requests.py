"""Failures on request: which part shall fail, how, and the host's side that makes it so.

In: MAVLink's INJECT_FAILURE, through the flight controller. Out: a host that can break things (the simulator) does so,
or says what it cannot do. Off unless SYS_FAILURE_EN is set.
"""

from enum import IntEnum
from typing import Protocol

from autopilot.interface.vehicle_state import Reply, VehicleState, Verdict
from common.params import ParameterTable


class Unit(IntEnum):
    """What fails, numbered as FAILURE_UNIT."""

    GYRO = 0
    ACCELEROMETER = 1
    MAGNETOMETER = 2
    BAROMETER = 3
    GNSS = 4
    OPTICAL_FLOW = 5
    VISUAL_ODOMETRY = 6
    DISTANCE_SENSOR = 7
    AIRSPEED = 8
    BATTERY = 100
    MOTOR = 101
    SERVO = 102
    AVOIDANCE = 103
    RC_SIGNAL = 104
    MAVLINK_SIGNAL = 105


class Failure(IntEnum):
    """How it fails, numbered as FAILURE_TYPE."""

    OK = 0
    OFF = 1
    STUCK = 2
    GARBAGE = 3
    WRONG = 4
    SLOW = 5
    DELAYED = 6
    INTERMITTENT = 7


class FailureInjector(Protocol):
    """A host that can break the vehicle."""

    def inject(self, unit: Unit, failure: Failure, instance: int) -> Reply:
        """Breaks or repairs a part.

        Args:
            unit: which part.
            failure: how; OK repairs.
            instance: which one of several, from 1; 0: all of them.
        """
        ...


def failure_request(unit: int, failure: int) -> tuple[Unit, Failure] | None:
    """The unit and the failure of these numbers; None if there is no such thing."""
    try:
        return Unit(unit), Failure(failure)
    except ValueError:
        return None


def injection_refusal(params: ParameterTable, state: VehicleState, failure: Failure) -> Reply | None:
    """Why no failure may be injected now; None if one may."""
    if not int(params["SYS_FAILURE_EN"]):
        return Reply(Verdict.DENIED, "failure injection is disabled (SYS_FAILURE_EN)")
    if not state.is_armed and failure is not Failure.OK:
        return Reply(Verdict.DENIED, "failures are injected into an armed vehicle only")
    return None
