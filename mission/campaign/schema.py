"""The JSON schema of campaign files, for editors, and the tables of their keys, for the docs; both from the models."""

import json
from typing import Any

from mission.campaign.campaign import Campaign
from mission.scenario.schema import DIALECT, part_table

PARTS = ("Distribution", "Normal", "Search", "Boundary", "Worst", "Rare")


def campaign_schema() -> dict[str, Any]:
    """As JSON values."""
    return {"$schema": DIALECT, **Campaign.model_json_schema(by_alias=True), "title": "Honeyguide campaign"}


def schema_text() -> str:
    """As the file that is published."""
    return json.dumps(campaign_schema(), indent=1, ensure_ascii=False) + "\n"


def reference_text() -> str:
    """A page with a table for each part of a campaign; those of its scenario are on another."""
    schema = campaign_schema()
    parts = {"Campaign": schema, **{name: schema["$defs"][name] for name in PARTS}}
    text = "\n".join([_HEADER, *(part_table(name, part) for name, part in parts.items())])
    return text.replace("[Scenario](#scenario)", "[scenario](scenario-keys.md#scenario)")


_HEADER = """# Keys of campaign files

Written by `python -m docs.generate` from the models: do not edit. How they are used:
[campaigns](../how-to/campaigns.md). The same for editors: [campaign.schema.json](campaign.schema.json).
"""
