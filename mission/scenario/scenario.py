"""A scenario: the world, who flies in it, what goes wrong, and what is asked of the flight.

A file `NAME.scenario.yaml` is one of these written down (`scenario_file.py`); Python makes the same objects. It is
flown by `runner.run_scenario`. Light to import.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, PrivateAttr, model_validator

from common.config.refusal import NO_SUCH_KEY, meant_or_known
from common.config.yaml_locations import Located, location_at, note_at
from mission.console.option_checks import UserError
from mission.flight_settings import EngineName, Pace
from mission.scenario.parts.checks import Check
from mission.scenario.parts.faults import Fault
from mission.scenario.parts.part import FileName, Finite, Key, KeyRefusal, Part, Place
from mission.scenario.parts.steps import Step

WorldName = Literal["hills", "plain", "airfield", "follow", "forest", "walled-forest", "course", "car-park"]
VEHICLES_MAX = 50
SEED_MAX = 2**31 - 1
ITEM_MARK = "item "  # of a mission: the moment is when it is reached


class World(Part):
    """The ground. What is left out is as its kind has it."""

    kind: WorldName = "hills"
    """hills: no trees within 80 m; plain: level, no trees; airfield: for planes; follow: hills an owner walks in;
    forest, walled-forest (for a rover), course and car-park: those that policies are judged in."""
    file: Path | None = None
    """A world file; the other keys are then left out."""
    seed: int = Field(default=1, ge=0, le=2**32 - 1)
    """Of terrain and trees."""
    size_m: float | None = Field(default=None, ge=50.0, le=10_000.0)
    cell_m: float | None = Field(default=None, ge=0.5, le=50.0)
    hill_height_m: float | None = Field(default=None, ge=0.0, le=300.0)
    hill_wavelength_m: float | None = Field(default=None, ge=20.0, le=5_000.0)
    octaves: int | None = Field(default=None, ge=1, le=8)
    clearing_radius_m: float | None = Field(default=None, ge=0.0, le=1_000.0)
    clearing_blend_m: float | None = Field(default=None, ge=1.0, le=5_000.0)
    trees_per_ha: float | None = Field(default=None, ge=0.0, le=1_000.0)
    treeless_radius_m: float | None = Field(default=None, ge=0.0, le=1_000.0)
    tree_height_min_m: float | None = Field(default=None, ge=1.0, le=60.0)
    tree_height_max_m: float | None = Field(default=None, ge=1.0, le=60.0)
    has_walls: bool | None = None
    wall_height_m: float | None = Field(default=None, ge=1.0, le=200.0)
    wall_count: int | None = Field(default=None, ge=0, le=100)
    mover_count: int | None = Field(default=None, ge=0, le=20)
    spot_count: int | None = Field(default=None, ge=0, le=20)

    @model_validator(mode="after")
    def _is_one_thing(self) -> Self:
        if self.file is not None and self.model_fields_set != {"file"}:
            raise ValueError("file: a world file says all about the world: leave the other keys out")
        return self


class Wind(Part):
    """The air, with turbulence and gusts that go with its mean."""

    speed_m_s: float = Field(default=0.0, ge=0.0, le=20.0)
    from_deg: float = Field(default=270.0, ge=0.0, le=360.0)
    """Clockwise from north."""
    turbulence_m_s: float | None = Field(default=None, ge=0.0, le=10.0)
    """Deviation of the vertical wind, gusts are up to three times that; left out: a tenth of the wind."""


class Home(Part):
    """The origin of north, east and down."""

    lat_deg: float = Field(ge=-89.0, le=89.0)
    lon_deg: float = Field(ge=-180.0, le=180.0)
    alt_m: float = Field(default=488.0, ge=-500.0, le=6000.0)


def _follow_me_number(name: str) -> str:
    """The name, if FollowMe has such a task parameter."""
    from policies.tasks.follow_me.follow_me_params import FOLLOW_PARAMS  # only who gives numbers waits for it

    known = [number.name for number in FOLLOW_PARAMS]
    if name not in known:
        raise ValueError(f"{NO_SUCH_KEY}; {meant_or_known(name, known)}")
    return name


class Owner(Part):
    """A person who walks about with a phone, and is followed."""

    pace: Pace = "walk"
    """walk: up to 2 m/s; run: up to 5 m/s."""
    start_m: float = Field(default=3.0, ge=1.0, le=50.0)
    """How far north of home they wait."""
    numbers: dict[Annotated[str, AfterValidator(_follow_me_number)], Finite] = Field(default_factory=dict)
    """Task parameters of FollowMe that hold for a flight: how the owner and others walk and look, phone, camera."""


class Policy(Part):
    """A learned policy, flown by a companion computer on board."""

    name: str
    """One that ships, a file or a run's folder; `scripted` follows by rules."""
    has_guard: bool = True
    """A guard that does not believe it bounds it."""
    guard: dict[str, Finite] = Field(default_factory=dict)
    """Settings of the guard by their names, as [its settings](guard-settings.md) list them: `{owner_m: 1.5}`."""
    scan_lag_s: float = Field(default=0.0, ge=0.0, le=1.0)
    """Of the scans that policies of Navigate and of Drive see by."""

    @model_validator(mode="after")
    def _has_such_a_guard(self) -> Self:
        if self.guard:
            from policies.companion.guard.settings import GuardSettingError, guard_settings  # takes Warp

            if not self.has_guard:
                raise KeyRefusal(("guard",), "it has none: has_guard is false")
            try:
                guard_settings(self.guard)
            except GuardSettingError as error:
                raise KeyRefusal(("guard", error.name), error.wrong) from error
        return self


