"""The programs of others that fly vehicles of a fleet: one for each such vehicle, numbered as the vehicles are."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from mission.boards.betaflight_run import BetaflightRun
from mission.boards.board_session import BoardRun, PeerRun
from mission.console.terminal import Say
from mission.fleet.fleet_options import Member


def board_runs(
    members: Sequence[Member],
    commands: Mapping[str, str],
    folder: Path,
    say: Say,
    *,
    shows_consoles: bool = True,
) -> list[BoardRun | None]:
    """The program of each vehicle; None: our own flight controller flies it.

    Args:
        members: the vehicles; the first is instance 0.
        commands: what starts each kind of program; one without is waited for.
        folder: of the run.
        say: shows a line of their consoles, or about them.
        shows_consoles: as it says.
    """

    def run_of(i: int, member: Member) -> BoardRun | None:
        if member.board == "own":
            return None
        own, whose = folder / f"vehicle-{i + 1}", f" of vehicle {i + 1}"
        command = commands.get(member.board)
        run = BetaflightRun if member.board == "betaflight" else PeerRun
        return run(member.board, command, own, say, instance=i, whose=whose, shows_console=shows_consoles)

    return [run_of(i, member) for i, member in enumerate(members)]
