"""`python -m bench.follow.braking`: the way that a vehicle needs to a stand, and what the guard's rule takes it to be.

A pilot that asks for a speed and then for none, back and forth, over MAVLink in open country and wind, the flight
controller set as it is to follow, or with `--usual` as it is else. The way counts from the decision that asks for none.
The rule has to allow for a decision more: who stops may do so right after one. Who overshoots comes back.
"""

from collections.abc import Mapping
from itertools import product
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

from bench.row import require
from common.airframe import load_airframe
from mission.flight_config import FlightConfig, OwnerConfig, flight_parameters
from mission.follow.follow_scoring import FollowWatch
from mission.follow.lockstep import flight_with_companion, follow_for
from mission.follow.vehicle_setup import owner_brake
from policies.companion.guard.settings import GuardSettings
from policies.experts.follower import Floats, ScriptedFollower
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import DECISION_S
from policies.tasks.follow_me.tracked.quick_vehicle import MEASURED, QUICK
from policies.tasks.follow_me.world import FOLLOW_WORLD

WINDS_M_S = 0.0, 10.0
SEED = 3_930_001  # odd, as of all tests
LEG, STAND = 40, 25  # decisions at the speed, and at none
_TURNS = 4  # how often it stops
_STANDS_M_S = 0.15  # beside what wind and noise do


class Stopper(ScriptedFollower):
    """Asks for a speed ahead, for none, for the same backwards, for none, and so on.

    Args:
        speed: [m/s].
    """

    def __init__(self, speed: float) -> None:
        super().__init__()
        self._part = speed / ACTIONS[0].scale
        self.decisions = 0

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        """The same whatever it is told, but for the height, which it keeps."""
        down = super().act(vector, image)[2]
        self.owner_hfrd = (3.0, 0.0, 0.0)  # so that it is let fly on
        turn, k = divmod(self.decisions, LEG + STAND)
        self.decisions += 1
        ahead = self._part * (-1.0) ** turn if k < LEG else 0.0
        return np.array([ahead, 0.0, down, 0.0], np.float32)


def config_of(airframe: str, wind_m_s: float, parameters: Mapping[str, float]) -> FlightConfig:
    world = FOLLOW_WORLD.model_copy(update={"trees_per_ha": 0.0, "seed": SEED})
    return FlightConfig(
        airframe=airframe,
        owner=OwnerConfig(pace="walk"),
        world=world,
        seed=SEED,
        wind_m_s=wind_m_s,
        parameters=dict(parameters),
    )


def stops(config: FlightConfig, speed: float) -> tuple[Floats, Floats]:
    """The way [m] to each stand but the first, while it comes to speed, and how fast it goes back [m/s]: (stands,)."""
    pilot = Stopper(speed)
    flight, companion = flight_with_companion(config, pilot, guard=GuardSettings(is_on=False))
    truth = flight.rig.rows["truth"][0]
    rows: list[tuple[int, float, float, float, float]] = []

    def look(_: FollowWatch) -> None:
        north, east = (float(x) for x in truth["pos_ned"][:2])
        north_m_s, east_m_s = (float(x) for x in truth["vel_ned"][:2])
        rows.append((pilot.decisions, north, east, north_m_s, east_m_s))

    follow_for(flight, companion, (_TURNS + 1) * (LEG + STAND) * DECISION_S, look)
    seen = np.array(rows)
    asked, place, vel = seen[:, 0] - 1, seen[:, 1:3], seen[:, 3:]
    speeds = np.hypot(*vel.T)
    ways, backs = [], []
    for turn in range(1, _TURNS):
        is_asked = (asked >= turn * (LEG + STAND) + LEG) & (asked < (turn + 1) * (LEG + STAND))
        first = int(np.argmax(is_asked))
        require(bool(abs(speeds[first] - speed) < 0.1 * speed), f"{config.airframe}: came to {speeds[first]:.1f} m/s")
        is_standing = is_asked & (speeds < _STANDS_M_S)
        require(bool(is_standing.any()), f"{config.airframe}: never stood after {speed:g} m/s")
        stands = int(np.argmax(is_standing))
        ways.append(float(np.hypot(*(place[stands] - place[first]))))
        backs.append(-float((vel[is_asked] @ vel[first]).min()) / float(speeds[first]))
    return np.array(ways, np.float32), np.array(backs, np.float32)


def rule_m(config: FlightConfig, speed: float) -> float:
    """What the guard takes it to be [m], with a decision more."""
    brake = owner_brake(config, flight_parameters(config, load_airframe(config.airframe)))
    return speed * GuardSettings().reaction_s + 0.5 * speed * speed / brake


def main(
    airframes: Annotated[list[str] | None, typer.Argument(help="Default: those that were measured.")] = None,
    usual: Annotated[
        bool, typer.Option("--usual", help="The flight controller as it is where nobody follows by the senses.")
    ] = False,
) -> None:
    """Prints the table."""
    table = Table(
        "airframe", "wind [m/s]", "speed [m/s]", "to a stand [m]", "and a decision more", "the rule", "back at [m/s]"
    )
    cases = list(product(airframes or MEASURED, WINDS_M_S, (2.0, 4.0, 6.0)))
    for airframe, wind_m_s, speed in track(cases, "braking", transient=True):
        config = config_of(airframe, wind_m_s, {} if usual else QUICK)
        ways_m, backs = stops(config, speed)
        way_m = float(ways_m.max())
        more_m = way_m + speed * float(DECISION_S)
        figures = (wind_m_s, speed, way_m, more_m, rule_m(config, speed), float(backs.max()))
        table.add_row(airframe, *(f"{figure:.3g}" for figure in figures))
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
