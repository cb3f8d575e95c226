"""The text of docs/reference/foxglove-channels.md, made from the channels themselves."""

from mission.foxglove.channels import CHANNELS, ChannelSpec, NumbersSpec

HEADER = """\
# Channels for Foxglove

Written by `python -m docs.generate` from the code: do not edit.

What [`--mcap`, `--foxglove` and `honeyguide mcap`](../how-to/foxglove.md) tell. Schemas `foxglove.*` are its own, as
protobuf; the others are JSON objects with a JSON schema. Rates are the most there is, in simulated time.

| topic | schema | rate | what it tells |
|---|---|---|---|
"""
FIELDS = """
## What is plotted

Paths are written as Foxglove's plots take them. A number that is not known is left out.

| path | meaning |
|---|---|
"""


def foxglove_text() -> str:
    """The whole page."""
    return HEADER + "\n".join(map(_row, CHANNELS)) + "\n" + FIELDS + "\n".join(_paths()) + "\n"


def _row(spec: ChannelSpec) -> str:
    rate = f"{spec.rate_hz:g} Hz" if spec.rate_hz else "once"
    return f"| `{spec.topic}` | `{spec.schema}` | {rate} | {spec.meaning} |"


def _paths() -> list[str]:
    found = []
    for spec in CHANNELS:
        if isinstance(spec, NumbersSpec):
            found += [f"| `{spec.topic}.{name}` | {_meaning(rule)} |" for name, rule in spec.properties.items()]
    return found


def _meaning(rule: dict[str, object]) -> str:
    """Of a rule of a JSON schema."""
    inner = rule.get("properties")
    if isinstance(inner, dict):
        (meaning,) = {field["description"] for field in inner.values()}
        return f"`.{'`, `.'.join(inner)}`: {meaning}"
    items = rule.get("items")
    return str(items["description"] if isinstance(items, dict) else rule.get("description", rule["type"]))
