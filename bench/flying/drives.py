"""How well does a rover drive? The standard trials (mission/drive_benchmarks.py), each against its target."""

from collections.abc import Callable

from bench.row import Row
from mission.drive_benchmarks import OPEN_HILLS, hold_trial, loss_trial, return_trial, speed_trial, square_trial
from mission.flight import FlightConfig

COMMAND = "python -m bench drives"
SEEDS = range(5)
WIND_M_S = 5.0
AIRFRAMES = {"rover": (2.0, 3.0, 5.0), "rover-skid": (1.0, 1.5)}  # and the speeds of their missions [m/s]


def measure() -> list[Row]:
    return [row for airframe in AIRFRAMES for row in _of_airframe(airframe)]


def _of_airframe(airframe: str) -> list[Row]:
    noisy = [FlightConfig(airframe=airframe, world=OPEN_HILLS, wind_m_s=WIND_M_S, seed=seed) for seed in SEEDS]
    perfect = FlightConfig(airframe=airframe, world=OPEN_HILLS, noise=0.0)
    fastest = AIRFRAMES[airframe][-1]
    squares = [square_trial(config, speed) for config in noisy for speed in AIRFRAMES[airframe]]
    returns = [return_trial(config) for config in noisy]
    losses = [loss_trial(config, min(3.0, fastest)) for config in noisy]
    speed_error, heading_error = speed_trial(perfect, min(3.0, fastest))
    row = _namer(airframe)
    return [
        row("mission cross-track on straights, 95 %, worst", max(each.cross_track_p95_m for each in squares), "m", 0.3),
        row("mission overshoot at corners of 90 deg, worst", max(each.overshoot_m for each in squares), "m", 0.4),
        row("mission miss where it stops, worst", max(each.stop_miss_m for each in squares), "m", 0.5),
        row("return, distance to home, worst", max(distance for distance, _ in returns), "m", 1.0),
        row("return, past home on the way, worst", max(past for _, past in returns), "m", 0.5),
        row("hold at (30, 30), without noise", hold_trial(perfect), "m", 0.5),
        row("hold at (30, 30), with noise, worst", max(hold_trial(config) for config in noisy), "m", None),
        row("speed held, without noise", speed_error, "m/s", 0.1),
        row("heading held, without noise", heading_error, "deg", 1.0),
        row("GNSS lost for 30 s, error over way, worst", 100.0 * max(each.fraction for each in losses), "%", 3.0),
    ]


def _namer(airframe: str) -> Callable[[str, float, str, float | None], Row]:
    def row(name: str, value: float, unit: str, target: float | None) -> Row:
        return Row(f"{airframe}: {name}", value, unit, "lower", target, COMMAND)

    return row
