"""Which program of others flies, by the options of a single flight."""

from pathlib import Path

from rich.console import Console

from mission.boards.betaflight_run import BetaflightRun
from mission.boards.board_session import PeerRun
from mission.flight_settings import FlightOptions


def run_of(options: FlightOptions, folder: Path, console: Console) -> PeerRun | BetaflightRun:
    """The autopilot that the options name, for the length of a flight."""
    kind = BetaflightRun if options.board == "betaflight" else PeerRun
    return kind.of(options, folder, console)
