"""Which vehicles `--vehicles` asks for, and what does not go with it; light to import.

In: the options. Out: the airframe of each vehicle, and who flies it.
"""

from collections.abc import Sequence
from typing import NamedTuple, cast, get_args

from common.airframe import AirframeError, load_airframe
from mission.boards.board_options import check_flown, check_ours, commands_of
from mission.console.option_checks import UserError, check_engine
from mission.flight_settings import OURS, BoardName, FlightOptions, FlightSettings

VEHICLES_MAX = 100


class Member(NamedTuple):
    """One vehicle of a fleet."""

    airframe: str
    board: BoardName = "own"


def members_of(text: str, airframe: str, board: BoardName = "own") -> list[Member]:
    """The vehicles.

    Args:
        text: a number of them, or `AIRFRAME[@BOARD]:NUMBER,...`.
        airframe: of all of them, where the text is a number.
        board: who flies those for which the text does not say it.

    Raises:
        UserError: it is neither, or there are none or too many, or such a board is not known.
    """
    members: list[Member] = []
    for part in text.split(","):
        name, _, number = part.rpartition(":")
        if not number.isdecimal() or (not name and "," in text):
            raise UserError(
                f"--vehicles {text}: must be a number, or AIRFRAME[@BOARD]:NUMBER,AIRFRAME[@BOARD]:NUMBER,..."
            )
        body, at, flown_by = name.strip().rpartition("@")
        if at and flown_by not in get_args(BoardName):
            raise UserError(f"--vehicles {text}: unknown board '{flown_by}'; known: {', '.join(get_args(BoardName))}")
        member = Member(body, cast(BoardName, flown_by)) if at else Member(name.strip() or airframe, board)
        members += [member] * min(int(number), VEHICLES_MAX + 1)
    if not 0 < len(members) <= VEHICLES_MAX:
        raise UserError(f"--vehicles {text}: must be 1 to {VEHICLES_MAX} vehicles")
    return members


def boards_of(members: Sequence[Member]) -> list[str]:
    """The kinds of programs of others that fly some of them."""
    return list(dict.fromkeys(member.board for member in members if member.board != "own"))


def check_fleet(options: FlightOptions) -> None:
    """Refuses options that several vehicles cannot share, and vehicles that cannot be moved or flown.

    Raises:
        UserError: of such.
    """
    alone = {
        "--owner": options.owner is not None,
        "--state": options.state is not None,
        "--stream-port": options.stream_port != 0,
        "--video-port": bool(options.video_port),
        "--instance": options.instance != 0,
        "--mcap": options.has_mcap,
        "--foxglove": options.has_foxglove,
    }
    for name, is_given in alone.items():
        if is_given:
            raise UserError(f"--vehicles and {name}: choose one, it is for a single vehicle")
    members = members_of(options.vehicles or "1", options.airframe, options.board)
    check_members(options, members)
    boards = boards_of(members)
    commands_of(options.command, boards)
    if not any(member.board in OURS for member in members):
        check_ours(options, boards[0])


def check_members(settings: FlightSettings, members: Sequence[Member]) -> None:
    """Refuses airframes that are none, or that the engine does not move or their board does not fly.

    Raises:
        UserError: of the first such.
    """
    try:
        for airframe, board in dict.fromkeys(members):
            check_engine(settings.model_copy(update={"airframe": airframe}), load_airframe(airframe))
            if board != "own":
                check_flown(settings, airframe, board)
    except AirframeError as error:
        raise UserError(f"--vehicles: {error}") from error
    if sum(member.board == "betaflight" for member in members) > 1:
        raise UserError("--vehicles: one Betaflight at most; its ports are always the same")
