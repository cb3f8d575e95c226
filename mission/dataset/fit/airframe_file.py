"""An airframe file with fitted numbers: the start's entries, of which the fitted ones say from what they come."""

import json
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from common.airframe import AIRFRAME_FOLDER
from common.files import write_whole
from policies.datasets.episodes import DatasetError
from sim.bodies.fit.least_squares import Fit
from sim.bodies.fit.numbers import Fittable


def write_airframe(start: str, fit: Fit, output: Path, origin: str, mass_kg: float | None) -> None:
    """Writes an airframe.

    Args:
        start: name or path of the airframe from which it was fitted.
        fit: what came of it.
        output: the file to make.
        origin: from what it was fitted, for the sources of its numbers.
        mass_kg: as the user weighed it; None: the start's.

    Raises:
        DatasetError: the file cannot be written, or would be no airframe.
    """
    path = Path(start) if start.endswith(".toml") else AIRFRAME_FOLDER / f"{start}.toml"
    entries = tomllib.loads(path.read_text(encoding="utf-8"))
    entries["description"] = f"{entries['name']}, fitted to {origin}"
    entries["name"] = output.stem
    if mass_kg is not None:
        entries["body"]["mass_kg"] = {"value": mass_kg, "source": "weighed: given to the fit"}
    for number, std in fit.stds.items():
        unit = " %" if number.is_factor else ""
        deviation = f"{100 * std:.1f}" if number.is_factor else f"{std:.3f}"
        for field in number.fields:
            value = float(f"{getattr(getattr(fit.airframe, number.section), field):.6g}")
            source = f"fitted to {origin}: ± {deviation}{unit}"
            entries[number.section][field] = {"value": value, "source": source}
        for field in number.followed_by:
            value = float(f"{getattr(getattr(fit.airframe, number.section), field):.6g}")
            source = f"the speed of {path.stem} at idle, by the fitted curve"
            entries[number.section][field] = {"value": value, "source": source}
    for number in fit.unknown:
        for field in number.fields:
            entries[number.section][field]["source"] += "; a fit to logs could not tell it"
    try:
        Fittable.model_validate(entries)
    except ValidationError as error:
        raise DatasetError(f"{output}: what was fitted is no airframe: {error.errors()[0]['msg']}") from error
    try:
        write_whole(output, _toml(entries).encode())
    except OSError as error:
        raise DatasetError(f"{output}: cannot be written: {error.strerror or error}") from error


def _toml(entries: dict[str, Any]) -> str:
    """The text of an airframe's entries: numbers with sources, in tables and in lists of tables."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in entries.items() if isinstance(value, str)]
    for key, value in entries.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]", *_lines(value)]
        elif isinstance(value, list):
            for each in value:
                lines += ["", f"[[{key}]]", *_lines(each)]
    return "\n".join(lines) + "\n"


def _lines(table: dict[str, Any]) -> list[str]:
    sources = {key: json.dumps(entry["source"], ensure_ascii=False) for key, entry in table.items()}
    return [f"{key} = {{ value = {table[key]['value']!r}, source = {source} }}" for key, source in sources.items()]
