"""The layout that ships names channels, fields and panels that there are."""

import json
import re

from foxglove import layouts
from typer.testing import CliRunner

from mission.cli import app
from mission.foxglove.channels import CHANNELS, NUMBERS
from mission.foxglove.mcap_command import LAYOUT

DATA = json.loads(LAYOUT.read_text(encoding="utf-8"))
PANELS = {"3D": "ThreeDee", "map": "Map", "RosOut": "Log"}  # in files of the app, and in foxglove.layouts
TOPICS = {spec.topic for spec in CHANNELS}


def panels(node):
    """The panels of a part of the layout."""
    if isinstance(node, dict):
        return panels(node["first"]) | panels(node["second"])
    tabs = DATA["configById"][node].get("tabs", ())
    return {node}.union(*(panels(tab["layout"]) for tab in tabs))


def test_every_panel_is_placed_and_described():
    assert panels(DATA["layout"]) == set(DATA["configById"])


def test_its_panels_are_foxgloves_with_keys_that_they_have():
    for name, config in DATA["configById"].items():
        kind = name.partition("!")[0]
        if kind != "Tab":
            known = getattr(layouts, f"{PANELS.get(kind, kind)}Config".replace("ThreeDeeConfig", "ThreeDeeConfig"))()
            extra = {"title", "imageMode"} if kind in ("3D", "Plot") else set()
            assert set(config) - extra <= set(known._to_dict()), name


def test_its_topics_are_channels():
    text = LAYOUT.read_text(encoding="utf-8")
    named = re.findall(r'"(/[\w/]+)', text)
    assert len(named) > 30
    assert [topic for topic in named if topic not in TOPICS] == []


def test_what_it_plots_is_in_the_schemas():
    numbers = {spec.topic: spec for spec in NUMBERS}
    for path in re.findall(r'"value": "(/[^"]+)"', LAYOUT.read_text(encoding="utf-8")):
        topic, _, rest = path.partition(".")
        schema = numbers[topic].json_schema()
        for part in rest.partition("[")[0].split("."):
            if not schema["properties"]:
                break  # what the estimator fuses depends on the vehicle
            schema = schema["properties"][part]


def test_the_command_prints_it():
    result = CliRunner().invoke(app, ["mcap", "--layout"])
    assert json.loads(result.output) == DATA
