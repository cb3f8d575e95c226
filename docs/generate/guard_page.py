"""The text of docs/reference/guard-settings.md, made from the settings themselves."""

from typing import Any

from policies.companion.guard.settings import SETTINGS, GuardSettings

HEADER = """\
# Settings of the guard

Written by `python -m docs.generate` from the code: do not edit.

Numbers of [the guard](../how-to/follow-me.md#the-guard) under a policy. `follow`, `park`, `companion` and `benchmark`
take them as `--guard-setting NAME=VALUE`, again and again; a scenario's vehicle has them as `guard` of its `policy`:

    policy: {name: follow-me-tracked, guard: {owner_m: 1.5, search_s: 3}}

An unknown name, and a value out of its range, is refused before anything flies. Names that end with `_s` are seconds,
with `_m` metres. Those of scans, the nose, the hull and `goal_` are of
[who goes to goals](../how-to/navigate.md#the-guard). Figures in the documentation are of the defaults.

| name | default | range | meaning |
|---|---|---|---|
"""
_SIGNS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤"}


def guard_text() -> str:
    """The whole page."""
    fields = GuardSettings.model_json_schema()["properties"]
    return HEADER + "".join(_row(name, fields[name]) for name in SETTINGS)


def _row(name: str, schema: dict[str, Any]) -> str:
    bounds = ", ".join(f"{sign} {schema[key]:g}" for key, sign in _SIGNS.items() if key in schema)
    return f"| `{name}` | {schema['default']:g} | {bounds} | {' '.join(schema['description'].split())} |\n"
