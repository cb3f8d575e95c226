"""What is asked of a flight. Each check has a tolerance, and may look at a part of the flight only. Light to import.

How each is judged is in `judging.py`: all by the truth, after the flight, from the history that is kept at 50 Hz.
"""

from typing import ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from mission.scenario.parts.conditions import Condition
from mission.scenario.parts.part import (
    Finite,
    KeyRefusal,
    Metres,
    OneOf,
    Part,
    Place,
    Point,
    Seconds,
    Short,
    check_asked,
    check_order,
)
from mission.scenario.parts.steps import ModeName


class Range(Part):
    """Bounds of a quantity."""

    min: Finite | None = None
    max: Finite | None = None

    @model_validator(mode="after")
    def _has_a_bound(self) -> Self:
        if self.min is None and self.max is None:
            raise ValueError("needs min, max or both")
        check_order(self.min, self.max)
        return self


class Corridor(Part):
    """It stays near a line."""

    within_m: float = Field(gt=0.0, le=10_000.0)
    line: tuple[Point, ...] | None = Field(default=None, min_length=2, max_length=1000)
    """Through these points; left out: the legs of its mission, while it flies them."""
    is_level: bool = False
    """On the map, whatever its height."""
    percent: float = Field(default=100.0, gt=0.0, le=100.0)
    """Of the time."""


class Near(Part):
    """It stays near a point, or near another vehicle: while armed, or from `from` on whether armed or not."""

    point: Point | None = None
    to_vehicle: int | None = Field(default=None, ge=1, le=50)
    """Near this one, from 1."""
    within_m: float = Field(gt=0.0, le=10_000.0)
    is_level: bool = False
    """On the map, whatever its height."""

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        if (self.point is None) == (self.to_vehicle is None):
            raise ValueError("it is near either a point or a vehicle (to_vehicle)")
        return self


class Away(Part):
    """It stays away from a point."""

    point: Point
    min_m: float = Field(gt=0.0, le=10_000.0)
    is_level: bool = False
    """On the map, whatever its height."""


class Arrives(Part):
    """It comes to a point."""

    point: Point
    within_m: float = Field(gt=0.0, le=10_000.0)
    is_level: bool = False
    """On the map, whatever its height."""
    before_s: Seconds | None = None
    """Simulated time; counted from the check's `from` if it has one."""


class Estimator(Part):
    """The estimate stays near the truth, while armed."""

    horizontal_m: Metres | None = None
    vertical_m: Metres | None = None
    velocity_m_s: Metres | None = None
    tilt_deg: Metres | None = None
    heading_deg: Metres | None = None
    percent: float = Field(default=100.0, gt=0.0, le=100.0)
    """Of the time."""

    @model_validator(mode="after")
    def _has_a_bound(self) -> Self:
        check_asked(self, "horizontal_m", "vertical_m", "velocity_m_s", "tilt_deg", "heading_deg")
        return self


class Clearance(Short):
    """It keeps away from trees, walls, boxes, meshes and pads while armed: what starts on a pad needs a `from`."""

    short: ClassVar[str] = "min_m"
    min_m: Metres


class Separation(Short):
    """All vehicles keep away from each other, or one from all others, while armed."""

    short: ClassVar[str] = "min_m"
    min_m: Metres


class Duration(Part):
    """The flight, or the part looked at, lasts so long."""

    min_s: Seconds | None = None
    max_s: Seconds | None = None

    @model_validator(mode="after")
    def _has_a_bound(self) -> Self:
        check_asked(self, "min_s", "max_s")
        check_order(self.min_s, self.max_s, ("min_s", "max_s"))
        return self


class Modes(Short):
    """The flight modes that it has while armed, in this order; others may come in between."""

    short: ClassVar[str] = "order"
    order: tuple[ModeName, ...] = Field(min_length=1)
    is_exact: bool = False
    """And no others."""


class Heard(Short):
    """The vehicle says something that contains this, whatever the case of letters."""

    short: ClassVar[str] = "text"
    text: str = Field(min_length=1)
    before_s: Seconds | None = None
    """Simulated time; counted from the check's `from` if it has one."""


class NotHeard(Short):
    """The vehicle says nothing that contains this."""

    short: ClassVar[str] = "text"
    text: str = Field(min_length=1)


class Battery(Part):
    """What the flight takes from the battery, as the vehicle counts it."""

    used_max_mah: Metres | None = None
    used_max_wh: Metres | None = None
    """At the nominal voltage."""
    remaining_min: float | None = Field(default=None, ge=0.0, le=1.0)

    @model_validator(mode="after")
    def _has_a_bound(self) -> Self:
        check_asked(self, "used_max_mah", "used_max_wh", "remaining_min")
        return self


class AtEnd(Part):
    """How it stands when the flight is over."""

    is_armed: bool | None = None
    is_landed: bool | None = None
    is_crashed: bool | None = False
    near: Place | None = None
    """North, east of home [m]."""
    within_m: float = Field(default=1.0, gt=0.0, le=10_000.0)
    """Of `near`."""

    @model_validator(mode="after")
    def _asks_something(self) -> Self:
        check_asked(self, "is_armed", "is_landed", "is_crashed", "near")
        if self.near is None and "within_m" in self.model_fields_set:
            raise ValueError("within_m: is of near, which is left out")
        return self


