"""What goes with `--board`, and what does not; light to import."""

from collections.abc import Sequence
from typing import get_args

from common.airframe import load_airframe
from common.airframes.plane import PlaneAirframe
from mission.console.option_checks import UserError
from mission.flight_settings import OURS, BoardName, FlightOptions, FlightSettings

_OUTSIDE = tuple(name for name in get_args(BoardName) if name != "own")
FLOWN = {
    "ardupilot": ("multirotor", "rover", "plane"),
    "px4": ("multirotor", "rover", "plane"),
    "betaflight": ("multirotor",),
}
FAST = (("ardupilot", "multirotor"), ("betaflight", "multirotor"))
"""Classes of airframes that each flies here, and who exchanges each millisecond."""
_OURS_ALONE = {
    "dialect": "--dialect", "announces_components": "--announce-components", "traffic_count": "--traffic",
    "has_lidar": "--lidar", "has_base": "--rtk", "stream_port": "--stream-port", "video_port": "--video-port",
    "state": "--state", "has_to_sign": "--require-signing",
}  # fmt: skip


def check_ours(options: FlightOptions, board: str) -> None:
    """Refuses options that only our own flight controller has.

    Raises:
        UserError: there is one.
    """
    for name, flag in _OURS_ALONE.items():
        if getattr(options, name) != FlightOptions.model_fields[name].default:
            raise UserError(f"{flag} and --board {board}: choose one; the first is our own flight controller's")


def check_board(options: FlightOptions) -> None:
    """Refuses options that only our own flight controller has, or that its place leaves without meaning.

    Raises:
        UserError: there is one.
    """
    if options.board not in OURS:
        check_ours(options, options.board)
    elif options.instance != 0:
        raise UserError(f"--instance and --board {options.board}: choose one; its ports are always the same")
    check_flown(options, options.airframe, options.board)
    commands_of(options.command, [options.board])


def check_flown(settings: FlightSettings, airframe: str, board: BoardName) -> None:
    """Refuses an airframe that a board does not fly, and settings that it does not fly with.

    Raises:
        UserError: of such.
    """
    body = load_airframe(airframe)
    vehicle = body.vehicle
    if vehicle not in FLOWN[board]:
        raise UserError(f"--board {board}: it flies no {vehicle} here")
    if isinstance(body, PlaneAirframe) and (body.throw is not None or settings.throw_m_s is not None):
        raise UserError(f"--board {board}: it takes off from a runway here, nobody throws it")
    if (board, vehicle) in FAST and settings.engine != "native":
        raise UserError(f"--board {board} and --engine {settings.engine}: only the native one gives it 1,000 Hz")
    if board == "px4" and settings.noise == 0.0:
        raise UserError("--noise 0 and --board px4: it takes sensors that never change for broken; use --noise 0.1")


def commands_of(given: Sequence[str], boards: Sequence[str]) -> dict[str, str]:
    """The command of each board, as far as one is given.

    Args:
        given: `COMMAND`, where one kind of board is flown, or `BOARD=COMMAND` of each kind.
        boards: the kinds that are flown; our own flight controller is none.

    Raises:
        UserError: a command is nobody's, or everybody's, or one too many.
    """
    commands: dict[str, str] = {}
    for text in given:
        board, _, command = text.partition("=")
        if not boards:
            raise UserError(f"--command {text}: no program of others flies here; add --board")
        if board not in _OUTSIDE:
            if len(boards) > 1:
                raise UserError(f"--command {text}: say whose it is: {' or '.join(f'{b}=COMMAND' for b in boards)}")
            board, command = boards[0], text
        if board not in boards:
            raise UserError(f"--command {text}: {board} flies nothing here")
        if board in commands:
            raise UserError(f"--command {text}: {board} has one already")
        commands[board] = command
    return commands
