"""The JSON schema of scenario files, for editors, and the tables of all keys, for the docs; both from the models."""

import json
from collections.abc import Iterator
from typing import Any

from mission.scenario.parts.conditions import QUANTITIES
from mission.scenario.scenario import Scenario
from mission.scenario.scenario_file import READY, find_files, read_scenario

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scenario_schema() -> dict[str, Any]:
    """As JSON values."""
    return {"$schema": DIALECT, **Scenario.model_json_schema(by_alias=True), "title": "Honeyguide scenario"}


def schema_text() -> str:
    """As the file that is published."""
    return json.dumps(scenario_schema(), indent=1, ensure_ascii=False) + "\n"


def reference_text() -> str:
    """A page with a table for each part of a scenario, and the quantities of conditions."""
    schema = scenario_schema()
    parts = {"Scenario": schema, **schema["$defs"]}
    order = list(dict.fromkeys(["Scenario", *_reachable("Scenario", parts)]))
    tables = [part_table(name, parts[name]) for name in order]
    rows = "\n".join(f"| `{name}` | {unit} | {meaning} |" for name, (unit, meaning) in QUANTITIES.items())
    quantities = f"## Quantities\n\nOf conditions.\n\n| name | unit | meaning |\n|---|---|---|\n{rows}\n"
    shipped = [(path, read_scenario(path)) for path in find_files([READY])]
    lines = "\n".join(
        f"| [{scenario.name}]({_READY_URL}/{path.name}) | {scenario.about} |" for path, scenario in shipped
    )
    ready = f"## Those that ship\n\n| scenario | shows |\n|---|---|\n{lines}\n"
    return "\n".join([_HEADER, *tables, quantities, ready])


_READY_URL = "../../mission/scenario/ready"
_HEADER = """# Keys of scenario files

Written by `python -m docs.generate` from the models: do not edit. How they are used:
[scenarios](../how-to/scenarios.md). The same for editors: [scenario.schema.json](scenario.schema.json).
"""


def _reachable(name: str, parts: dict[str, Any]) -> Iterator[str]:
    """The parts that a part is made of, in the order in which they are met."""
    for reference in _references(parts[name]):
        yield reference
    for reference in _references(parts[name]):
        yield from _reachable(reference, parts)


def _references(schema: Any) -> list[str]:
    if isinstance(schema, dict):
        own = [schema["$ref"].rpartition("/")[2]] if "$ref" in schema else []
        return own + [name for key, value in schema.items() if key != "$defs" for name in _references(value)]
    return [name for value in schema for name in _references(value)] if isinstance(schema, list) else []


def part_table(name: str, schema: dict[str, Any]) -> str:
    """The table of one part's keys."""
    body = next((each for each in schema.get("anyOf", ()) if "properties" in each), schema)
    short = body is not schema and "enum" not in schema["anyOf"][0]
    about = body.get("description", "").split("\n\n")[0].replace("\n", " ")
    if "properties" not in body:
        return f"## {name}\n\n{about}\n"
    required = set(body.get("required", ()))
    rows = [_row(key, value, is_required=key in required) for key, value in body["properties"].items()]
    alone = f" May be written as its `{next(iter(body['properties']))}` alone." if short else ""
    head = "| key | value | default | meaning |\n|---|---|---|---|"
    return f"## {name}\n\n{about}{alone}\n\n{head}\n" + "\n".join(rows) + "\n"


def _row(key: str, schema: dict[str, Any], *, is_required: bool) -> str:
    default = "" if schema.get("default") in (None, "", [], {}) else f"`{json.dumps(schema['default'])}`"
    if isinstance(schema.get("default"), dict):
        default = ""
    meaning = schema.get("description", "").replace("\n", " ").replace("|", "\\|")
    return f"| `{key}` | {_value(schema)} | {'required' if is_required else default} | {meaning} |"


def _value(schema: dict[str, Any]) -> str:
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "enum" in schema:
        return ", ".join(str(each) for each in schema["enum"])
    if "const" in schema:
        return str(schema["const"])
    if "anyOf" in schema:
        return " or ".join(_value(each) for each in schema["anyOf"] if each.get("type") != "null")
    if schema.get("type") == "array":
        if "prefixItems" in schema:
            return f"{len(schema['prefixItems'])} numbers"
        return f"list of {_value(schema['items'])}"
    if "$ref" in (schema.get("additionalProperties") or {}):
        names = schema.get("propertyNames", {}).get("enum", ())
        return f"{_value(schema['additionalProperties'])} by key{': ' if names else ''}{', '.join(names)}"
    if schema.get("type") == "object":
        return "bounds by name" if "propertyNames" in schema else "numbers by name"
    return _TYPES.get(schema.get("type", ""), "") + _bounds(schema)


_TYPES = {"string": "text", "number": "number", "integer": "whole number", "boolean": "true or false"}


def _bounds(schema: dict[str, Any]) -> str:
    low = next(
        (f"{word}{schema[key]:g}" for key, word in (("minimum", ""), ("exclusiveMinimum", "above ")) if key in schema),
        "",
    )
    high = next((f"{schema[key]:g}" for key in ("maximum", "exclusiveMaximum") if key in schema), "")
    return f", {low} to {high}" if low and high else f", from {low}" if low else f", to {high}" if high else ""
