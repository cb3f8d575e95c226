"""The published schema is that of the models, and takes what they take."""

import json

import pytest
import yaml

from mission.scenario.parts.checks import Check
from mission.scenario.parts.steps import Step
from mission.scenario.scenario_file import READY, find_files
from mission.scenario.schema import reference_text, scenario_schema, schema_text


def takes(schema, value, root):
    """Whether a schema takes a value, as far as our schemas go: no format, no pattern, no uniqueness."""
    if "$ref" in schema:
        return takes(root["$defs"][schema["$ref"].rpartition("/")[2]], value, root)
    if "anyOf" in schema:
        return any(takes(each, value, root) for each in schema["anyOf"])
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "const" in schema:
        return value == schema["const"]
    types = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}
    kind = schema.get("type")
    if kind in ("number", "integer"):
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    if kind in types and not isinstance(value, types[kind]):
        return False
    if kind == "array" and "items" in schema and isinstance(schema["items"], dict):
        return all(takes(schema["items"], each, root) for each in value)
    if kind == "object" and "properties" in schema:
        known = schema["properties"]
        is_known = value.keys() <= known.keys() and set(schema.get("required", ())) <= value.keys()
        return is_known and all(takes(known[key], each, root) for key, each in value.items())
    return True


@pytest.mark.parametrize("path", find_files([READY]), ids=lambda path: path.name.partition(".")[0])
def test_the_schema_takes_what_ships(path):
    schema = scenario_schema()
    given = yaml.safe_load(path.read_text(encoding="utf-8").replace("mode: off", "mode: 'off'"))
    assert takes(schema, given, schema)


def test_the_schema_refuses_a_wrong_key_and_a_wrong_name():
    schema = scenario_schema()
    assert not takes(schema, {"aboot": "no"}, schema)
    assert not takes(schema, {"vehicle": {"script": ["arn"]}}, schema)
    assert takes(schema, {"vehicle": {"script": ["arm", {"takeoff": 3}, {"takeoff": {"height_m": 3}}]}}, schema)


def test_the_page_has_every_key():
    page = reference_text()
    for name in (*Step.names(), *Check.names()):
        assert f"| `{name}` |" in page


def test_the_schema_is_json():
    assert json.loads(schema_text())["title"] == "Honeyguide scenario"
