"""A scenario under way: its vehicles, what they have said and touched, and the moments that have a name.

Python that flies a vehicle may take a `Run` as its second argument, to see the others and to name moments.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from autopilot.interface.vehicle_state import Severity
from common.attitude import Vector
from mission.client import Running
from mission.flight import Flight
from mission.plan.plan_file import Plan
from mission.scenario.scenario import Scenario, Vehicle
from mission.script import Drone

TOUCH_HEIGHT_M = 0.4  # lower than this above the ground, or with a foot on something, what flies lands


class Witness:
    """Hears what a vehicle says and reaches, with the time; attached to its flight controller.

    Args:
        flight: whose.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self.texts: list[tuple[float, str]] = []  # [s]
        self.reached: list[tuple[float, int]] = []
        self.touches: list[tuple[float, float, bool]] = []  # [s], [m/s], whether it was the ground
        self.changes: list[float] = []  # when the guard over its policy changed a decision [s]
        self.skill: Any = None  # of its policy, if it has one
        rows = flight.rig.rows
        self._truth, self._body = rows["truth"], rows["body"]
        self._truth_row, self._impact = rows["truth"][0], rows["truth"]["impact_speed"]
        flight.controller.attach(self)

    def look(self) -> None:
        """Notes the hardest touch of the frame, and forgets it, and what the guard did; after each frame."""
        if self.skill is not None and self.skill.interventions is not None:
            self.changes += [self._now_s()] * (self.skill.interventions.total() - len(self.changes))
        impact = self._impact[0]
        if impact > 0.0:
            truth = self._truth_row
            stands = bool(truth["is_on_ground"]) or float(truth["height_agl_m"]) < TOUCH_HEIGHT_M
            is_ground = stands and not self._flight.drives
            self.touches.append((self._now_s(), float(impact), is_ground))
            self._impact[0] = 0.0
            self._body["impact_speed"][0] = 0.0

    def _now_s(self) -> float:
        return round(self._flight.time_us * 1e-6, 6)

    def statustext(self, severity: Severity, text: str) -> None:
        del severity
        self.texts.append((self._now_s(), text))

    def mission_item_reached(self, seq: int) -> None:
        self.reached.append((self._now_s(), seq))

    def frame(self, time_us: int) -> None:
        """Nothing: it only listens."""

    def mission_current_changed(self, seq: int) -> None:
        """Nothing: the history has it."""

    def home_changed(self) -> None:
        """Nothing: the vehicle says it."""

    def heartbeat_now(self) -> None:
        """Nothing: the history has modes and arming."""


@dataclass
class VehicleRun:
    """One vehicle of it."""

    number: int
    """From 1."""
    config: Vehicle
    flight: Flight
    witness: Witness
    running: Running | None = None
    """What flies it; None: nothing was asked."""
    plan: Plan | None = None
    """The mission flown last, for the corridor about it."""
    sticks: tuple[float, float, float, float] | None = None
    """Roll, pitch, yaw, throttle in [-1, 1], sent 20 times a second; None: never moved."""

    @property
    def drone(self) -> Drone:
        return self.flight.drone


@dataclass
class Run:
    """A scenario under way."""

    scenario: Scenario
    vehicles: Sequence[VehicleRun]
    companion: Any = None
    """Of the vehicle that a policy flies."""
    stations: Sequence[Any] = ()
    """The ground stations of each vehicle, if there are any."""
    marks: dict[str, float] = field(default_factory=dict)
    """Moments with a name: simulated time [s]."""
    watch: Any = None
    """What judges how the policy follows, once it does."""
    figures: dict[str, float] = field(default_factory=dict)
    """Measured on the way, for the result."""
    measured_s: dict[str, float] = field(default_factory=dict)
    """When each of them was: simulated time [s]."""
    events: list[tuple[float, int, str]] = field(default_factory=list)
    """What the scenario did, faults and marks: simulated time [s], number of the vehicle (0: of all), in words."""

    def __post_init__(self) -> None:
        if self.companion is not None:
            self.vehicles[0].witness.skill = self.companion.skill

    @property
    def drones(self) -> list[Drone]:
        return [vehicle.drone for vehicle in self.vehicles]

    @property
    def time_s(self) -> float:
        return round(self.vehicles[0].flight.time_us * 1e-6, 6)

    def pos_ned(self, number: int) -> Vector:
        """[m] The true position of a vehicle, from 1."""
        north, east, down = (float(v) for v in self.vehicles[number - 1].flight.rig.rows["truth"][0]["pos_ned"])
        return north, east, down

    def mark(self, name: str) -> None:
        """Gives this moment a name; the first of a name counts."""
        if name not in self.marks:
            self.marks[name] = self.time_s
            self.note(f"mark: {name}")

    def measure(self, **figures: float) -> None:
        """Keeps figures of this moment; of a name the last counts."""
        self.figures |= figures
        self.measured_s |= dict.fromkeys(figures, self.time_s)

    def note(self, text: str, vehicle: int = 0) -> None:
        """Something that the scenario did now."""
        self.events.append((self.time_s, vehicle, text))
