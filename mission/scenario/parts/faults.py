"""What goes wrong in a scenario: at a time or when a condition holds, for good or for a while. Light to import.

What each does is of the simulator: `sim/faults.py`, `mission/simulator/failure_injection.py`.
"""

from typing import Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from mission.scenario.parts.conditions import Condition
from mission.scenario.parts.part import OneOf, Part, Seconds, Short

SensorName = Literal[
    "gyro", "accel", "mag", "baro", "gnss", "range", "wheels", "airspeed", "battery",
]  # fmt: skip
FaultMode = Literal["off", "stuck", "biased", "noisy", "slow", "turned"]
LinkName = Literal["ground_station", "sticks", "companion"]


class SensorFault(Part):
    """A sensor fails."""

    name: SensorName
    mode: FaultMode
    magnitude: float | None = Field(default=None, ge=-1e6, le=1e6)
    """biased: in the sensor's unit, on each axis; noisy, slow: the factor; turned: deg."""

    @field_validator("mode", mode="before")
    @classmethod
    def _off_is_no_boolean(cls, given: Any) -> Any:
        return "off" if given is False else given  # YAML 1.1 reads the word so

    @model_validator(mode="after")
    def _has_magnitude(self) -> Self:
        if (self.magnitude is None) != (self.mode in ("off", "stuck")):
            needs = "needs a magnitude" if self.magnitude is None else "has no magnitude"
            raise ValueError(f"mode {self.mode} {needs}")
        if self.mode in ("noisy", "slow") and (self.magnitude or 0.0) < 1.0:
            raise ValueError(f"mode {self.mode}: its magnitude is a factor of at least 1")
        if self.mode == "turned" and self.name != "mag":
            raise ValueError("mode turned: only the magnetometer (mag) can be turned")
        return self


class MotorFault(Part):
    """A motor gets a fraction of its command."""

    number: int = Field(ge=1, le=8)
    """From 1."""
    power: float = Field(default=0.0, ge=0.0, le=1.0)
    """0: it stops."""


class BatteryFault(Short):
    """The battery has so much of its charge left."""

    short: ClassVar[str] = "remaining"
    remaining: float = Field(ge=0.0, le=1.0)


class LinkFault(Short):
    """A link is cut."""

    short: ClassVar[str] = "name"
    name: LinkName


class WindFault(Part):
    """The wind blows otherwise from then on, with turbulence and gusts that go with it."""

    speed_m_s: float = Field(ge=0.0, le=30.0)
    from_deg: float = Field(default=270.0, ge=0.0, le=360.0)
    turbulence_m_s: float | None = Field(default=None, ge=0.0, le=10.0)
    """Deviation of the vertical wind, gusts are up to three times that; left out: a tenth of the wind."""


class Fault(OneOf):
    """One thing that goes wrong."""

    what: ClassVar[str] = "fault"
    besides: ClassVar[frozenset[str]] = frozenset({"at", "when", "for_s", "mark", "vehicle"})
    at: Seconds | None = None
    """Simulated time [s]; or else `when`."""
    when: Condition | None = None
    """The first moment at which it holds, looked for ten times a second."""
    for_s: float | None = Field(default=None, gt=0.0, le=36_000.0)
    """It is over after so long; left out: it stays."""
    mark: str = ""
    """Gives the moment a name that checks can begin or end at."""
    vehicle: int = Field(default=1, ge=1, le=50)
    """Which of several, from 1."""
    sensor: SensorFault | None = None
    motor: MotorFault | None = None
    battery: BatteryFault | None = None
    link: LinkFault | None = None
    wind: WindFault | None = None

    @property
    def thing(self) -> tuple[str | int, ...]:
        """What fails: two faults of one thing are not independent."""
        if self.wind is not None:
            return ("wind",)  # it is one air
        which = {"sensor": "name", "motor": "number", "link": "name"}.get(self.name_chosen)
        return (self.vehicle, self.name_chosen, getattr(self.chosen, which) if which else "")

    @property
    def in_words(self) -> str:
        """As "sensor gnss off"."""
        given = self.chosen.model_dump(exclude_none=True)
        words = (str(value) if key in ("name", "mode") else f"{key} {value:g}" for key, value in given.items())
        return " ".join((self.name_chosen, *words))

    @model_validator(mode="after")
    def _has_one_time(self) -> Self:
        if (self.at is None) == (self.when is None):
            raise ValueError("a fault has either at (a time) or when (a condition)")
        if self.for_s is not None and self.battery is not None:
            raise ValueError("a battery that was emptied stays so: leave for_s out")
        return self
