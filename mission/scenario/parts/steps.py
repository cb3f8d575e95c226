"""The steps that a vehicle is told to do, one after the other. Light to import."""

from pathlib import Path
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from mission.scenario.parts.conditions import Condition
from mission.scenario.parts.part import Finite, Metres, OneOf, Part, Place, Point, Seconds, Short

ModeName = Literal[
    "hold", "takeoff", "mission", "return", "land", "offboard", "manual", "stabilized", "acro", "altitude", "position",
    "precision_land", "follow", "orbit", "brake", "smart_return", "guided", "termination",
]  # fmt: skip


class Arm(Part):
    """Arms it, once it is ready."""

    force: bool = False
    """Without its checks."""


class Disarm(Part):
    """Disarms it."""

    force: bool = False
    """In the air too."""


class Takeoff(Short):
    """Climbs to a height above home and holds there."""

    short: ClassVar[str] = "height_m"
    height_m: float = Field(default=10.0, gt=0.0, le=1000.0)
    timeout_s: Seconds = 120.0


class GotoNed(Short):
    """Goes to a point and returns when it is there."""

    short: ClassVar[str] = "to"
    to: Point
    """North, east, down of home [m]."""
    speed_m_s: float | None = Field(default=None, gt=0.0, le=100.0)
    yaw_deg: Finite | None = None
    within_m: float = Field(default=0.5, gt=0.0, le=1000.0)
    """So near it is there."""
    timeout_s: Seconds = 120.0


class Hold(Short):
    """Holds where it is, for so long."""

    short: ClassVar[str] = "for_s"
    for_s: Seconds


class Wait(Short):
    """Lets time pass; it goes on with what it does."""

    short: ClassVar[str] = "for_s"
    for_s: Seconds


class WaitUntil(Short):
    """Returns when a condition holds; it is an error if it does not in time."""

    short: ClassVar[str] = "condition"
    condition: Condition
    timeout_s: Seconds = 120.0


class WaitDisarmed(Short):
    """Returns when it stands and has stopped its motors."""

    short: ClassVar[str] = "timeout_s"
    timeout_s: Seconds = 300.0


class Velocity(Part):
    """Flies a velocity by Offboard setpoints for so long, then holds."""

    ned_m_s: Point
    for_s: Seconds
    yaw_deg: Finite | None = None


class Position(Part):
    """Flies to a point by Offboard setpoints for so long, then holds."""

    ned: Point
    for_s: Seconds
    yaw_deg: Finite | None = None


class Land(Short):
    """Lands here and returns when the motors have stopped."""

    short: ClassVar[str] = "timeout_s"
    timeout_s: Seconds = 180.0


class PrecisionLand(Part):
    """Lands on a target that a camera under it sees, ten times a second with 0.01 rad of noise."""

    target_ne_m: Place | None = None
    """Where it lies on the ground; or else `target_vehicle`."""
    target_vehicle: int | None = Field(default=None, ge=1, le=50)
    """The vehicle that carries it, from 1."""
    until: Condition | None = None
    """Goes on with the script when this holds; left out: when it has landed."""
    timeout_s: Seconds = 180.0

    @model_validator(mode="after")
    def _has_one_target(self) -> Self:
        if (self.target_ne_m is None) == (self.target_vehicle is None):
            raise ValueError("a target is either target_ne_m (a place) or target_vehicle")
        return self


class ReturnHome(Short):
    """Returns home as its parameters say, until the motors have stopped."""

    short: ClassVar[str] = "timeout_s"
    timeout_s: Seconds = 300.0


class _Mission(Part):
    """What missions have in common."""

    waits: bool = True
    """Until its end; else the script goes on as soon as the mission has begun."""


class FlyPlan(Short, _Mission):
    """Uploads a plan with its fence and rally points, and flies it to its end."""

    short: ClassVar[str] = "file"
    file: Path
    """A QGroundControl .plan or QGC WPL 110 file, from the folder of the scenario."""


class FlyPath(_Mission):
    """Uploads a mission through points, starts it and flies it to its end; what flies takes off first."""

    points: tuple[Point, ...] = Field(min_length=1, max_length=500)
    """North, east, down of home [m]."""
    is_spline: bool = False
    speed_m_s: float | None = Field(default=None, gt=0.0, le=100.0)
    end: Literal["land", "return", "hold"] = "land"
    """At the last point."""


