"""The published schema is that of the models, and takes what they take."""

import json

import pytest
import yaml
from jsonschema import Draft202012Validator

from mission.scenario.parts.checks import Check
from mission.scenario.parts.steps import Step
from mission.scenario.scenario_file import READY, find_files
from mission.scenario.schema import reference_text, scenario_schema, schema_text


def takes(schema, value, root):
    """Whether a schema takes a value, as the reference validator of JSON schemas says."""
    Draft202012Validator.check_schema(root)
    return Draft202012Validator(schema).is_valid(value)


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