class Reached(Short):
    """The vehicle says that it has reached an item of its mission."""

    short: ClassVar[str] = "item"
    item: int = Field(ge=0)
    """From 0."""


class Always(Short):
    """A condition holds all the time, while armed."""

    short: ClassVar[str] = "condition"
    condition: Condition
    percent: float = Field(default=100.0, gt=0.0, le=100.0)
    """Of the time."""


class Once(Short):
    """A condition holds at some time."""

    short: ClassVar[str] = "condition"
    condition: Condition


class NoContact(Part):
    """It touches nothing from then on but the ground it lands on."""

    max_m_s: float = Field(default=0.0, ge=0.0, le=50.0)
    """The hardest touch that is allowed."""


class TouchDown(Short):
    """It touches the ground no harder than this."""

    short: ClassVar[str] = "max_m_s"
    max_m_s: float = Field(gt=0.0, le=50.0)


class Following(Part):
    """How well the policy followed: figures of its scorecard, over the time that it was to follow."""

    in_band_min: float | None = Field(default=None, ge=0.0, le=1.0)
    """Fraction of the time 1 to 3 m from the owner."""
    in_view_min: float | None = Field(default=None, ge=0.0, le=1.0)
    distance_min_m: Metres | None = None
    """From the owner's chest."""
    distance_max_m: Metres | None = None
    has_collision: bool | None = False

    @model_validator(mode="after")
    def _asks_something(self) -> Self:
        check_asked(self, "in_band_min", "in_view_min", "distance_min_m", "distance_max_m", "has_collision")
        check_order(self.distance_min_m, self.distance_max_m, ("distance_min_m", "distance_max_m"))
        return self


FigureName = Literal[
    "success", "tracking", "collision", "in_band", "distance_rmse_m", "distance_median_m", "bearing_error_deg",
    "in_view", "losses_per_minute", "loss_s", "reacquired",
]  # fmt: skip


MeasuredName = Literal["park_distance_m", "park_turn_deg", "park_s", "policy_goto_s"]


class Interventions(Short):
    """The guard changes the policy's decisions at most so often."""

    short: ClassVar[str] = "max_per_min"
    max_per_min: float = Field(ge=0.0)


_OF_THE_WHOLE = ("at_end", "following", "scorecard", "interventions", "figures")
_OF_ANY_MODE = ("modes", "separation")


class Check(OneOf):
    """One thing asked of the flight."""

    model_config = ConfigDict(populate_by_name=True)

    what: ClassVar[str] = "check"
    besides: ClassVar[frozenset[str]] = frozenset({"name", "from_", "to", "vehicle", "during"})
    name: str = ""
    """How reports call it; left out: by what it is."""
    from_: Finite | str | None = Field(default=None, alias="from")
    """Looks from this simulated time [s], or this mark, on; `item 3` is when that item of its mission is reached."""
    to: Finite | str | None = None
    """Looks until this simulated time [s], or this mark."""
    during: ModeName | None = None
    """Looks at the time while armed in this flight mode only."""
    vehicle: int | None = Field(default=None, ge=1, le=50)
    """Of several the one to look at, from 1; left out: each."""
    altitude: Range | None = None
    """Height above home [m]."""
    above_ground: Range | None = None
    """Height above the ground under it [m]."""
    speed: Range | None = None
    """Horizontal [m/s]."""
    climb: Range | None = None
    """[m/s], up."""
    tilt: Range | None = None
    """[deg]"""
    airspeed: Range | None = None
    """[m/s]"""
    corridor: Corridor | None = None
    near: Near | None = None
    away: Away | None = None
    arrives: Arrives | None = None
    estimator: Estimator | None = None
    clearance: Clearance | None = None
    separation: Separation | None = None
    duration: Duration | None = None
    modes: Modes | None = None
    heard: Heard | None = None
    not_heard: NotHeard | None = None
    battery: Battery | None = None
    at_end: AtEnd | None = None
    reached: Reached | None = None
    always: Always | None = None
    once: Once | None = None
    no_contact: NoContact | None = None
    touch_down: TouchDown | None = None
    following: Following | None = None
    scorecard: dict[FigureName, Range] | None = Field(default=None, min_length=1)
    """Figures of the scorecard of FollowMe, as `honeyguide follow` shows them, each with its bounds."""
    interventions: Interventions | None = None
    figures: dict[MeasuredName, Range] | None = Field(default=None, min_length=1)
    """What `policy_park` and `policy_goto` have measured, each with its bounds: how far from the middle of its spot it
    stood, how far it was turned, how long it took. Of several such steps the last counts."""

    @property
    def title(self) -> str:
        """What its results are called, or begin with."""
        return self.name or self.name_chosen.replace("_", " ")

    @model_validator(mode="after")
    def _looks_at_something(self) -> Self:
        if not isinstance(self.from_, str) and not isinstance(self.to, str):
            check_order(self.from_, self.to, ("from", "to"))
        name, given = self.name_chosen, {"from": self.from_, "to": self.to, "during": self.during}
        for key in [key for key, value in given.items() if value is not None]:
            if name in _OF_THE_WHOLE:
                raise KeyRefusal((key,), f"{name} is of the whole flight, not of a part: leave it out")
            if name in _OF_ANY_MODE and key == "during":
                raise KeyRefusal((key,), f"{name} is of all flight modes: leave it out, or use from and to")
        return self
