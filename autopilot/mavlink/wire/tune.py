"""Tunes in the format of QBASIC's PLAY, as MAVLink's TUNE_FORMAT_QBASIC1_1: how many notes, and how long."""

import re

_TEMPO = 120  # quarter notes per minute, QBASIC's default
_LENGTH = 4
# One element: a note with an accidental, length and dots; a numbered note; a pause; or a setting.
_ELEMENT = re.compile(
    r"(?P<note>[A-G])[#+-]?(?P<note_length>\d*)(?P<note_dots>\.*)"
    r"|N(?P<number>\d+)"
    r"|P(?P<pause_length>\d*)(?P<pause_dots>\.*)"
    r"|(?P<setting>[LOT])(?P<value>\d+)"
    r"|M(?P<style>[NLSBF])"
    r"|(?P<octave>[<>])"
)
_LIMITS = {"L": (1, 64), "O": (0, 6), "T": (32, 255)}
_NOTES_MAX = 1_000


class TuneError(ValueError):
    """A tune that cannot be played; the text says why."""


def tune_length_s(tune: str) -> tuple[int, float]:
    """Number of notes and length [s] of a tune.

    Raises:
        TuneError: it is not in the format, or has no notes.
    """
    text = re.sub(r"\s", "", tune.upper())
    length, tempo = _LENGTH, _TEMPO
    at, notes, quarters_s = 0, 0, 0.0
    while at < len(text):
        match = _ELEMENT.match(text, at)
        if match is None:
            raise TuneError(f"'{text[at]}' at {at + 1} is not understood")
        at = match.end()
        if match["setting"]:
            value = _checked(match["setting"], int(match["value"]))
            length = value if match["setting"] == "L" else length
            tempo = value if match["setting"] == "T" else tempo
        elif match["note"] or match["number"]:
            notes += 1
            quarters_s += _time_s(match["note_length"], match["note_dots"], length, tempo)
        elif match["pause_length"] is not None:
            quarters_s += _time_s(match["pause_length"], match["pause_dots"], length, tempo)
    if not 0 < notes <= _NOTES_MAX:
        raise TuneError("there are no notes" if notes == 0 else f"more than {_NOTES_MAX} notes")
    return notes, quarters_s


def _checked(setting: str, value: int) -> int:
    low, high = _LIMITS[setting]
    if not low <= value <= high:
        raise TuneError(f"{setting}{value} is not between {low} and {high}")
    return value


def _time_s(length: str | None, dots: str | None, default: int, tempo: int) -> float:
    divisor = _checked("L", int(length)) if length else default
    return 4.0 / divisor * 60.0 / tempo * (2.0 - 0.5 ** len(dots or ""))
