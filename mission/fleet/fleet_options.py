"""Which vehicles `--vehicles` asks for, and what does not go with it; light to import.

In: the options. Out: the airframe of each vehicle.
"""

from common.airframe import AirframeError, load_airframe
from mission.console.option_checks import UserError, check_engine
from mission.flight_settings import FlightOptions

VEHICLES_MAX = 100


def airframes_of(text: str, airframe: str) -> list[str]:
    """The airframe of each vehicle.

    Args:
        text: a number of vehicles, or `AIRFRAME:NUMBER,...`.
        airframe: of all of them, where the text is a number.

    Raises:
        UserError: it is neither, or there are none or too many.
    """
    airframes: list[str] = []
    for part in text.split(","):
        name, _, number = part.rpartition(":")
        if not number.isdecimal() or (not name and "," in text):
            raise UserError(f"--vehicles {text}: must be a number, or AIRFRAME:NUMBER,AIRFRAME:NUMBER,...")
        airframes += [name.strip() or airframe] * min(int(number), VEHICLES_MAX + 1)
    if not 0 < len(airframes) <= VEHICLES_MAX:
        raise UserError(f"--vehicles {text}: must be 1 to {VEHICLES_MAX} vehicles")
    return airframes


def check_fleet(options: FlightOptions) -> None:
    """Refuses options that several vehicles cannot share, and airframes that are none or that the engine does not move.

    Raises:
        UserError: of such.
    """
    alone = {
        "--owner": options.owner is not None,
        "--state": options.state is not None,
        "--stream-port": options.stream_port != 0,
        "--video-port": bool(options.video_port),
        "--board betaflight": options.board == "betaflight",
    }
    for name, is_given in alone.items():
        if is_given:
            raise UserError(f"--vehicles and {name}: choose one, it is for a single vehicle")
    try:
        for airframe in dict.fromkeys(airframes_of(options.vehicles or "1", options.airframe)):
            check_engine(options.model_copy(update={"airframe": airframe}), load_airframe(airframe))
    except AirframeError as error:
        raise UserError(f"--vehicles {options.vehicles}: {error}") from error
