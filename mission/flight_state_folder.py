"""The state folder of `honeyguide fly --state`: opening it, and the home that it remembers."""

from pathlib import Path

from autopilot.persistence import GIVEN_HOME
from common.geodesy import DEFAULT_HOME, GeoPoint
from common.state_folder import StateFolder

HOME = "home"  # the record
ALT_MAX_M = 10_000.0


class StateError(ValueError):
    """The folder cannot be used; the message is one sentence."""


def open_state(folder: Path) -> StateFolder:
    """Opens a state folder, or begins one.

    Raises:
        StateError: another flight has it, or it cannot be written.
    """
    try:
        return StateFolder(folder)
    except BlockingIOError as error:
        raise StateError(f"--state {folder}: another flight is using it") from error
    except OSError as error:
        raise StateError(f"--state {folder}: cannot be used: {error.strerror}") from error


def stored_home(state: StateFolder | None) -> GeoPoint:
    """Where the vehicle boots if nothing else is said: the home given last, or the default."""
    stored = {} if state is None else state.read(HOME)
    try:
        home = GeoPoint(float(stored["lat_deg"]), float(stored["lon_deg"]), float(stored["alt_m"]))
    except (KeyError, TypeError, ValueError, OverflowError):
        return DEFAULT_HOME
    is_on_earth = abs(home.lat_deg) <= 90.0 and abs(home.lon_deg) <= 180.0 and abs(home.alt_m) <= ALT_MAX_M
    return home if is_on_earth else DEFAULT_HOME


def keep_home(state: StateFolder, home: GeoPoint) -> None:
    """Remembers a home that was given."""
    state.write(HOME, {"lat_deg": home.lat_deg, "lon_deg": home.lon_deg, "alt_m": home.alt_m})
    state.write(GIVEN_HOME, {})  # a client's home belongs to the place of before