class Start(Part):
    """How it stands before power-on."""

    ne_m: Place = (0.0, 0.0)
    """North, east of home [m]."""
    heading_deg: float = Field(default=0.0, ge=0.0, le=360.0)
    """Where its nose points, from north, clockwise."""
    battery: float = Field(default=1.0, ge=0.01, le=1.0)
    """Fraction of its charge."""


class Vehicle(Part):
    """Who flies or drives, and what it is told to do: by a plan, a script or Python."""

    airframe: str = "x500"
    """Name or TOML file."""
    count: int = Field(default=1, ge=1, le=VEHICLES_MAX)
    """So many of it, each of which does the same."""
    start: Start = Start()
    """Of several in `vehicles` without a place: side by side, 10 m apart."""
    parameters: dict[str, Finite] = Field(default_factory=dict)
    """Of the flight controller, by name."""
    throw_m_s: float | None = Field(default=None, ge=1.0, le=60.0)
    """A plane: thrown at this speed."""
    has_lidar: bool = False
    """A ring of range finders that looks round."""
    has_base: bool = False
    """A base station beside home sends the GNSS receiver corrections."""
    policy: Policy | None = None
    plan: Path | None = None
    """A QGroundControl .plan or QGC WPL 110 file that it flies to the end."""
    script: tuple[Step, ...] = ()
    """Steps, one after the other."""
    python: str | None = Field(default=None, pattern=r"^.+\.py:[A-Za-z_]\w*$")
    """FILE.py:FUNCTION, a coroutine that takes the Drone, and the run if it has two arguments."""

    @model_validator(mode="after")
    def _has_one_order(self) -> Self:
        orders = [name for name in ("plan", "script", "python") if getattr(self, name)]
        if len(orders) > 1:
            raise ValueError(f"{' and '.join(orders)}: choose one, a plan, a script or Python")
        if self.count > 1 and "ne_m" in self.start.model_fields_set:
            raise KeyRefusal(("start", "ne_m"), f"is one place for {self.count} vehicles: write each in vehicles")
        return self


@dataclass(frozen=True, slots=True)
class Source:
    """The file that a scenario was read from. All are equal: scenarios that say the same are."""

    root: Located | None = field(default=None, compare=False)
    """None: none, Python made it."""