class Survey(_Mission):
    """Uploads a mission to and fro over a rectangle, starts it and flies it to its return home."""

    corner_ne_m: Place = (0.0, 0.0)
    north_m: Metres
    east_m: Metres
    lines: int = Field(ge=2, le=200)
    """Each along north; the rectangle is as wide as `east_m`."""
    points_per_line: int = Field(default=2, ge=2, le=100)
    height_m: float = Field(default=15.0, gt=0.0, le=1000.0)
    speed_m_s: float | None = Field(default=None, gt=0.0, le=100.0)


class Fence(Part):
    """Uploads a fence: a circle or a polygon."""

    circle_ne_m: Place | None = None
    """Its middle."""
    radius_m: float | None = Field(default=None, gt=0.0, le=100_000.0)
    polygon_ne_m: tuple[Place, ...] | None = Field(default=None, min_length=3, max_length=100)
    keeps: Literal["in", "out"] = "in"

    @model_validator(mode="after")
    def _has_one_shape(self) -> Self:
        if (self.circle_ne_m is None) != (self.radius_m is None):
            raise ValueError("a circle has both circle_ne_m (its middle) and radius_m")
        if (self.circle_ne_m is None) == (self.polygon_ne_m is None):
            raise ValueError("a fence is either a circle (circle_ne_m, radius_m) or a polygon (polygon_ne_m)")
        return self


class SetMode(Short):
    """Chooses a flight mode."""

    short: ClassVar[str] = "mode"
    mode: ModeName


class Speed(Short):
    """Changes the speed at which it goes places."""

    short: ClassVar[str] = "m_s"
    m_s: float = Field(gt=0.0, le=100.0)


class Mark(Short):
    """Gives this moment a name that checks can begin or end at."""

    short: ClassVar[str] = "name"
    name: str = Field(min_length=1, max_length=60)


class Sticks(Part):
    """Moves the sticks for so long, then lets them go to the middle; the radio goes on."""

    roll: float = Field(default=0.0, ge=-1.0, le=1.0)
    pitch: float = Field(default=0.0, ge=-1.0, le=1.0)
    """Forward is positive."""
    yaw: float = Field(default=0.0, ge=-1.0, le=1.0)
    throttle: float = Field(default=0.0, ge=-1.0, le=1.0)
    """Up is positive; what drives: forward."""
    for_s: Seconds = 1.0


class LetPolicyFly(Short):
    """Lets the companion's policy follow the owner for so long."""

    short: ClassVar[str] = "for_s"
    for_s: float = Field(gt=0.0, le=3600.0)


class PolicyGoto(Short):
    """Sends the companion's policy to a place, and returns when it has handed the vehicle back."""

    short: ClassVar[str] = "to"
    to: Place
    height_m: float = Field(default=2.0, ge=0.0, le=100.0)
    """Above the ground there."""
    timeout_s: Seconds = 120.0


class PolicyPark(Short):
    """Lets the companion's policy drive into a spot of the car park."""

    short: ClassVar[str] = "spot"
    spot: int = Field(ge=1, le=40)
    is_reverse: bool = False
    """The nose to the aisle."""


class Step(OneOf):
    """One step of a script."""

    what: ClassVar[str] = "step"
    arm: Arm | None = None
    disarm: Disarm | None = None
    takeoff: Takeoff | None = None
    goto_ned: GotoNed | None = None
    hold: Hold | None = None
    wait: Wait | None = None
    wait_until: WaitUntil | None = None
    wait_disarmed: WaitDisarmed | None = None
    velocity: Velocity | None = None
    position: Position | None = None
    land: Land | None = None
    precision_land: PrecisionLand | None = None
    return_home: ReturnHome | None = None
    fly_plan: FlyPlan | None = None
    fly_path: FlyPath | None = None
    survey: Survey | None = None
    fence: Fence | None = None
    set_mode: SetMode | None = None
    speed: Speed | None = None
    set_param: dict[str, Finite] | None = None
    """Parameters, by name."""
    mark: Mark | None = None
    sticks: Sticks | None = None
    let_policy_fly: LetPolicyFly | None = None
    policy_goto: PolicyGoto | None = None
    policy_park: PolicyPark | None = None