class Scenario(Part):
    """One scenario."""

    _source: Source = PrivateAttr(default_factory=Source)
    name: FileName = ""
    """Left out: the file's."""
    about: str = ""
    """What it shows, in a sentence."""
    seeds: tuple[Annotated[int, Field(ge=0, le=SEED_MAX)], ...] = Field(default=(1,), min_length=1, max_length=10_000)
    """Of noise, turbulence and the owner's path; it is flown once with each."""
    time_max_s: float = Field(default=600.0, gt=0.0, le=36_000.0)
    """Simulated; a script that is not done by then has failed."""
    world: World = World()
    home: Home | None = None
    wind: Wind = Wind()
    noise: float = Field(default=1.0, ge=0.0, le=10.0)
    """Scale of all sensor noise."""
    sensor_roughness: float = Field(default=0.0, ge=0.0, le=1.0)
    """Vibration and magnetic noise; 1: as in the roughest of five real logs."""
    engine: EngineName = "native"
    """Who moves the body."""
    traffic: int = Field(default=0, ge=0, le=50)
    """Other aircraft that are heard by ADS-B."""
    has_ground_station: bool = False
    """A ground station is connected, whose link a fault can cut."""
    has_transponders: bool = False
    """Several vehicles hear each other by ADS-B."""
    owner: Owner | None = None
    vehicle: Vehicle = Vehicle()
    """The one that flies; or else `vehicles`."""
    vehicles: tuple[Vehicle, ...] = Field(default=(), max_length=VEHICLES_MAX)
    faults: tuple[Fault, ...] = ()
    checks: tuple[Check, ...] = ()
    fails_with: str = ""
    """The script is to fail with an error that contains this."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.vehicles and "vehicle" in self.model_fields_set:
            raise KeyRefusal(("vehicles",), "there is vehicle, too: choose one")
        fleet = self.fleet
        if len(fleet) > VEHICLES_MAX:
            raise KeyRefusal(("vehicles",), f"at most {VEHICLES_MAX} in all, not {len(fleet)}")
        learned = [("owner",)] * (self.owner is not None) + [
            (*key, "policy") for key, vehicle in zip(self.fleet_keys, fleet, strict=True) if vehicle.policy
        ]
        if len(fleet) > 1 and learned:
            raise KeyRefusal(learned[0], "is for a scenario of one vehicle")
        for i, fault in enumerate(self.faults):
            self._check_number(("faults", i, "vehicle"), fault.vehicle)
        for i, check in enumerate(self.checks):
            self._check_number(("checks", i, "vehicle"), check.vehicle)
            self._check_number(("checks", i, "near", "to_vehicle"), check.near.to_vehicle if check.near else None)
        self._check_marks()
        return self

    def _check_number(self, key: Key, number: int | None) -> None:
        """Refuses the number of a vehicle that there is not."""
        count = len(self.fleet)
        if number is not None and number > count:
            there = f"there are 1 to {count}" if count > 1 else "there is one vehicle, 1"
            raise KeyRefusal(key, f"there is no vehicle {number}; {there}")

    def _check_marks(self) -> None:
        """Refuses a mark that nothing makes; Python may make any."""
        if any(vehicle.python for vehicle in self.fleet):
            return
        steps = [step for vehicle in self.fleet for step in vehicle.script]
        known = {step.mark.name for step in steps if step.mark} | {fault.mark for fault in self.faults if fault.mark}
        for i, check in enumerate(self.checks):
            for name, end in (("from", check.from_), ("to", check.to)):
                if isinstance(end, str) and end not in known and not end.startswith(ITEM_MARK):
                    hint = meant_or_known(end, sorted(known))
                    raise KeyRefusal(("checks", i, name), f"nothing makes a mark '{end}'; {hint}")

    @property
    def needs_learn(self) -> bool:
        """Whether it needs the extra `learn`."""
        return self.owner is not None or any(vehicle.policy is not None for vehicle in self.fleet)

    @property
    def fleet(self) -> tuple[Vehicle, ...]:
        """Every vehicle, those of a count one by one."""
        return tuple(each for given in self.vehicles or (self.vehicle,) for each in [given] * given.count)

    @property
    def fleet_keys(self) -> tuple[Key, ...]:
        """Where each of `fleet` is described."""
        if not self.vehicles:
            return (("vehicle",),) * self.vehicle.count
        return tuple(("vehicles", i) for i, given in enumerate(self.vehicles) for _ in range(given.count))

    def keep_source(self, root: Located) -> None:
        """Remembers the file that it was read from, for refusals."""
        self._source = Source(root)

    def refusal(self, refused: UserError, name: str) -> str:
        """The sentence about what cannot be flown, with file and line if it is about a key.

        Args:
            refused: what is wrong.
            name: how a scenario is called that was read from no file.
        """
        if self._source.root is None or not isinstance(refused, KeyRefusal):
            return f"{name}: {refused}"
        location, key = location_at(self._source.root, refused.key)
        return note_at(location, key, refused.sentence)
